"""What the pages of the reference begin with: a sentence, an example how to read on."""

from __future__ import annotations

NOTE = """\
Made from the models in `quiltcli/job/` by `make docs`: change the docstring there, not this page.
**Required** keys have no default; where the default is –, the key may be absent, and its meaning says what
holds then. Paths are relative to the file that names them, colours are linear Rec.709, the world is
right-handed with Y up. [Reference of the other files](../index.md#reference)."""
EXAMPLES = {
    "display": """\
quilt_display: 1
mesh: sphere.obj                  # every face of the mesh is one facet
units: mm
viewing_side: front               # lit where the faces' winding looks: to be walked around
resolution: {pixels_per_metre: 1200}
facets:                           # what is different on single facets, by id
  3: {name: top, up: [0, 0, -1], rotate: 90}
transform: {translate: [0, 1.2, 0], rotate_deg: [0, 15, 0]}
""",
    "calibration": """\
quilt_calibration: 1
image: [768, 768]
points:                           # marks on the mirror, and the pixels that light them
- {mirror_deg: 0, at: [-0.04, -0.0566], pixel: [605.3, 605.0]}
- {mirror_deg: 0, at: [0.04, -0.0566], pixel: [605.6, 162.6]}
- {mirror_deg: 0, at: [-0.04, 0.0566], pixel: [131.1, 637.2]}
- {mirror_deg: 180, at: [-0.04, -0.0566], pixel: [162.1, 162.2]}
- {mirror_deg: 180, at: [0.04, -0.0566], pixel: [162.6, 606.2]}
- {mirror_deg: 180, at: [0.04, 0.0566], pixel: [637.4, 636.7]}
free: [f, rotation, position]     # the centre is known
centre: [384, 384]
""",
    "camera": """\
quilt_camera: 1
size: [4000, 3000]
focal: [3102.4, 3102.4]
centre: [2009.1, 1488.6]
distortion: [-0.094, 0.027, 0.0006, -0.0004, 0]
""",
    "lightfield": """\
quilt_lightfield: 1
images: h{row:02}/v{view:04}.png  # and {frame} for animations
views: 288
camera_turns: clockwise           # about the object; a turntable that turns anticlockwise gives this
distance: 1.0
heights: {first: 0, step: 0.0125, count: 32}
camera: {focal: [1400, 1400], size: [1280, 720], look_at: [0, 0, 0]}
encoding: srgb
focus: mirror
""",
    "lightfield360": """\
quilt_display: 1
kind: lightfield360
image: [768, 768]
projector: {height: 0.6, diameter: 0.13}        # or matrix, or calibration: clicks.yaml
mirror: {tilt_deg: 45, outline: {disk: 0.13}}
rotation: {positions: 288, direction: increasing, first_deg: 0}
diffuser: {horizontal_deg: 1.25, reflection: plane}
packing: {order: rgb, bits: lsb, refresh: 200}
""",
    "job": """\
quilt_job: 1
display: display.yaml
scene: scene.yaml                 # or a mesh or glTF file
frames: 1-120
fps: 30
viewer:
  near: 0.05
  far: 50
  path:
    keyframes:
    - {frame: 1, position: [0, 1.6, 2.5], look_at: [0, 1.2, 0]}
    - {frame: 120, position: [2.5, 1.6, 0], look_at: [0, 1.2, 0]}
    interpolation: smooth
render: {samples: 4}
output: {directory: out, channels: [rgba, Z, facet], compression: zip}
""",
    "layout": """\
quilt_layout: 1
padding: 2
pages:
- size: [1024, 1024]
facets:
- id: 1
  page: 1
  size: [227, 198]
  quilt_from_facet: [[1, 0, 12], [0, 1, 340]]     # moved 12 pixels right and 340 down
  origin: [-0.1, 0.2, 0]
  du: [0.001, 0, 0]
  dv: [0, -0.001, 0]
  polygon: [[0, 0], [227, 0], [227, 198], [0, 198]]
""",
    "scene": """\
quilt_scene: 1
objects:
- name: dragon
  mesh: dragon.ply
  transform: {translate: [0, 0.5, 0], rotate_deg: [0, 90, 0], scale: 2}
  material: {color: [0.8, 0.2, 0.1], roughness: 0.4}
lights:
- {type: directional, direction: [-1, -2, -1], color: [3, 3, 3]}
- {type: ambient, color: [0.1, 0.1, 0.1]}
background: [0, 0, 0]
""",
}
INTRODUCTIONS = {
    "calibration": "Marks on a spinning mirror and the pixels of the projector's image that light them."
    " `quilt calibrate` finds the projector.",
    "camera": "A camera that takes photos of a display for `quilt calibrate`, which also writes such a file.",
    "lightfield": "Pictures of an object from a ring of places around it, which a display with a spinning"
    " mirror can show. `quilt capture` makes them of a scene.",
    "display": "Which mesh is the display, how large it is, and how many pixels its facets have. `quilt pack`"
    " and every job read it.",
    "lightfield360": "A display file whose `kind` is `lightfield360`: a projector above a spinning mirror.",
    "job": "What to render, for whom, and where to. Every key may be set on the command line as well:"
    " `--set render.samples=4`.",
    "layout": "Where each facet's pixels lie in the quilt. `quilt pack` and `quilt import` write it, and so"
    " does every render, beside its images; a job may name one.",
    "scene": "What is to be seen: meshes, lights and background. A job may also name a mesh or a glTF file"
    " directly.",
}
