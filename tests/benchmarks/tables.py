"""Results as markdown tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tests.benchmarks.race import ratio, seconds
from tests.benchmarks.shadowed import cost
from tests.benchmarks.targets import KINDS, targets
from tests.benchmarks.textured import nanoseconds

STAGES = (
    *("bin: first pass", "bin: second pass", "bin", "prewarp", "clear", "small triangles"),
    *("large triangles", "visibility", "shade", "store", "rest"),
)


def table(head: Sequence[str], rows: Iterable[Sequence[object]], words: int = 1) -> str:
    """A markdown table; the first `words` columns are words, the others numbers."""
    align = ["---" if column < words else "---:" for column in range(len(head))]
    lines = [head, align, *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def ms(value: float) -> str:
    """Seconds as milliseconds, a dash for what was not measured."""
    return "–" if math.isnan(value) else f"{value * 1e3:,.0f}"


def share(value: float) -> str:
    """A ratio with two digits."""
    if math.isnan(value):
        return "–"
    return f"{value:.3f}" if value < 0.1 else f"{value:.2f}"


def target_table(results: Mapping[str, Any]) -> str:
    """Every target, with what was found."""
    rows = [
        (t.what, t.where, f"{share(t.value)}{t.unit}", f"≤ {t.limit:g}", "yes" if t.met else "**no**")
        for t in targets(results)
    ]
    return table(("what", "where", "found", "target", "met"), rows, 2)


def time_table(results: Mapping[str, Any], clock: str = "wall") -> str:
    """Milliseconds of every contestant, `wall` or processor time of all processes (`cpu`)."""
    ours = ("bin", "keys", "hits", "frame 1", "frame 2", "matte 2")
    rows = []
    for name, found in results.get("duels", {}).items():
        times = found["times"]
        for kind in KINDS:
            pixels = f"{found['counts']['lit pixels'] / 1e6:.1f}"
            cells = [ms(seconds(times, f"{kind} {what}", clock)) for what in ours]
            theirs = ("embree", f"opengl {kind} draw", f"opengl {kind} lambert draw")
            cells += [ms(seconds(times, who, clock)) for who in theirs]
            cells += [ms(seconds(times, who, clock)) for who in ("opengl read", "write zip", "write zstd")]
            rows.append((name, kind, pixels, *cells))
    head = ("scene/display", "", "Mpixel", *ours, "Embree", "GL draws", "GL matte", "GL read", "ZIP", "ZSTD")
    return table(head, rows, 2)


def ratio_table(results: Mapping[str, Any], clock: str = "wall") -> str:
    """Ours over theirs; below 1 we are faster. Of single threads always processor time."""
    rows = []
    for name, found in results.get("duels", {}).items():
        times = found["times"]
        for kind in KINDS:
            keys, frame, draw = f"{kind} keys", f"{kind} frame 2", f"opengl {kind} draw"
            matte, matte_draw = f"{kind} matte 2", f"opengl {kind} lambert draw"
            values = (
                ratio(times, keys, "embree", "cpu"),
                ratio(times, (f"{kind} bin", keys), "embree", "cpu"),
                ratio(times, frame, "embree", clock),
                ratio(times, frame, draw, clock),
                ratio(times, frame, (draw, "opengl read"), clock),
                ratio(times, matte, matte_draw, clock),
                ratio(times, matte, (matte_draw, "opengl read"), clock),
                ratio(times, frame, "write zip", clock),
            )
            rows.append((name, kind, *map(share, values)))
    embree = ("keys / Embree", "bin + keys / Embree", "frame / Embree")
    others = ("frame / GL draws", "… and read", "matte / GL matte", "… and read", "frame / ZIP")
    return table(("scene/display", "", *embree, *others), rows, 2)


def shadow_table(results: Mapping[str, Any]) -> str:
    """What shadows take, by scene and lamp."""
    rows = []
    for name, found in results["shadows"].items():
        for kind in found["lamps"]:
            without, with_them = (nanoseconds(found, f"{kind}, {how}") for how in ("without", "with"))
            rows.append((name, kind, f"{without:,.0f}", f"{with_them:,.0f}", f"{cost(found, kind):,.0f}"))
    head = ("scene", "", "ns a pixel without", "with", "ns a pixel and lamp")
    return table(head, rows, 2)


def texture_table(results: Mapping[str, Any]) -> str:
    """Textured frames beside plain ones, in processor time of one process."""
    rows = []
    for name, found in results["textures"].items():
        for kind in ("plain", "trilinear", "anisotropic"):
            one, many = (nanoseconds(found, f"{kind}{more}") for more in ("", ", 16 samples"))
            more, theirs = one / nanoseconds(found, "plain"), nanoseconds(found, f"opengl {kind}")
            rows.append((name, kind, ns(one), share(more), ns(many), f"{many / one:.1f}", ns(theirs)))
    head = ("scene", "", "ns a pixel", "/ plain", "16 samples", "/ 1 sample", "GL draws")
    return table(head, rows, 2)


def ns(value: float) -> str:
    """Nanoseconds, a dash for what was not measured."""
    return "–" if math.isnan(value) else f"{value:,.0f}"


def sequence_table(results: Mapping[str, Any]) -> str:
    """The sequences."""
    rows = [
        (
            one["compression"],
            one["frames"],
            f"{one['sequence']:.1f} s",
            f"{one['drawing']:.1f} s",
            f"{one['writing alone']:.1f} s",
            share(one["sequence"] / one["writing alone"]),
            f"{one['memory'] / 1e9:.2f} GB",
        )
        for one in results.get("sequences", [])
    ]
    head = ("compression", "frames", "sequence", "drawing", "writing alone", "ratio", "memory, most")
    return table(head, rows)


def curve_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """One of the curves."""
    head = (
        "display",
        "facets",
        "lit",
        "Mpixel",
        "visible",
        "triangles",
        "block pairs",
        "ours",
        "GL sorted",
        "GL whole mesh",
    )
    return table(
        head,
        [
            (
                row["display"],
                row["facets"],
                row["lit"],
                f"{row['quilt pixels'] / 1e6:.1f}",
                f"{row['visible pixels'] / 1e6:.2f}",
                f"{row['triangles']:,}",
                f"{row['block pairs']:,}",
                *(ms(seconds(row["times"], name)) for name in ("frame 2", "opengl sorted", "opengl whole")),
            )
            for row in rows
        ],
    )


def stage_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Milliseconds by stage."""
    lines = [(row["display"], *(ms(row["stages"].get(stage, 0.0)) for stage in STAGES)) for row in rows]
    return table(("display", *STAGES), lines)


def comparison(new: Mapping[str, Any], old: Mapping[str, Any], clock: str = "wall") -> str:
    """Our times now over those of an earlier run, as they are and against what Embree took in each."""
    rows = []
    for name in new.get("duels", {}):
        if name not in old.get("duels", {}):
            continue
        now, then = new["duels"][name]["times"], old["duels"][name]["times"]
        for who in now:
            if who in then:
                before, after = seconds(then, who, clock), seconds(now, who, clock)
                scaled = ratio(now, who, "embree", clock) / ratio(then, who, "embree", clock)
                rows.append((name, who, ms(before), ms(after), share(after / before), share(scaled)))
    return table(("scene/display", "what", "then", "now", "now / then", "against Embree"), rows, 2)
