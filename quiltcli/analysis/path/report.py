"""A take in words, in a table and as data."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from quiltcli.analysis.info.record import bounds, bounds_text, counted, finite
from quiltcli.analysis.path.study import PathStudy
from quiltcli.viewer.recorded.clean import Gap

GAP_COLUMNS = ("from, s", "to, s", "seconds", "what")


def lines(study: PathStudy) -> Iterator[tuple[str, str]]:
    """Label and text of everything there is to say."""
    cleaned, take = study.head.cleaned, study.head.take
    first, last = study.head.seconds
    yield "subject", take.subject
    rate = f" at {1 / cleaned.step:.4g} a second" if cleaned.step > 0 else ""
    yield "samples", f"{len(take.times):,}{rate}, seconds {first:.3f} to {last:.3f}"
    if take.rotations is None:
        yield "rotations", "none: enough for one eye"
    if study.seconds is not None:
        yield "frames", f"show seconds {study.seconds[0]:.3f} to {study.seconds[1]:.3f}"
    yield "lost", f"{counted(cleaned.lost, 'sample')}{_share(cleaned.lost, len(take.times))}"
    if cleaned.doubled:
        yield "doubled", f"{counted(cleaned.doubled, 'sample')} with the stamp of another, merged"
    yield "gaps", _gaps_text(cleaned.filled, [gap for gap in cleaned.gaps if not gap.is_jump])
    yield "jumps", _jumps_text(len(cleaned.jumps), len(cleaned.spikes))
    if cleaned.turns.size:
        seconds = ", ".join(f"{time:.3f}" for time in cleaned.turns[:5]) + " …" * (cleaned.turns.size > 5)
        yield "turns", f"{counted(cleaned.turns.size, 'turn')} faster than any head, at second {seconds}"
    if study.speed.size:
        mean, most = float(study.speed.mean()), float(study.speed.max())
        yield "speed", f"{mean:.3g} m/s on average, {most:.3g} m/s at most"
    yield "box", bounds_text(bounds(study.places))
    if not take.is_curve:
        turn = f", {math.degrees(cleaned.turn_noise):.3f}°" if cleaned.turn_noise is not None else ""
        yield "noise", f"{1000 * cleaned.noise:.3f} mm{turn} (one standard deviation of a coordinate)"
    yield "filter", _filter_text(study)
    yield from _error_lines(study)
    for notice in take.notices:
        yield "note", notice


def _share(part: int, whole: int) -> str:
    return f" ({100 * part / whole:.2g} %)" if part else ""


def _gaps_text(filled: tuple[Gap, ...], left: list[Gap]) -> str:
    """Gaps in words."""
    if not filled and not left:
        return "none"
    words = []
    if filled:
        longest = max(gap.seconds for gap in filled)
        words.append(f"{len(filled)} filled, the longest of {longest:.3f} s")
    if left:
        words.append(f"{len(left)} too long to fill, the longest of {max(g.seconds for g in left):.3f} s")
    return "; ".join(words)


def _jumps_text(jumps: int, spikes: int) -> str:
    if not jumps and not spikes:
        return "none"
    return f"{jumps} that stay, {counted(spikes, 'sample')} that came back left out"


def _filter_text(study: PathStudy) -> str:
    if study.filter == "none":
        return "none"
    rms, most = _moved(study)
    return f"{study.filter}, which moves samples by {rms:.3f} mm (RMS), {most:.3f} mm at most"


def _moved(study: PathStudy) -> tuple[float, float]:
    return float(np.sqrt(np.mean(study.moved_mm**2))), float(study.moved_mm.max())


def _error_lines(study: PathStudy) -> Iterator[tuple[str, str]]:
    """What an eye off by the noise does."""
    noise = study.head.cleaned.noise
    if study.error is not None:
        error = study.error
        yield (
            "picture",
            f"an eye off by {1000 * noise:.3f} mm moves far things by {error.pixels:.3f} pixels (RMS),"
            f" at most {error.worst:.3f}, on facet {error.facet} in frame {error.frame}; half as much at"
            " twice the facet's distance, nothing in its plane",
        )
    elif noise > 0:
        yield (
            "picture",
            f"an eye off by {1000 * noise:.3f} mm moves far things as much on a screen faced squarely (give a"
            " job, to know it in pixels)",
        )


def gap_rows(study: PathStudy) -> list[tuple[str, ...]]:
    """A row for each gap that is not filled and each jump."""
    return [
        (f"{gap.first:.3f}", f"{gap.last:.3f}", f"{gap.seconds:.3f}", "jump" if gap.is_jump else "gap")
        for gap in study.head.cleaned.gaps
    ]


def as_data(study: PathStudy) -> dict[str, Any]:
    """Everything, for programs; lengths in metres unless the key says otherwise."""
    cleaned, take = study.head.cleaned, study.head.take
    rms, most = _moved(study)
    error = study.error
    found = {
        "file": str(study.file),
        "subject": take.subject,
        "samples": len(take.times),
        "rate": 1 / cleaned.step if cleaned.step > 0 else None,
        "seconds": list(study.head.seconds),
        "frames_seconds": None if study.seconds is None else list(study.seconds),
        "rotations": take.rotations is not None,
        "lost": cleaned.lost,
        "doubled": cleaned.doubled,
        "spikes": cleaned.spikes.tolist(),
        "filled": [[gap.first, gap.last] for gap in cleaned.filled],
        "gaps": [[gap.first, gap.last] for gap in cleaned.gaps if not gap.is_jump],
        "jumps": [[gap.first, gap.last] for gap in cleaned.jumps],
        "turns": cleaned.turns.tolist(),
        "speed": {"mean": float(study.speed.mean()), "max": float(study.speed.max())}
        if study.speed.size
        else None,
        "box": bounds(study.places),
        "noise_mm": 1000 * cleaned.noise,
        "noise_deg": None if cleaned.turn_noise is None else math.degrees(cleaned.turn_noise),
        "filter": study.filter,
        "filter_moves_mm": {"rms": rms, "max": most},
        "picture_error": None
        if error is None
        else {"pixels": error.pixels, "worst": error.worst, "facet": error.facet, "frame": error.frame},
        "notices": list(take.notices),
    }
    return {key: finite(value) for key, value in found.items()}
