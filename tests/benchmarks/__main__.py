"""Measure, tell, keep: `python -m tests.benchmarks`, from the root of the repository."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import tempfile
import time
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click

from tests.benchmarks import (
    curves,
    duels,
    meshes,
    moving,
    opengl,
    page,
    rings,
    sequence,
    shadowed,
    sorting,
    tables,
    textured,
)
from tests.benchmarks.race import canary, crowding

ROOT = Path(__file__).parents[2]
PARTS = (
    "duels",
    "textures",
    "shadows",
    "moving",
    "sequences",
    "facets",
    "sorting",
    "pixels",
    "triangles",
    "rings",
)


@click.command(help=__doc__)
@click.option("--quick", is_flag=True, help="A few configurations, few rounds: about a minute.")
@click.option("--only", type=click.Choice(PARTS), multiple=True, help="Only these parts.")
@click.option("--config", "names", type=click.Choice(duels.NAMES), multiple=True, help="Only these duels.")
@click.option("--rounds", type=click.IntRange(1), help="Rounds; 3, or 2 with --quick.")
@click.option(
    "--json", "kept", type=click.Path(dir_okay=False, path_type=Path), help="Where results are kept."
)
@click.option(
    "--against", type=click.Path(exists=True, path_type=Path), help="Earlier results to compare with."
)
@click.option(
    "--clock",
    type=click.Choice(("wall", "cpu")),
    default="wall",
    help="Print wall seconds, or processor time of all processes, which a busy machine changes less.",
)
@click.option("--docs", is_flag=True, help="Put tables and pictures into docs.")
@click.option(
    "--from", "given", type=click.Path(exists=True, path_type=Path), help="Measure nothing, take results."
)
def main(
    quick: bool,
    only: tuple[str, ...],
    names: tuple[str, ...],
    rounds: int | None,
    kept: Path | None,
    against: Path | None,
    clock: str,
    docs: bool,
    given: Path | None,
) -> None:
    """Measure what is asked for."""
    kept = kept or ROOT / "out" / "bench" / f"{_commit()}.json"
    results: dict[str, Any] = json.loads(given.read_text()) if given else {}
    if not given:
        kept.parent.mkdir(parents=True, exist_ok=True)
        _measure(results, kept, rounds or (2 if quick else 3), only or PARTS, names, quick=quick)
        click.echo(f"\nkept in {kept}")
    _tell(results, clock)
    if against:
        click.echo("\n" + tables.comparison(results, json.loads(against.read_text()), clock))
    if docs:
        click.echo("\n".join(f"wrote {path.relative_to(ROOT)}" for path in page.write_docs(results)))


def _measure(
    results: dict[str, Any],
    kept: Path,
    rounds: int,
    parts: tuple[str, ...],
    names: tuple[str, ...],
    *,
    quick: bool,
) -> None:
    """Fill `results`, keeping them after every part."""
    start = time.perf_counter()

    def keep(words: str) -> None:
        kept.write_text(json.dumps(results, indent=1) + "\n")
        click.echo(f"{time.perf_counter() - start:6.1f} s  {words}", err=True)

    results["machine"] = _machine()
    keep("begin")
    with tempfile.TemporaryDirectory() as scratch:
        if "duels" in parts:
            for name in names or (duels.QUICK if quick else duels.NAMES):
                found = duels.duel(name, rounds, Path(scratch), quick=quick)
                results.setdefault("duels", {})[name] = found
                keep(name)
        if "textures" in parts:
            for name in ("mixed",) if quick else textured.SCENES:
                results.setdefault("textures", {})[name] = textured.measure(name, rounds, Path(scratch))
                keep(f"textures, {name}")
        if "shadows" in parts:
            for name in ("mixed",) if quick else textured.SCENES:
                results.setdefault("shadows", {})[name] = shadowed.measure(name, rounds)
                keep(f"shadows, {name}")
        if "moving" in parts:
            results["moving"] = moving.measure(rounds, Path(scratch), quick=quick)
            keep("moving")
        if "sequences" in parts:
            for compression in ("zip",) if quick else ("zip", "zstd"):
                one = sequence.measure(meshes.detailed(3), 4 if quick else 20, compression, Path(scratch))
                results.setdefault("sequences", []).append(one)
                keep(f"sequence, {compression}")
        if "rings" in parts:
            results["rings"] = rings.measure(1 if quick else 4, rings.QUICK if quick else 288)
            keep("rings")
        made = results.setdefault("curves", {})
        if "facets" in parts:
            made["facets"] = list(curves.by_facets(rounds, curves.MODELS[:4:3] if quick else curves.MODELS))
            keep("facets")
        if "sorting" in parts:
            names_of = curves.MODELS[:4:3] if quick else curves.MODELS
            results["sorting"] = list(sorting.measure(rounds, names_of))
            keep("sorting")
        if "pixels" in parts and not quick:
            made["pixels"] = list(curves.by_pixels(rounds))
            keep("pixels")
        if "triangles" in parts and not quick:
            made["triangles"] = list(curves.by_triangles(rounds))
            keep("triangles")


def _tell(results: Mapping[str, Any], clock: str) -> None:
    """Print what was found."""
    made = results.get("curves", {})
    if "duels" in results:
        click.echo("\n" + tables.time_table(results, clock) + "\n\n" + tables.ratio_table(results, clock))
    if "textures" in results:
        click.echo("\n" + tables.texture_table(results))
    if "shadows" in results:
        click.echo("\n" + tables.shadow_table(results))
    if "moving" in results:
        click.echo("\n" + "\n".join(moving.told(results["moving"])))
    if "sequences" in results:
        click.echo("\n" + tables.sequence_table(results))
    if "rings" in results:
        click.echo("\n" + "\n".join(rings.told(results["rings"])))
    for rows in made.values():
        click.echo("\n" + tables.curve_table(rows))
    if "facets" in made:
        click.echo("\n" + tables.stage_table(made["facets"]))
    if "sorting" in results:
        click.echo("\n" + sorting.sorting_table(results["sorting"]))
    click.echo("\n" + tables.target_table(results))


def _machine() -> dict[str, str]:
    """What ratios hold for, and what was missing."""
    renderer = opengl.renderer()
    found = {
        "processor": _processor(),
        "cores": str(len(os.sched_getaffinity(0))),
        "Python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "embreex", "OpenEXR")},
        "OpenGL": f"left out: {renderer[1:]}" if renderer.startswith("-") else renderer,
        "detailed mesh": f"{len(meshes.detailed(3).triangles):,} triangles ({meshes.detailed(3).name})",
        "65,536 additions": f"{canary():.1f} µs",
        "two processes beside each other": f"{crowding():.2f} times as long as one",
    }
    if not meshes.has_dragon():
        found["note"] = f"no dragon in the folder ${meshes.DATA} names: a rough ball stands in"
    for name, value in found.items():
        click.echo(f"{name}: {value}", err=True)
    return found


def _processor() -> str:
    """The processor's name, family and model: caches and instructions differ, and ratios with them."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    told = dict(map(str.strip, line.split(":", 1)) for line in lines if ":" in line)
    if "model name" not in told:
        return platform.processor() or platform.machine()
    return f"{told['model name']} (family {told.get('cpu family', '?')}, model {told.get('model', '?')})"


def _commit() -> str:
    """The commit's short name, `+` for changes beside it; `now` outside a repository."""
    command = ["git", "describe", "--always", "--dirty=+"]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return said.stdout.strip() or "now"


if __name__ == "__main__":
    main()
