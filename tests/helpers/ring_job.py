"""A small job of a 360° light field display."""

from __future__ import annotations

from pathlib import Path

from tests.helpers.ring_scenes import ball

DISPLAY = """\
quilt_display: 1
kind: lightfield360
image: [{size}, {size}]
projector: {{height: 0.6, diameter: 0.13}}
mirror: {{outline: {{disk: 0.13}}}}
rotation: {{positions: {positions}}}
diffuser: {{horizontal_deg: {lobe}}}
{more}
"""
JOB = """\
quilt_job: 1
display: turn.yaml
scene: scene.yaml
frames: {frames}
ring: {{height: 0.4, distance: 1.0}}
render: {{method: {method}}}
output: {{directory: out, tones: {tones}}}
"""
SCENE = """\
quilt_scene: 1
objects:
- {mesh: ball.obj, material: {color: [0.9, 0.6, 0.3], roughness: 0.5}}
lights:
- {type: directional, direction: [-1, -2, -1], color: [1, 1, 1]}
- {type: ambient, color: [0.1, 0.1, 0.1]}
"""


def ring_job(
    folder: Path,
    *,
    size: int = 48,
    positions: int = 24,
    lobe: float | str = 1.25,
    frames: str = "1",
    method: str = "exact",
    tones: bool = False,
    more: str = "",
) -> Path:
    """Write a job and what it names; its path."""
    folder.mkdir(parents=True, exist_ok=True)
    display = DISPLAY.format(size=size, positions=positions, lobe=lobe, more=more)
    (folder / "turn.yaml").write_text(display, encoding="utf-8")
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
    vertices, triangles = ball()
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    (folder / "ball.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    job = folder / "job.yaml"
    job.write_text(JOB.format(frames=frames, method=method, tones=str(tones).lower()), encoding="utf-8")
    return job
