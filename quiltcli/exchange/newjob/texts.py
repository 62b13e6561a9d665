"""The files of a new job, with comments for those who will go on editing them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence

from quiltcli.exchange.newjob.kinds import kind_of
from quiltcli.exchange.newjob.stand import Stand
from quiltcli.exchange.newjob.wishes import Ball, Wishes
from quiltcli.job.display import DisplayFile, PanelSpec

# A regular icosahedron of radius 1, to have something to see.
_GOLDEN = 0.5257311121191336, 0.8506508083520399


def panels_text(wishes: Wishes, spec: DisplayFile, notes: Sequence[str]) -> str:
    """The display file of panels; `notes` stand behind the panels, one each."""
    lines = [
        f"# {wishes.kind}: {kind_of(wishes).about}",
        "#",
        "# at: the middle of a panel, metres, Y up. yaw_deg: 0 faces +Z, more turns it to the left, which",
        "# is anticlockwise from above; pitch_deg turns it up, roll_deg clockwise as one sees it.",
        "quilt_display: 1",
        "panels:",
    ]
    for panel, note in zip(spec.panels or (), notes, strict=True):
        lines.append(f"- {{{', '.join(_panel_parts(panel))}}}   # {note}")
    return "\n".join(lines) + "\n"


def _panel_parts(panel: PanelSpec) -> Iterator[str]:
    yield f"name: {panel.name}"
    yield f"pixels: [{panel.pixels[0]}, {panel.pixels[1]}]"
    if panel.size is None:
        yield f"pitch: {panel.pitch}"
    else:
        yield f"size: [{panel.size[0]}, {panel.size[1]}]"
    yield f"at: {_point([float(c) for c in panel.at])}"
    for key in ("yaw_deg", "pitch_deg", "roll_deg"):
        if getattr(panel, key):
            yield f"{key}: {_number(getattr(panel, key))}"
    if panel.place is not None:
        turn = f", rotate: {panel.place.rotate:g}" if panel.place.rotate else ""
        yield f"place: {{at: [{panel.place.at[0]}, {panel.place.at[1]}]{turn}}}"


def ball_text(wishes: Wishes, spec: DisplayFile) -> str:
    """The display file of a ball, whose mesh is `display.obj`."""
    assert spec.resolution is not None
    return (
        f"# {wishes.kind}: {kind_of(wishes).about}\n"
        "quilt_display: 1\n"
        "mesh: display.obj             # every face is a piece of the display, wound outwards; metres, Y up\n"
        f"viewing_side: {spec.viewing_side}           # front: lit outside; back: lit inside\n"
        f"resolution: {{pitch: {spec.resolution.pitch}}}\n"
    )


def ball_mesh_text(ball: Ball) -> str:
    """The mesh of a ball."""
    vertices = (f"v {' '.join(map(_number, vertex))}" for vertex in ball.vertices)
    faces = (f"f {' '.join(str(corner + 1) for corner in face)}" for face in ball.faces)
    return "\n".join((*vertices, *faces)) + "\n"


def content_text() -> str:
    """Mesh of what is shown until there is content: an icosahedron of radius 1."""
    a, b = _GOLDEN
    corners = [
        point
        for s in (a, -a)
        for t in (b, -b)
        for point in ((0.0, s, t), (s, t, 0.0), (t, 0.0, s))
    ]  # fmt: skip
    edge = 2 * a

    def near(i: int, j: int) -> bool:
        return abs(sum((p - q) ** 2 for p, q in zip(corners[i], corners[j], strict=True)) - edge**2) < 1e-6

    lines = [f"v {' '.join(map(_number, corner))}" for corner in corners]
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                if near(i, j) and near(j, k) and near(i, k):
                    u, v, w = corners[i], corners[j], corners[k]
                    sense = sum(u[n] * (v[n - 2] * w[n - 1] - v[n - 1] * w[n - 2]) for n in range(3))
                    lines.append(f"f {i + 1} {j + 1} {k + 1}" if sense > 0 else f"f {i + 1} {k + 1} {j + 1}")
    return "\n".join(lines) + "\n"


def scene_text(stand: Stand, content: str | None) -> str:
    """The scene file: the mesh that was given, or two stand-ins."""
    if content is None:
        (x, y, z), (ex, _, ez) = stand.look_at, stand.eye
        # Half as far behind what is looked at as the eye is before it, and to the right.
        off = 2.5 * stand.content / max(math.hypot(x - ex, z - ez), 1e-9)
        aside = (1.5 * x - 0.5 * ex - off * (z - ez), y, 1.5 * z - 0.5 * ez + off * (x - ex))
        behind = _point([round(c, 3) for c in aside])
        size, near = _number(stand.content), _point(stand.look_at)
        objects = (
            "# Stand-ins of radius 1: put a mesh of your own here, OBJ, PLY, STL, glTF or USD. A GLB from\n"
            "# Blender needs neither units nor up_axis; others may want units: mm or up_axis: z there.\n"
            "objects:\n"
            f"- {{name: near, mesh: content.obj, transform: {{scale: {size}, translate: {near}}},"
            " material: {color: [0.8, 0.25, 0.1]}}\n"
            f"- {{name: far, mesh: content.obj, transform: {{scale: {size}, translate: {behind}}},"
            " material: {color: [0.1, 0.4, 0.7]}}\n"
        )
    else:
        objects = (
            "# Metres, Y up, where the file puts it; else add transform: {translate: [x, y, z], scale: 1},\n"
            "# units: mm or up_axis: z beside mesh.\n"
            f"objects:\n- {{name: content, mesh: {json.dumps(content, ensure_ascii=False)}}}\n"
        )
    return (
        "# What is to be seen, in the same metres as the display: in front of it and behind it.\n"
        f"quilt_scene: 1\n{objects}"
        "lights:\n"
        "- {type: directional, direction: [-1, -2, -1], color: [3, 3, 3]}\n"
        "- {type: ambient, color: [0.2, 0.2, 0.25]}\n"
        "background: [0.02, 0.04, 0.08]\n"
    )


def job_text(wishes: Wishes, stand: Stand, frames: tuple[int, ...]) -> str:
    """The job file."""
    layout = "layout: layout.yaml\n" if wishes.canvas else ""
    # Neighbours that touch on the canvas leave no room to bleed into.
    bleed = f"render:\n  bleed: {wishes.padding}\n" if wishes.canvas and wishes.padding < 2 else ""
    return (
        "#     quilt check job.yaml                        every mistake in these files, at once\n"
        "#     quilt simulate job.yaml -f 1 -o eye.png     what the viewer will see\n"
        "#     quilt render job.yaml                       the pictures\n"
        "quilt_job: 1\n"
        f"display: display.yaml\n{layout}scene: scene.yaml\n"
        f"frames: {wishes.frames}\n"
        f"fps: {wishes.fps}\n"
        "viewer:\n"
        f"  near: {_number(_rounded(stand.reach / 100))}   # metres from the eye; nothing nearer is drawn,\n"
        f"  far: {_number(_rounded(stand.reach * 100))}   # nor anything farther\n"
        f"  path:\n{_path(stand, frames)}"
        f"{bleed}"
        "output:\n"
        "  directory: out\n"
    )


def _path(stand: Stand, frames: tuple[int, ...]) -> str:
    if stand.orbit:
        centre, height = _point(stand.look_at), _number(round(stand.eye[1] - stand.look_at[1], 3))
        last = max(frames[-1], frames[0] + 1)
        return (
            f"    # From the right front to the left front, around what is looked at.\n"
            f"    orbit: {{center: {centre}, radius: {_number(stand.orbit)}, height: {height}, start_deg: 40,"
            f" end_deg: -40, start_frame: {frames[0]}, end_frame: {last}}}\n"
        )
    aim = f"position: {_point(stand.eye)}, look_at: {_point(stand.look_at)}"
    return (
        "    # The viewer stands still; with more keyframes they walk.\n"
        f"    keyframes:\n    - {{frame: {frames[0]}, {aim}}}\n"
    )


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def _point(point: Sequence[float]) -> str:
    return f"[{', '.join(map(_number, point))}]"


def _number(value: float) -> str:
    """A number to a picometre, without an exponent."""
    text = f"{value:.12f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
