"""Write the display models of this folder: for each an OBJ mesh and a display file.

    python display_models/generate.py [NAME…]

Every mesh is in metres with Y up, its faces wound counter-clockwise seen from the side named in
its display file, all planar: quads where a shape has planar quads, else triangles, and a pentagon
or decagon where that is the piece of screen. The same program always writes the same bytes.

To add a shape, write a function in `shapes.py` that returns a `Mesh` and add a row to `MODELS`; what needs no
mesh is a row of `CURVED`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from shapes import (
    Mesh,
    cave5,
    corner_billboard,
    cube5,
    cylinder216,
    desk816,
    dodecahedron,
    icosahedron,
    knot1200,
    rounded,
    sphere,
    spring902,
)
from teapot import teapot1024


@dataclass(frozen=True)
class Model:
    """One row of the table: what a model is, how it is made, and its display file's settings."""

    title: str
    make: Callable[[], Mesh]
    settings: str


# What editors check the files by while they are typed.
SCHEMA = "# yaml-language-server: $schema=../docs/schema/display.schema.json\n"
WALK_AROUND = "viewing_side: front\n"
MODELS = {
    "cube5": Model(
        "five panels: a box to walk around, on the ground",
        cube5,
        WALK_AROUND + "resolution:\n  facet_pixels: [1920, 1080]\n"
        "facets:\n  5: {name: top, facet_pixels: [1920, 1920]}\n",
    ),
    "corner_billboard": Model(
        "two LED walls of 4 mm pitch on the corner of a building",
        corner_billboard,
        WALK_AROUND + "resolution:\n  pixels_per_metre: 250\n",
    ),
    "cave5": Model(
        "a CAVE of three walls, floor and ceiling, 3 m, seen from inside",
        cave5,
        "viewing_side: back\nresolution:\n  pixels_per_metre: 500\n",
    ),
    "icosahedron": Model(
        "20 triangles", icosahedron, WALK_AROUND + "resolution:\n  pixels_per_metre: 3000\n"
    ),
    "dodecahedron": Model(
        "12 pentagons", dodecahedron, WALK_AROUND + "resolution:\n  pixels_per_metre: 3000\n"
    ),
    "sphere840": Model(
        "a sphere of 42 × 20 facets on the ground, radius 0.3 m",
        lambda: sphere(42, 20),
        WALK_AROUND + "resolution:\n  pixels_per_metre: 2400\n",
    ),
    "sphere1620": Model(
        "a sphere of 54 × 30 facets on the ground, radius 0.3 m",
        lambda: sphere(54, 30),
        WALK_AROUND + "resolution:\n  pixels_per_metre: 2400\n",
    ),
    "cylinder216": Model(
        "a column of 24 × 9 panels", cylinder216, WALK_AROUND + "resolution:\n  pixels_per_metre: 2400\n"
    ),
    "desk816": Model(
        "a folded workspace; the viewer sits over the origin, eyes near (0, 1.2, 0), and looks along -Z",
        desk816,
        WALK_AROUND + "resolution:\n  pixels_per_metre: 2000\n",
    ),
    "teapot1024": Model(
        "the Utah teapot", teapot1024, WALK_AROUND + "resolution:\n  pixels_per_metre: 3200\n"
    ),
    "spring902": Model(
        "a helical tube with closed ends",
        spring902,
        WALK_AROUND + "resolution:\n  pixels_per_metre: 2400\n",
    ),
    "knot1200": Model(
        "a trefoil knot that crosses itself in view",
        knot1200,
        WALK_AROUND + "resolution:\n  pixels_per_metre: 2400\n",
    ),
}


CURVED = {
    "sphere": (
        "an LED sphere of 1 m radius on the ground, to walk around",
        "surfaces:\n- {name: sphere, kind: sphere, radius: 1, at: [0, 1, 0], pixels: [4096, 2048]}\n",
    ),
    "cylinder_wall": (
        "an LED wall of 120 degrees and 3 m, 5 m away from whoever stands over the origin and looks along -Z",
        "surfaces:\n- name: wall\n  kind: cylinder\n  radius: 5\n  height: 3\n  arc_deg: [120, 240]\n"
        "  lit: inside\n  at: [0, 1.5, 0]\n  pixels: [5120, 1440]\n",
    ),
    "dome": (
        "a dome of 5 m radius, 1 m above the ground, seen from inside",
        "surfaces:\n- {name: dome, kind: sphere, radius: 5, zenith_deg: [0, 90], lit: inside, at: [0, 1, 0],"
        " pixels: [4096, 1024]}\n",
    ),
    "paraboloid": (
        "a bowl over a square of 2 m, y = x² + z², looked into from above",
        "surfaces:\n- {name: bowl, kind: paraboloid, half_width: 1, coefficient: 1, lit: above,"
        " pixels: [2048, 2048]}\n",
    ),
    "bezier_panel": (
        "a bent panel of 3 m that faces +Z, a Bézier patch of 4 × 3 points",
        "surfaces:\n- name: panel\n  kind: bezier\n  pixels: [3072, 1536]\n  points:\n"
        "  - [[-1.5, 2.2, 0.5], [-0.6, 2.0, -0.6], [0.6, 2.4, 0.6], [1.5, 2.2, -0.2]]\n"
        "  - [[-1.5, 1.4, 0.2], [-0.6, 1.3, -0.9], [0.6, 1.5, 0.9], [1.5, 1.4, 0.1]]\n"
        "  - [[-1.5, 0.6, 0.5], [-0.6, 0.4, -0.6], [0.6, 0.8, 0.6], [1.5, 0.6, -0.2]]\n",
    ),
    "projected_sphere": (
        "a sphere of 1 m radius on the ground, lit by four projectors around it that overlap",
        "screen: sphere.yaml\nprojectors:\n"
        + "".join(
            f"- name: {name}\n  pixels: [1024, 768]\n"
            f"  lens: {{at: [{x}, 2, {z}], look_at: [0, 1, 0], throw: 1.1}}\n"
            for name, x, z in (("front", 0, 3.2), ("right", 3.2, 0), ("back", 0, -3.2), ("left", -3.2, 0))
        )
        + "blend: {black: 0.001}\n",
    ),
    "panorama160": (
        "a panorama of 160 flat strips around the eye (Lorenz and Döllner); without pieces it is round",
        "projection: {kind: cylinder, pieces: 160, pixels: [1600, 1200]}\n",
    ),
}
"""Displays that need no mesh: their titles, and what their files say."""


def obj_text(name: str) -> str:
    """A model's mesh as OBJ."""
    mesh = MODELS[name].make()
    lines = [f"# {name}: {MODELS[name].title}; {len(mesh.faces)} facets, metres, Y up"]
    lines += ["v " + " ".join(f"{c:.9g}" for c in rounded(point)) for point in mesh.vertices]
    for index, face in enumerate(mesh.faces):
        if index in mesh.names:
            lines.append(f"g {mesh.names[index]}")
        lines.append("f " + " ".join(str(corner + 1) for corner in face))
    return "\n".join(lines) + "\n"


def display_text(name: str) -> str:
    """A model's display file."""
    model = MODELS[name]
    return f"{SCHEMA}# {name}: {model.title}\nquilt_display: 1\nmesh: {name}.obj\n{model.settings}"


def curved_text(name: str) -> str:
    """The display file of a display that needs no mesh."""
    title, body = CURVED[name]
    return f"{SCHEMA}# {name}: {title}\nquilt_display: 1\n{body}"


MIRRORS = {
    "spinning_mirror": (
        "a 360 degree light field display of Jones et al. (2007): a spinning mirror of 13 cm",
        "# The paper does not say how far away the projector is, nor which bit is shown first: 0.6 m\n"
        "# follows from the ten positions that an eye far away sees.\n"
        "kind: lightfield360\nimage: [768, 768]\nprojector: {height: 0.6, diameter: 0.13}\n"
        "mirror: {tilt_deg: 45, outline: {disk: 0.13}}\n"
        "rotation: {positions: 288, direction: increasing, first_deg: 0}\n"
        "diffuser: {horizontal_deg: 1.25, reflection: plane}\n"
        "packing: {images: 24, order: rgb, bits: lsb, refresh: 200, rpm: 1000}\n",
    ),
}
"""Displays of kind lightfield360: what they are, and their files."""


def mirror_text(name: str) -> str:
    """The display file of a spinning mirror."""
    title, body = MIRRORS[name]
    schema = SCHEMA.replace("display.schema", "lightfield360.schema")
    return f"{schema}# {name}: {title}\nquilt_display: 1\n{body}"


def write(folder: Path, names: Iterable[str]) -> None:
    """Write models into a folder."""
    for name in names:
        if name in MIRRORS:
            (folder / f"{name}.yaml").write_text(mirror_text(name), encoding="utf-8")
            continue
        if name in CURVED:
            (folder / f"{name}.yaml").write_text(curved_text(name), encoding="utf-8")
            continue
        (folder / f"{name}.obj").write_text(obj_text(name), encoding="utf-8")
        (folder / f"{name}.yaml").write_text(display_text(name), encoding="utf-8")


if __name__ == "__main__":
    write(Path(__file__).parent, sys.argv[1:] or [*MODELS, *CURVED, *MIRRORS])
