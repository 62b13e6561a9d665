"""What the papers on curved displays and on free projections measured, measured here: docs/surfaces.md.

`python -m tests.benchmarks.surfaces` prints the tables, `--docs` puts them and the pictures into the page.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from quiltcli.analysis.simulate import PictureOptions, simulate
from quiltcli.display import lit_facets
from quiltcli.images.preview import preview, tone_map
from quiltcli.images.stereo.files import StereoOptions, write_stereo
from quiltcli.job import load_job
from quiltcli.render.buffers import Buffers, new_buffers
from quiltcli.render.crew import plan_of
from quiltcli.render.methods import draw_frame
from quiltcli.render.sequence import render
from quiltcli.render.setup import Stage, set_stage
from quiltcli.viewer.viewer import Viewer
from quiltcli.visibility.draw import Frame, batches, draw
from quiltcli.visibility.rays.embree import aim
from quiltcli.visibility.shares import bin_frame
from tests.benchmarks.page import put
from tests.helpers.camera_texture import as_facets, as_projection
from tests.helpers.curved_jobs import boxes, curved_job

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "surfaces.md"
PICTURES = ROOT / "docs" / "pictures"
DEMOS = {
    # Model: scene, eye, what it looks at, the camera if not there.
    "sphere": ("room", (0.7, 1.5, 2.7), (0, 1, 0), None),
    "cylinder_wall": ("city", (0, 1.7, 0), (0, 1.5, -5), None),
    "dome": ("room", (0, 1.5, 0.5), (0, 2.6, -3), None),
    "paraboloid": ("room", (0.4, 2.0, 1.7), (0, 0.6, 0), None),
    "bezier_panel": ("room", (0.3, 1.5, 2.6), (0, 1.4, 0), None),
    "panorama160": ("city", (0, 1.7, 0), (0, 1.7, -5), None),
}

CLOSE = np.s_[536:565, 826:865]
"""Rows and columns of the close views."""


def staged(display: str, scene: str, eye: object, at: object, more: str = "") -> tuple[Stage, Viewer]:
    """The stage and the viewer of a job of one frame; `display` is a model's name, or a file's text."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = ROOT / "display_models" / f"{display}.yaml"
        if "\n" in display:
            path = folder / "display.yaml"
            path.write_text(display)
        (folder / "job.yaml").write_text(
            f"quilt_job: 1\ndisplay: {path}\nscene: {ROOT}/scenes/{scene}.yaml\nframes: 1\nviewer:\n"
            f"  near: 0.02\n  far: 2000\n  path: {{keyframes: [{{frame: 1, position: {list(eye)},"
            f" look_at: {list(at)}}}]}}\n{more}"
        )
        stage = set_stage(load_job(folder / "job.yaml"))
        return stage, stage.views([1])[0].viewer


def drawn(stage: Stage, viewer: Viewer) -> tuple[Buffers, float]:
    """The frame, and processor seconds."""
    buffers = new_buffers(stage)
    begin = time.process_time()
    draw_frame(stage, viewer, buffers)
    return buffers, time.process_time() - begin


def demo_pictures() -> Iterator[Path]:
    """A picture of each display model that is curved, and one of all together."""
    tiles = []
    for name, (scene, eye, at, _) in DEMOS.items():
        with tempfile.TemporaryDirectory() as folder:
            job = Path(folder) / "job.yaml"
            job.write_text(
                f"quilt_job: 1\ndisplay: {ROOT}/display_models/{name}.yaml\n"
                f"scene: {ROOT}/scenes/{scene}.yaml\nframes: 1\nviewer:\n  near: 0.02\n"
                f"  far: 2000\n  path: {{keyframes: [{{frame: 1,"
                f" position: {list(eye)}, look_at: {list(at)}}}]}}\n"
            )
            options = PictureOptions(
                size=(480, 360), samples=2, compare=False, fov=70 if name == "dome" else None
            )
            if name == "panorama160":
                stage, viewer = staged(name, scene, eye, at, "output: {channels: [rgba]}\n")
                buffers, _ = drawn(stage, viewer)
                light = np.stack([buffers[c].reshape(1200, 1600).astype(np.float32) for c in "RGB"], axis=2)
                light = light[300:900].reshape(300, 2, 800, 2, 3).mean(axis=(1, 3))
                picture = tone_map(light)
                tile = Image.fromarray(picture).resize((480, 180), Image.Resampling.LANCZOS)
                framed = Image.new("RGB", (480, 360), (14, 14, 15))
                framed.paste(tile, (0, 90))
                tiles.append(framed)
                continue
            (found,) = simulate(load_job(job), [1], options)
            tiles.append(Image.fromarray(tone_map(found.picture)))
    sheet = Image.new("RGB", (3 * 480, 2 * 360))
    for k, tile in enumerate(tiles):
        sheet.paste(tile, (480 * (k % 3), 360 * (k // 3)))
    path = PICTURES / "surfaces.png"
    sheet.save(path)
    yield path


def close_ups() -> Path:
    """A few pixels of the city's panorama: exact, in strips, by way of a cube map, and with samples."""
    eye, at, tiles = (0, 1.7, 0), (0, 1.7, -1), []
    for more, how in (
        ("", ""),
        (", pieces: 20", ""),
        ("", "render: {method: cubemap, faces: 512}\n"),
        ("", "render: {samples: 16}\n"),
    ):
        display = f"quilt_display: 1\nprojection: {{kind: cylinder{more}, pixels: [1600, 1200]}}\n"
        stage, viewer = staged(display, "city", eye, at, how + "output: {channels: [rgba]}\n")
        light = np.stack([drawn(stage, viewer)[0][c].reshape(1200, 1600) for c in "RGB"], axis=2)
        picture = tone_map(light[CLOSE].astype(np.float32))
        tiles.append(Image.fromarray(picture).resize((234, 174), Image.Resampling.NEAREST))
    sheet = Image.new("RGB", (960, 174), (255, 255, 255))
    for k, tile in enumerate(tiles):
        sheet.paste(tile, (242 * k, 0))
    path = PICTURES / "surfaces-close.png"
    sheet.save(path)
    return path


def two_eyes() -> Path:
    """A panorama with an eye for each column, for red and cyan glasses."""
    display = "quilt_display: 1\nprojection: {kind: equirect, omnistereo: true, pixels: [1200, 600]}\n"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "display.yaml").write_text(display)
        (folder / "job.yaml").write_text(
            f"quilt_job: 1\ndisplay: display.yaml\nscene: {ROOT}/scenes/room.yaml\nframes: 1\nviewer:\n"
            "  near: 0.02\n  far: 2000\n  stereo: {separation: 0.064}\n"
            "  path: {keyframes: [{frame: 1, position: [0, 1.6, 0], look_at: [0, 1.6, -1]}]}\n"
            "render: {samples: 9}\noutput: {channels: [rgba]}\n"
        )
        render(load_job(folder / "job.yaml"))
        write_stereo(folder / "out", folder / "both", StereoOptions("anaglyph", "page"))
        path = PICTURES / "surfaces-two-eyes.png"
        preview(folder / "both" / "page_01.0001.exr", path)
    return path


def pieces_table() -> str:
    """Replication and wrong pixels of a cylinder in flat pieces, beside the exact cylinder."""
    pictures, rows = {}, []
    for pieces in (0, 20, 40, 80, 160, 320):
        more = f", pieces: {pieces}" if pieces else ""
        display = f"quilt_display: 1\nprojection: {{kind: cylinder{more}, pixels: [1600, 1200]}}\n"
        stage, viewer = staged(display, "city", (0, 1.7, 0), (0, 1.7, -1), "output: {channels: [triangle]}\n")
        buffers, seconds = drawn(stage, viewer)
        pictures[pieces] = buffers["triangle"].copy()
        wrong = float((pictures[pieces] != pictures[0]).mean())
        rows.append(
            (f"{pieces} strips" if pieces else "exact", f"{wrong:.1e}" if pieces else "–", f"{seconds:.2f} s")
        )
    head = (
        "| picture of 1600 × 1200 | pixels with another triangle | processor time |\n| --- | ---: | ---: |\n"
    )
    return head + "".join(f"| {a} | {b} | {c} |\n" for a, b, c in rows)


def facets_table() -> str:
    """Pictures in flat facets: pairs of triangles and facets, as the papers count them."""
    rows = [
        (f"{count} flat facets around", "1.96" if count == 160 else "–", *_pairs(_prism(count)))
        for count in (40, 80, 160, 320)
    ]
    display = "quilt_display: 1\nprojection: {kind: cylinder, pixels: [1600, 1200]}\n"
    rows.append(("the same, exact, in patches", "–", *_pairs(display)))
    size, eye = (1600, 1200), np.array([0, 1.7, 0])
    for nodes, paper in (((80, 60), "10.06"), ((128, 128), "21.04")):
        with tempfile.TemporaryDirectory() as name:
            count = 2 * (nodes[0] - 1) * (nodes[1] - 1)
            found = _pairs(as_facets(Path(name), *nodes, size, eye))
            rows.append((f"camera texture as {count:,} flat facets", paper, *found))
    with tempfile.TemporaryDirectory() as name:
        found = _pairs(as_projection(Path(name), 128, 128, size))
        rows.append(("the same as a map of rays, exact, in patches", "–", *found))
    head = "| picture | the paper | for each triangle of the city | for each that is in view |\n"
    head += "| --- | ---: | ---: | ---: |\n"
    return head + "".join(f"| {a} | {b} | {c:.2f} | {d:.2f} |\n" for a, b, c, d in rows)


def _pairs(display: str) -> tuple[float, float]:
    """Pairs for each triangle of the city, and for each that is in view."""
    more = "render: {bleed: 0}\noutput: {channels: [Z]}\n"
    stage, viewer = staged(display, "city", (0, 1.7, 0), (0, 1.7, -1), more)
    binned = bin_frame(plan_of(stage, viewer, stage.rays(np.ones(stage.facets.count, dtype=bool), viewer)))
    return binned.facet_pairs / binned.triangles, binned.facet_pairs / binned.reaching


def _prism(count: int, rows: int = 1) -> str:
    """A prism of so many panels around (0, 1.7, 0), each in so many rows."""
    turn = 2 * np.pi / count
    apothem = 1.0
    width = 2 * apothem * np.tan(turn / 2)
    high = 1.5 * np.pi / rows
    pixels = [max(1600 // count, 1), 1200 // rows]
    lines = ["quilt_display: 1", "panels:"]
    for k in range(count):
        a = k * turn
        for row in range(rows):
            at = [apothem * np.sin(a), 1.7 + (row - (rows - 1) / 2) * high, -apothem * np.cos(a)]
            lines.append(
                f"- {{pixels: {pixels}, size: [{width:.9f}, {high:.9f}],"
                f" at: [{at[0]:.9f}, {at[1]}, {at[2]:.9f}], yaw_deg: {-np.degrees(a):.9f}}}"
            )
    return "\n".join(lines) + "\n"


def speed_table() -> str:
    """Drawing beside one Embree ray a pixel, in one run."""
    dome = "{kind: sphere, radius: 2.5, zenith_deg: [0, 90], lit: inside, at: [0, 1, 0]"
    ball = "{kind: sphere, radius: 1, at: [0, 1.5, 0]"
    street = (0, 1.7, 0)
    cases = {
        "dome 4096 × 1024 from inside, room": (_surface(dome, 4096, 1024), "room", (0.2, 1.3, 0.1)),
        "cylinder panorama 1600 × 1200, city": (_projected("cylinder", 1600, 1200), "city", street),
        "cylinder panorama 3200 × 2400, city": (_projected("cylinder", 3200, 2400), "city", street),
        "equirectangular 2048 × 1024, city": (_projected("equirect", 2048, 1024), "city", street),
        "equirectangular 4096 × 2048, city": (_projected("equirect", 4096, 2048), "city", street),
        "dome master 1536 × 1536, city": (_projected("dome_master", 1536, 1536), "city", street),
        "dome master 4096 × 4096, city": (_projected("dome_master", 4096, 4096), "city", street),
        "sphere 4096 × 2048 from outside, room": (_surface(ball, 4096, 2048), "room", (0.2, 1.7, 2.5)),
    }
    rows = []
    for name, (display, scene, eye) in cases.items():
        stage, viewer = staged(display, scene, eye, (0, eye[1], -3), "output: {channels: [Z]}\n")
        drawn(stage, viewer)
        count = 0
        times: list[tuple[float, float, float]] = []
        for _ in range(3):
            count, theirs = _embree(stage, viewer)
            times.append((_visibility(stage, viewer), drawn(stage, viewer)[1], theirs))
        seen, frame, embree = np.median(times, axis=0).tolist()
        each = (f"{1e9 * seconds / count:.0f}" for seconds in (seen, frame, embree))
        rows.append((name, f"{count / 1e6:.2f}", *each, f"{seen / embree:.2f}", f"{frame / embree:.2f}"))
    columns = "lit Mpx", "visibility", "with depth", "Embree", "visibility / Embree", "with depth / Embree"
    return _table(("display, scene", *columns), rows)


_FORMS = ((as_projection, ()), (as_facets, (np.array([0, 1.7, 0]),)))
"""A camera texture in both forms, and what else each is made of."""


def ways_table() -> str:
    """A curved display beside other ways to the same picture, in one run."""
    eye, ahead, street = (0.2, 1.7, 2.5), (0, 1.7, -3), (0, 1.7, 0)
    around, panorama = _projected("equirect", 2048, 1024), _projected("cylinder", 1600, 1200)
    sheet = _surface("{kind: plane, width: 4, height: 2, at: [0, 1.5, -1]", 2048, 1024)
    panel = "quilt_display: 1\npanels:\n- {size: [4, 2], at: [0, 1.5, -1], pixels: [2048, 1024]}\n"
    depth, light = "output: {channels: [Z]}\n", "output: {channels: [rgba]}\n"
    duels = {
        "equirectangular 2048 × 1024, lit, by settled rays / exact": (
            (around, "city", street, ahead, "render: {method: raycast}\n" + light),
            (around, "city", street, ahead, light),
        ),
        "plane 2048 × 1024 in patches / as a flat facet, depth": (
            (sheet, "room", eye, ahead, depth),
            (panel, "room", eye, ahead, depth),
        ),
        "cylinder panorama 1600 × 1200 / a prism of 12,000 facets, depth": (
            (panorama, "city", street, ahead, depth),
            (_prism(160, 75), "city", street, ahead, depth),
        ),
    }
    rows = []
    stages = {name: [staged(*job) for job in jobs] for name, jobs in duels.items()}
    with tempfile.TemporaryDirectory() as name:
        textures = [make(Path(name), 128, 128, (1600, 1200), *more) for make, more in _FORMS]
        texts = "camera texture 1600 × 1200 as a map of rays / as 32,258 facets, depth"
        stages[texts] = [staged(text, "city", street, (0, 1.7, -1), depth) for text in textures]
    for name, pairs in stages.items():
        times = [[drawn(stage, viewer)[1] for stage, viewer in pairs] for _ in range(4)]
        first, second = np.median(times[1:], axis=0).tolist()
        rows.append((name, f"{first:.2f}", f"{second:.2f}", f"{first / second:.2f}"))
    return _table(("a frame / another", "s", "s", "ratio"), rows)


def _projected(kind: str, width: int, height: int) -> str:
    return f"quilt_display: 1\nprojection: {{kind: {kind}, pixels: [{width}, {height}]}}\n"


def _surface(spec: str, width: int, height: int) -> str:
    return f"quilt_display: 1\nsurfaces:\n- {spec}, pixels: [{width}, {height}]}}\n"


def _table(columns: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    ruler = ("---", *["---:"] * (len(columns) - 1))
    return "".join(f"| {' | '.join(row)} |\n" for row in (columns, ruler, *rows))


def _visibility(stage: Stage, viewer: Viewer) -> float:
    """Processor seconds until the depth keys of every pixel are known, with the rays and the sorting."""
    begin = time.process_time()
    rays = stage.rays(lit_facets(stage.facets, viewer.eye), viewer)
    binned = bin_frame(plan_of(stage, viewer, rays))
    frame = Frame(viewer, binned.sight, rays, stage.blocks, binned.pairs, patches=stage.patches)
    for batch in batches(frame):
        draw(frame, batch).done()
    return time.process_time() - begin


def memory_table() -> str:
    """The most memory that `quilt render` takes."""
    rows = []
    cases = (
        ("dome master 4096 × 4096, city", "projection: {kind: dome_master, pixels: [4096, 4096]}", "city"),
        (
            "sphere 4096 × 2048 from outside, room",
            "surfaces:\n- {kind: sphere, radius: 1, at: [0, 1, 0], pixels: [4096, 2048]}",
            "room",
        ),
    )
    for name, display, scene in cases:
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "display.yaml").write_text(f"quilt_display: 1\n{display}\n")
            job = Path(folder) / "job.yaml"
            job.write_text(
                f"quilt_job: 1\ndisplay: display.yaml\nscene: {ROOT}/scenes/{scene}.yaml\nframes: 1\n"
                "viewer: {near: 0.02, far: 2000, path: {keyframes: [{frame: 1, position: [0.7, 1.6, 2.7],"
                " look_at: [0, 1, 0]}]}}\n"
            )
            code = (
                "import resource, sys; from quiltcli.cli import main\n"
                f"try: main(['render', {str(job)!r}, '-j', '1'])\n"
                "except SystemExit: pass\n"
                "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
            )
            done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
            rows.append((name, int(done.stdout.split()[-1]) / 1e6))
    head = "| render of | most memory |\n| --- | ---: |\n"
    return head + "".join(f"| {name} | {size:.2f} GB |\n" for name, size in rows)


def _embree(stage: Stage, viewer: Viewer) -> tuple[int, float]:
    """Lit pixels, and processor seconds of one single-precision ray for each, made and cast."""
    target = aim(stage.scene.vertices, stage.scene.triangles, viewer, False)
    view = stage.rays(np.ones(1, dtype=bool), viewer).views[0]
    assert view is not None
    width, height = stage.facets.size[0].tolist()
    x, count = (np.arange(width) + 0.5)[None, :], 0
    begin = time.process_time()
    for first in range(0, height, 64):
        y = (np.arange(first, min(first + 64, height)) + 0.5)[:, None]
        rays = view.rays(x, y)[:, view.lit(x, y)].T.astype(np.float32)
        target.embree.run(np.zeros_like(rays), rays)
        count += len(rays)
    return count, time.process_time() - begin


def cubemap_table() -> str:
    """How far pictures by way of a cube map are from the exact one."""
    display = "quilt_display: 1\nprojection: {kind: cylinder, pixels: [1600, 1200]}\n"
    eye, at = (0, 1.7, 0), (0, 1.7, -1)
    stage, viewer = staged(display, "city", eye, at, "output: {channels: [rgba]}\n")
    more = "render: {samples: 36}\noutput: {channels: [rgba]}\n"
    fine, _ = staged(display, "city", eye, at, more)
    truth = _light(drawn(fine, viewer)[0])
    rows = [("exact, one sample a pixel", _psnr(_light(drawn(stage, viewer)[0]), truth))]
    for samples in (4, 9):
        more = f"render: {{samples: {samples}}}\noutput: {{channels: [rgba]}}\n"
        finer, viewer = staged(display, "city", eye, at, more)
        rows.append((f"exact, {samples} samples a pixel", _psnr(_light(drawn(finer, viewer)[0]), truth)))
    for faces in (512, 1024, 2048):
        more = f"render: {{method: cubemap, faces: {faces}}}\noutput: {{channels: [rgba]}}\n"
        mapped, viewer = staged(display, "city", eye, at, more)
        rows.append((f"cube map, faces of {faces}", _psnr(_light(drawn(mapped, viewer)[0]), truth)))
    head = "| picture | PSNR against 36 exact samples a pixel |\n| --- | ---: |\n"
    return head + "".join(f"| {name} | {value:.1f} dB |\n" for name, value in rows)


def _light(buffers: Buffers) -> np.ndarray:
    return np.minimum(np.stack([buffers[c].astype(np.float64) for c in "RGB"]), 1.0)


def _psnr(picture: np.ndarray, truth: np.ndarray) -> float:
    return float(-10 * np.log10(((picture - truth) ** 2).mean()))


def threshold_table() -> str:
    """Wrong pixels and pieces of the parametric paper's method, by its threshold: boxes in a sphere."""
    rows = []
    truth: Buffers = {}
    for threshold in (None, 0.2, 0.1, 0.05, 0.025, 0.012, 0.01):
        with tempfile.TemporaryDirectory() as name:
            how = "" if threshold is None else f"render: {{method: tessellate, threshold: {threshold}}}\n"
            display = "surfaces:\n- {kind: sphere, radius: 1, pixels: [1024, 512]}"
            more = how + "output: {channels: [triangle, Z]}\n"
            job = curved_job(Path(name), display, boxes(150, 0.3, 0.45), (1.2, 0.9, 2.7), more=more)
            stage = set_stage(job)
        viewer, buffers = stage.views([1])[0].viewer, new_buffers(stage)
        begin = time.process_time()
        record = draw_frame(stage, viewer, buffers)
        seconds = time.process_time() - begin
        if threshold is None:
            truth = buffers
            rows.append(("exact", "–", f"{record.triangles:,} triangles", f"{seconds:.2f} s"))
            continue
        shown = truth["triangle"] > 0
        wrong = float((buffers["triangle"] != truth["triangle"])[shown].mean())
        rows.append((f"{100 * threshold:g} %", f"{wrong:.1e}", f"{record.pairs:,}", f"{seconds:.2f} s"))
    head = "| threshold, of the radius | wrong pixels | pieces | processor time |\n"
    head += "| --- | ---: | ---: | ---: |\n"
    return head + "".join(f"| {' | '.join(row)} |\n" for row in rows)


TABLES = {
    "thresholds": threshold_table,
    "pieces": pieces_table,
    "replication": facets_table,
    "cubemap": cubemap_table,
    "speed": speed_table,
    "ways": ways_table,
    "memory": memory_table,
}


def main() -> None:
    """Print the tables, or put them into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--docs", action="store_true", help="put tables and pictures into docs/surfaces.md")
    parser.add_argument("--only", help="one table, or pictures")
    given = parser.parse_args()
    text = PAGE.read_text(encoding="utf-8")
    for name, table in TABLES.items():
        if given.only in (None, name):
            found = table()
            print(found)
            text = put(text, name, found)
    if given.only in (None, "pictures"):
        print(*demo_pictures(), close_ups(), two_eyes(), sep="\n")
    if given.docs:
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
