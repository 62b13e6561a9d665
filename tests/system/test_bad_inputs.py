"""Bad inputs, each through the whole command line: the exact message, exit code 2, nothing left.

A case changes the files of the small job of `tinyjob`, and says what `quilt render job.yaml` must say.
"""

# ruff: noqa: E501 - exact messages are easier to read, and to find, unbroken

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from click.testing import CliRunner

from quiltcli.cli import main
from tests.helpers.tiny_job import FILES, files_in, replaced, write_tiny_job

JOB, DISPLAY, SCENE, LAYOUT = "job.yaml", "display.yaml", "scene.yaml", "layout.yaml"
WALLS, BALL = "walls.obj", "ball.obj"
HERE = Path()
FACE = "f 1 2 3 4\n"
POSES = (
    "    - {frame: 1, position: [0, 0, 2], look_at: [0, 0, 0]}\n"
    "    - {frame: 4, position: [-0.5, 0.2, 3], look_at: [0, 0, 0]}\n"
)
PATH = "    keyframes:\n" + POSES
PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 4\n"
    b"property float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
)
PLACES = """\
quilt_layout: 1
display: display.yaml
pages:
- size: [64, 144]
facets:
- {id: 1, page: 1, size: [64, 64], quilt_from_facet: [[1, 0, 0], [0, 1, 0]], origin: [-1, 1, 0],
   du: [0.03125, 0, 0], dv: [0, -0.03125, 0], polygon: [[0, 64], [64, 64], [64, 0], [0, 0]]}
- {id: 2, page: 1, size: [64, 64], quilt_from_facet: [[1, 0, 0], [0, 1, 66]], origin: [1, 1, 0],
   du: [0, 0, 0.03125], dv: [0, -0.03125, 0], polygon: [[0, 64], [64, 64], [64, 0], [0, 0]]}
"""

Step = Callable[[], object]


def swap(name: str, old: str, new: str) -> Step:
    return lambda: replaced(HERE, name, old, new)


def put(name: str, text: str) -> Step:
    return lambda: Path(name).write_text(text)


def raw(name: str, data: bytes) -> Step:
    def write() -> None:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_bytes(data)

    return write


def cut(name: str, start: str) -> Step:
    return lambda: Path(name).write_text(Path(name).read_text().partition(start)[0])


def folder(name: str) -> Step:
    return lambda: Path(name).mkdir()


def gone(name: str) -> Step:
    return lambda: Path(name).unlink()


def renamed(old: str, new: str) -> Step:
    return lambda: Path(old).rename(new)


NAMED = swap(JOB, "scene:", "layout: layout.yaml\nscene:")


class Case:
    def __init__(self, title: str, steps: Sequence[Step], words: Sequence[str], *messages: str) -> None:
        self.title = title
        self.steps = steps
        self.words = words
        self.messages = list(messages)


# fmt: off
CASES = [
    Case("yaml: typo", [swap(JOB, "near:", "naer:")], [],
         "job.yaml:5:1: viewer.near: missing key (nearest depth that is drawn, from the eye, metres)", "job.yaml:6:3: viewer.naer: unknown key (did you mean 'near'?)"),
    Case("yaml: wrong type", [swap(JOB, "far: 50", "far: fifty")], [],
         "job.yaml:7:8: viewer.far: expected a number, got the text 'fifty'"),
    Case("yaml: duplicate key", [swap(JOB, "far: 50", "far: 50\n  near: 1")], [],
         "job.yaml:8:3: viewer.near: duplicate key (first given in line 6)"),
    Case("yaml: 1e3", [swap(JOB, "far: 50", "far: 1e3x")], [],
         "job.yaml:7:8: viewer.far: expected a number, got the text '1e3x'"),
    Case("yaml: nan", [swap(JOB, "far: 50", "far: .nan")], [],
         "job.yaml:7:8: viewer.far: expected a finite number, got nan"),
    Case("yaml: inf pos", [swap(JOB, "[0, 0, 2]", "[0, .inf, 2]")], [],
         "job.yaml:10:32: viewer.path.keyframes[0].position[1]: expected a finite number, got inf"),
    Case("yaml: yes", [swap(JOB, "frames: 1-4", "render: {backface_culling: yes}\nframes: 1-4")], [],
         "job.yaml:4:28: render.backface_culling: expected true or false, got the text 'yes' (write true)"),
    Case("yaml: tab", [swap(JOB, "  near", "\tnear")], [],
         "job.yaml:6:1: a tab cannot indent in YAML (use spaces)"),
    Case("yaml: bracket", [swap(JOB, "[0, 0, 2]", "[0, 0, 2")], [],
         "job.yaml:10:56: not YAML: expected ',' or ']', but got '}' (while parsing a list in [ ] that starts in line 10)"),
    Case("yaml: empty", [put(JOB, "")], [],
         "job.yaml: the file is empty (expected 'key: value' lines)"),
    Case("yaml: list", [put(JOB, "- 1\n")], [],
         "job.yaml:1:1: expected 'key: value' lines, got a list"),
    Case("yaml: version", [swap(JOB, "quilt_job: 1", "quilt_job: 2")], [],
         "job.yaml:1:12: quilt_job: version 2 is newer than this program reads (expected 1)"),
    Case("yaml: other kind", [put(JOB, FILES[SCENE])], [],
         "job.yaml:1:1: quilt_scene: this is a quilt_scene file (a quilt_job file was expected)"),
    Case("yaml: binary", [raw(JOB, b'\x89PNG\r\n\x1a\n\x00')], [],
         "job.yaml:1:1: not UTF-8 text: byte 0x89 at offset 0 (save the file as UTF-8)"),
    Case("yaml: display missing", [swap(JOB, "display: display.yaml", "display: dispaly.yaml")], [],
         "job.yaml:2:10: display: no such file: dispaly.yaml (did you mean 'display.yaml'?)"),
    Case("yaml: display dir", [folder("dir.yaml"), swap(JOB, "display: display.yaml", "display: dir.yaml")], [],
         "job.yaml:2:10: display: dir.yaml is a directory (expected a YAML file)"),
    Case("yaml: display key missing", [swap(JOB, "display: display.yaml\n", "")], [],
         "job.yaml:1:1: display: missing key (display file)"),
    Case("yaml: two numbers", [swap(JOB, "[0, 0, 2]", "[0, 2]")], [],
         "job.yaml:10:28: viewer.path.keyframes[0].position: expected 3 numbers, got 2"),
    Case("yaml: frames back", [swap(JOB, "frames: 1-4", "frames: 4-1")], [],
         "job.yaml:4:9: frames: '4-1' goes backwards (write 1-4)"),
    Case("yaml: frames twice", [swap(JOB, "frames: 1-4", "frames: 1-4,3")], [],
         "job.yaml:4:9: frames: frame 3 is named twice in '1-4,3'"),
    Case("yaml: fps", [swap(JOB, "frames: 1-4", "frames: 1-4\nfps: 0")], [],
         "job.yaml:5:6: fps: must be greater than 0, got 0"),
    Case("yaml: channel", [swap(JOB, "frames: 1-4", "output: {channels: [rgba, depth]}\nframes: 1-4")], [],
         "job.yaml:4:27: output.channels[1]: expected rgba, Z, zv, facet, object, triangle, N, P, uv, albedo, diffuse, specular, emission, motion, cryptoobject or cryptomaterial, got the text 'depth'"),
    Case("yaml: compression", [swap(JOB, "frames: 1-4", "output: {compression: zpi}\nframes: 1-4")], [],
         "job.yaml:4:23: output.compression: expected none, rle, zips, zip, piz, zstd, htj2k32, htj2k256, pxr24, b44, b44a, dwaa, dwab or lj2k, got the text 'zpi'"),
    Case("yaml: nothing", [swap(JOB, "frames: 1-4", "output: {quilts: false, facets: false}\nframes: 1-4")], [],
         "job.yaml:4:9: output: nothing to write (expected quilts or facets to be true)"),
    Case("yaml: method", [swap(JOB, "frames: 1-4", "layout: {metod: rows}\nframes: 1-4")], [],
         "job.yaml:4:10: layout.metod: unknown key (did you mean 'method'?)"),
    Case("yaml: samples", [swap(JOB, "frames: 1-4", "render: {samples: 0}\nframes: 1-4")], [],
         "job.yaml:4:19: render.samples: must be at least 1, got 0"),
    Case("path: no keyframe", [swap(JOB, POSES, ""), swap(JOB, "keyframes:", "keyframes: []")], [],
         "job.yaml:9:16: viewer.path.keyframes: expected at least 1 item, got none"),
    Case("path: none", [swap(JOB, PATH, "    interpolation: linear\n")], [],
         "job.yaml:8:3: viewer.path: expected keyframes, orbit, csv or recorded, got none", "job.yaml:9:20: viewer.path.interpolation: belongs to keyframes, and there are none"),
    Case("path: duplicate", [swap(JOB, "frame: 4", "frame: 1")], [],
         "job.yaml:11:15: viewer.path.keyframes[1].frame: frame 1 is already given by keyframes[0]"),
    Case("path: two kinds", [swap(JOB, "    keyframes:", "    orbit: {center: [0, 0, 0], radius: 2, frames_per_turn: 4}\n    keyframes:")], [],
         "job.yaml:9:12: viewer.path.orbit: cannot stand beside keyframes (expected only one of keyframes, orbit, csv or recorded)"),
    Case("path: near far", [swap(JOB, "near: 0.05", "near: 50")], [],
         "job.yaml:7:8: viewer.far: must be greater than near (50), got 50"),
    Case("path: near 0", [swap(JOB, "near: 0.05", "near: 0")], [],
         "job.yaml:6:9: viewer.near: must be greater than 0, got 0"),
    Case("path: along up", [swap(JOB, "[0, 0, 2]", "[0, 3, 0]")], [],
         "job.yaml:10:48: viewer.path.keyframes[0].look_at: looks along up (turn up to another direction)"),
    Case("path: at itself", [swap(JOB, "[0, 0, 2]", "[0, 0, 0]")], [],
         "job.yaml:10:48: viewer.path.keyframes[0].look_at: is where the viewer is (expected a point to look at)"),
    Case("path: turns along up", [swap(JOB, POSES, "    - {frame: 1, position: [-0.5, 2, 1], look_at: [0, 0, 1]}\n    - {frame: 3, position: [0.5, 2, 1], look_at: [0, 0, 1]}\n")], [],
         "job.yaml:10:7: viewer.path.keyframes[0]: at frame 2 the viewer looks along up (turn up elsewhere)"),
    Case("path: csv gap", [put("t.csv", "frame,x,y,z\n1,0,0,2\n4,0,0,3\n"), swap(JOB, PATH, "    csv: {file: t.csv, look_at: [0, 0, 0]}\n")], [],
         "t.csv:3:1: frame 2 is missing between 1 and 4 (add it, or set fill: true)", "t.csv:3:1: frame 3 is missing between 1 and 4 (add it, or set fill: true)"),
    Case("path: csv text", [put("t.csv", "frame,x,y,z\n1,0,zero,2\n"), swap(JOB, PATH, "    csv: {file: t.csv, look_at: [0, 0, 0]}\n")], [],
         "t.csv:2:5: y: expected a number, got 'zero'"),
    Case("path: csv short", [put("t.csv", "frame,x,y,z\n1,0,0,2\n2,0,0,2\n"), swap(JOB, PATH, "    csv: {file: t.csv, look_at: [0, 0, 0]}\n")], [],
         "job.yaml:9:10: viewer.path.csv: frame 3 is not in t.csv (it holds frames 1 to 2)", "job.yaml:9:10: viewer.path.csv: frame 4 is not in t.csv (it holds frames 1 to 2)"),
    Case("mesh: missing", [gone(WALLS)], [],
         "display.yaml:2:7: mesh: no such file: walls.obj (did you mean 'ball.obj'?)"),
    Case("mesh: empty", [put(WALLS, "")], [],
         "walls.obj: the mesh is empty (expected vertices and faces)"),
    Case("mesh: points", [put(WALLS, "v 0 0 0\n")], [],
         "walls.obj: the mesh has 1 vertices but no faces (expected one or more)"),
    Case("mesh: nan", [swap(WALLS, "v 1 1 0", "v 1 nan 0")], [],
         "walls.obj:3: vertex 3 is (1, nan, 0) (expected finite numbers)"),
    Case("mesh: text", [swap(WALLS, "v 1 1 0", "v 1 one 0")], [],
         "walls.obj:3: found '1 one 0' (expected numbers)"),
    Case("mesh: range", [swap(WALLS, FACE, "f 1 2 3 9\n")], [],
         "walls.obj:8: face 1 names vertex 9 (expected 1 to 6)"),
    Case("mesh: index 0", [swap(WALLS, FACE, "f 0 1 2 3\n")], [],
         "walls.obj:8: face 1 names vertex 0 (numbers start at 1, or at -1 from the end)"),
    Case("mesh: nonplanar", [swap(WALLS, "v -1 1 0", "v -1 1 0.1")], [],
         "walls.obj:8: facet 1 (back): not planar: its corners lie up to 0.025 m off its plane (expected at most 0.000283 m, 0.0001 of its size)"),
    Case("mesh: bow-tie", [swap(WALLS, FACE, "f 1 2 4 3\n")], [],
         "walls.obj:8: facet 1 (back): its outline crosses itself and encloses no area (expected a simple polygon)"),
    Case("mesh: zero area", [swap(WALLS, "v 1 1 0", "v 0 -1 0"), swap(WALLS, "f 1 2 3 4", "f 1 2 3")], [],
         "walls.obj:8: facet 1 (back): all its corners lie on one line (expected a face with an area)", "walls.obj:10: facet 2 (right): not planar: its corners lie up to 0.408 m off its plane (expected at most 0.0003 m, 0.0001 of its size)"),
    Case("mesh: doubled corner", [swap(WALLS, FACE, "f 1 2 2 3\n")], [],
         "walls.obj:8: facet 1 (back): corners 2 and 3 are the same point (expected distinct corners)"),
    Case("mesh: doubled face", [swap(WALLS, FACE, "f 1 2 3 4\nf 2 3 4 1\n")], [],
         "walls.obj:9: facet 2: has the same corners as facet 1 (expected every face once)"),
    Case("mesh: 2 corners", [swap(WALLS, FACE, "f 1 2\n")], [],
         "walls.obj:8: face 1 has 2 corners (expected 3 or more)"),
    Case("mesh: suffix", [renamed(WALLS, "walls.fbx"), swap(DISPLAY, WALLS, "walls.fbx")], [],
         "display.yaml:2:7: mesh: expected a mesh (.obj, .ply, .off, .stl, .glb, .gltf, .usd, .usda, .usdc, .usdz), got the suffix '.fbx' (export it as GLB)"),
    Case("mesh: truncated ply", [raw("walls.ply", PLY + b'\x00\x00\x00\x00\x00\x00\x80?\x00\x00\x00@\x00\x00@@\x00\x00\x80@\x00\x00\xa0@\x00\x00\xc0@\x00\x00\xe0@\x00\x00\x00A'), swap(DISPLAY, WALLS, "walls.ply")], [],
         "walls.ply: truncated: the 4 rows of vertex need 48 bytes from byte 169, but 36 are there"),
    Case("mesh: truncated ply face", [raw("walls.ply", PLY + b'\x00\x00\x00\x00\x00\x00\x80?\x00\x00\x00@\x00\x00@@\x00\x00\x80@\x00\x00\xa0@\x00\x00\xc0@\x00\x00\xe0@\x00\x00\x00A\x00\x00\x10A\x00\x00 A\x00\x000A\x04\x00\x00'), swap(DISPLAY, WALLS, "walls.ply")], [],
         "walls.ply: truncated: row 1 of 1 of face runs past the end, byte 220"),
    Case("mesh: ply header", [put("walls.ply", "ply\nformat ascii 1.0\n"), swap(DISPLAY, WALLS, "walls.ply")], [],
         "walls.ply:3: the header never ends (expected a line end_header)"),
    Case("mesh: off short", [put("walls.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), swap(DISPLAY, WALLS, "walls.off")], [],
         "walls.off: the file ends after 1 of 2 faces"),
    Case("display: facet", [swap(DISPLAY, "resolution:", "facets: {3: {name: top}}\nresolution:")], [],
         "display.yaml:3:13: facets.3: there is no facet 3 (the mesh has facets 1 to 2)"),
    Case("display: up", [swap(DISPLAY, "resolution:", "facets: {1: {up: [0, 0, 1]}}\nresolution:")], [],
         "display.yaml:3:18: facets.1.up: [0, 0, 1] is perpendicular to facet 1 (back) (expected a direction that leans along it by 1 degree or more)"),
    Case("display: size", [swap(DISPLAY, "pixels_per_metre: 32", "pixels_per_metre: 100000")], [],
         "display.yaml:3:32: resolution.pixels_per_metre: makes facet 1 (back) over 65536 × over 65536 pixels (expected 1 to 65536 a side)", "display.yaml:3:32: resolution.pixels_per_metre: makes facet 2 (right) over 65536 × over 65536 pixels (expected 1 to 65536 a side)"),
    Case("display: no resolution", [swap(DISPLAY, "resolution: {pixels_per_metre: 32}\n", "")], [],
         "display.yaml:1:1: resolution: missing key (how many pixels the facets have; or layout: {from_uv: true, "
         "size: [W, H]} for a mesh whose texture coordinates tell)"),
    Case("display: units", [swap(DISPLAY, "mesh:", "units: inch\nmesh:")], [],
         "display.yaml:2:8: units: expected m, cm, mm, in, ft or a number of metres, got the text 'inch'"),
    Case("display: all disabled", [swap(DISPLAY, "resolution:", "facets: {1: {enabled: false}, 2: {enabled: false}}\nresolution:")], [],
         "display.yaml: no facet is enabled, so there is nothing to pack"),
    Case("display: uv", [swap(DISPLAY, "resolution:", "layout: {from_uv: true, size: [64, 64]}\nresolution:")], [],
         "display.yaml: the mesh has no texture coordinates, which from_uv reads the layout from"),
    Case("layout: overlap", [put(LAYOUT, PLACES), swap(LAYOUT, "[[1, 0, 0], [0, 1, 66]]", "[[1, 0, 0], [0, 1, 60]]"), NAMED], [],
         "layout.yaml:8:54: facets[1].quilt_from_facet: facets 1 and 2 overlap in 256 pixels, the first at (0, 60) of page 1"),
    Case("layout: off page", [put(LAYOUT, PLACES), swap(LAYOUT, "[[1, 0, 0], [0, 1, 66]]", "[[1, 0, 0], [0, 1, 166]]"), NAMED], [],
         "layout.yaml:8:54: facets[1].quilt_from_facet: facet 2: corner 1 at (0, 230) lies outside page 1 of 64×144 pixels"),
    Case("layout: id", [put(LAYOUT, PLACES), swap(LAYOUT, "id: 2", "id: 7"), NAMED], [],
         "layout.yaml:8:8: facets[1].id: facet 7 is not in display.yaml, which has facets 1 to 2", "layout.yaml:5:1: facets: facet 2 (right) of display.yaml has no place; run quilt pack again, or disable it"),
    Case("layout: id twice", [put(LAYOUT, PLACES), swap(LAYOUT, "id: 2", "id: 1"), NAMED], [],
         "layout.yaml:8:8: facets[1].id: facet 1 already has a place, at facets[0]"),
    Case("layout: page", [put(LAYOUT, PLACES), swap(LAYOUT, "id: 2, page: 1", "id: 2, page: 2"), NAMED], [],
         "layout.yaml:8:17: facets[1].page: there is no page 2 (the layout has 1 page)"),
    Case("layout: hash", [put(LAYOUT, PLACES), swap(LAYOUT, "pages:\n", "display_sha256: aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\npages:\n"), NAMED], [],
         "layout.yaml:3:17: display_sha256: made for other geometry: found the hash aaaaaaaaaaaa…, but display.yaml has HASH…; run quilt pack again"),
    Case("layout: nan", [put(LAYOUT, PLACES), swap(LAYOUT, "[[1, 0, 0], [0, 1, 66]]", "[[1, 0, .nan], [0, 1, 66]]"), NAMED], [],
         "layout.yaml:8:62: facets[1].quilt_from_facet[0][2]: expected a finite number, got nan"),
    Case("layout: flat", [put(LAYOUT, PLACES), swap(LAYOUT, "[[1, 0, 0], [0, 1, 66]]", "[[1, 0, 0], [1, 0, 66]]"), NAMED], [],
         "layout.yaml:8:54: facets[1].quilt_from_facet: flattens the facet (its determinant is 0)"),
    Case("layout: no place", [put(LAYOUT, PLACES), cut(LAYOUT, "- {id: 2"), NAMED], [],
         "layout.yaml:5:1: facets: facet 2 (right) of display.yaml has no place; run quilt pack again, or disable it"),
    Case("layout: missing", [NAMED], [],
         "job.yaml:3:9: layout: no such file: layout.yaml"),
    Case("layout: too small", [swap(JOB, "scene:", "layout: {method: rows, size: [64, 64], max_pages: 1}\nscene:")], [],
         "display.yaml: 2 facets take 2 pages of 64×64 pixels by the method rows, but at most 1 may be used; 4096 pixels of 1 facet find no place; a density of at most 48.4 % of the present one would do, or pages of 130×130 would"),
    Case("layout: too small for one", [swap(JOB, "scene:", "layout: {method: rows, size: [32, 32]}\nscene:")], [],
         "display.yaml: facet 1 (back) is 64×64 pixels, more than a 32×32 page holds turned or not; a page of 64×64 would, or a density of at most 50 % of the present one", "display.yaml: facet 2 (right) is 64×64 pixels, more than a 32×32 page holds turned or not; a page of 64×64 would, or a density of at most 50 % of the present one"),
    Case("scene: missing mesh", [gone(BALL)], [],
         "scene.yaml:3:22: objects[0].mesh: no such file: ball.obj (did you mean 'walls.obj'?)"),
    Case("scene: empty mesh", [put(BALL, "")], [],
         "scene.yaml:3:22: objects[0].mesh: ball.obj: the file is empty (expected a mesh)"),
    Case("scene: no triangles", [put(BALL, "v 0 0 0\n")], [],
         "scene.yaml:3:22: objects[0].mesh: ball.obj: holds no triangles"),
    Case("scene: lines", [swap(BALL, "v 0 0.5 -1", "v 0 -0.5 -1"), swap(BALL, "v 0 0 -0.2", "v 2 -0.5 -1")], [],
         "scene.yaml:3:22: objects[0].mesh: ball.obj: every triangle is without area or not finite"),
    Case("scene: truncated stl", [raw("ball.stl", PLY + b''), swap(SCENE, BALL, "ball.stl")], [],
         "scene.yaml:3:22: objects[0].mesh: ball.stl: found 'ply' "
         "(expected text that begins with solid, or a binary header of 84 bytes)"),
    Case("scene: truncated glb", [raw("ball.glb", b'glTF\x02\x00\x00\x00\xff\x00\x00\x00'), swap(SCENE, BALL, "ball.glb")], [],
         "scene.yaml:3:22: objects[0].mesh: ball.glb: cannot be read as GLB: the file is damaged or incomplete"),
    Case("scene: no objects", [put(SCENE, "quilt_scene: 1\nobjects: []\n")], [],
         "scene.yaml:2:10: objects: expected at least 1 item, got none"),
    Case("scene: light", [swap(SCENE, "directional", "directonal")], [],
         "scene.yaml:5:10: lights[0].type: expected directional, point, spot, area, ambient, environment or file, got the text 'directonal' (did you mean 'directional'?)"),
    Case("scene: negative color", [swap(SCENE, "[0.8, 0.2, 0.1]", "[-0.8, 0.2, 0.1]")], [],
         "scene.yaml:3:51: objects[0].material.color[0]: must be at least 0, got -0.8"),
    Case("scene: direction", [swap(SCENE, "[-1, -2, -1]", "[0, 0, 0]")], [],
         "scene.yaml:5:34: lights[0].direction: a direction must not be zero"),
    Case("scene: scale 0", [swap(SCENE, "mesh: ball.obj", "mesh: ball.obj, transform: {scale: 0}")], [],
         "scene.yaml:3:51: objects[0].transform.scale: must not be 0"),
    Case("scene: dir", [folder("a.obj"), swap(SCENE, BALL, "a.obj")], [],
         "scene.yaml:3:22: objects[0].mesh: a.obj is a directory (expected a mesh)"),
    Case("cli: facets", [], ["--facets", "9"],
         "--facets: there is no facet 9 (the display has 1 to 2)"),
    Case("cli: frames", [], ["-f", "1-"],
         "usage: Error: Invalid value for '-f' / '--frames' / '--frame': cannot read '1-' in '1-' (expected a frame range such as 1-240, 1-9x2 or 1,5,20-30)"),
    Case("cli: frames text", [], ["-f", "all"],
         "usage: Error: Invalid value for '-f' / '--frames' / '--frame': cannot read 'all' in 'all' (expected a frame range such as 1-240, 1-9x2 or 1,5,20-30)"),
    Case("cli: set", [], ["--set", "render.sampels=2"],
         "--set render.sampels=2: render.sampels: unknown key (did you mean 'samples'?)"),
    Case("cli: set2", [], ["--set", "viewer.near"],
         "--set viewer.near: expected KEY=VALUE, such as render.samples=4"),
    Case("cli: set3", [], ["--set", "viewer.far=0.01"],
         "--set viewer.far=0.01: viewer.far: must be greater than near (0.05), got 0.01"),
    Case("out: existing", [raw("out/quilt/page_01.0002.exr", b'x')], [],
         "out/quilt/page_01.0002.exr: exists already (use --resume to keep finished frames, --overwrite to replace them)"),
    Case("out: file in the way", [raw("out", b'x')], [],
         "out: is a file, expected a folder"),
    Case("out: file in the way above", [raw("a", b'x')], ["-o", "a/b"],
         "a: is a file, expected a folder"),
    Case("out: quilt file", [raw("out/quilt", b'x')], [],
         "out/quilt: is a file, expected a folder"),
    Case("layout: elsewhere", [put(LAYOUT, PLACES), swap(LAYOUT, "origin: [1, 1, 0]", "origin: [1, 1, 1]"), NAMED], [],
         "layout.yaml:8:87: facets[1].origin: facet 2: corner 1 lies 1 m from where display.yaml has it; origin, du, dv and polygon must agree with the display"),
    Case("layout: corners", [put(LAYOUT, PLACES), swap(LAYOUT, "polygon: [[0, 64], [64, 64], [64, 0], [0, 0]]", "polygon: [[0, 64], [64, 64], [64, 0]]"), NAMED], [],
         "layout.yaml:7:56: facets[0].polygon: facet 1 has 3 corners, but 4 in display.yaml", "layout.yaml:9:56: facets[1].polygon: facet 2 has 3 corners, but 4 in display.yaml"),
    Case("layout: outside its raster", [put(LAYOUT, PLACES), swap(LAYOUT, "polygon: [[0, 64]", "polygon: [[0, 70]"), NAMED], [],
         "layout.yaml:7:56: facets[0].polygon: facet 1: corner 1 at (0, 70) lies outside its raster of 64×64 pixels", "layout.yaml:9:56: facets[1].polygon: facet 2: corner 1 at (0, 70) lies outside its raster of 64×64 pixels", "layout.yaml:8:54: facets[1].quilt_from_facet: facets 1 and 2 overlap in 85 pixels, the first at (0, 66) of page 1"),
    Case("path: turns right round", [swap(JOB, POSES, "    - {frame: 1, position: [0, 0, 2], look: [0, 0, -1]}\n    - {frame: 3, position: [0, 0, 2], look: [0, 0, 1]}\n")], [],
         "job.yaml:10:7: viewer.path.keyframes[0]: at frame 2 the viewer turns right round: there is no direction of view"),
    Case("scene: suffix", [renamed(BALL, "ball.fbx"), swap(SCENE, BALL, "ball.fbx")], [],
         "scene.yaml:3:22: objects[0].mesh: expected a mesh (.obj, .ply, .off, .stl, .glb, .gltf, .usd, .usda, .usdc, .usdz, .abc), got the suffix '.fbx' (export it as GLB)"),
    Case("scene: index", [swap(BALL, "f 3 1 4", "f 3 1 8")], [],
         "scene.yaml:3:22: objects[0].mesh: ball.obj:8: face 4 names vertex 8 (expected 1 to 4)"),
    Case("job: a mesh as display", [swap(JOB, "display: display.yaml", "display: walls.obj")], [],
         "job.yaml:2:10: display: expected a YAML file (.yaml, .yml), got the suffix '.obj'"),
    Case("scene: no mesh", [swap(SCENE, "name: ball, mesh: ball.obj,", "name: ball,")], [],
         "scene.yaml:3:3: objects[0].mesh: missing key (OBJ, PLY, OFF, STL, glTF, USD or Alembic; with # for a number, such as boat.####.ply, one a frame)"),
    Case("yaml: alias", [swap(JOB, "[0, 0, 2]", "&a [*a]")], [],
         "job.yaml:10:28: an alias refers to itself"),
    Case("yaml: tag", [swap(JOB, "far: 50", "far: !!python/name:os.system 50")], [],
         "job.yaml:7:8: viewer.far: the tag '!!python/name:os.system' is not understood (write a plain value)"),
    Case("cli: set csv", [], ["--set", "scene=nothere.obj"],
         "--set scene=nothere.obj: scene: no such file: nothere.obj"),
    Case("cli: no job", [gone(JOB)], [],
         "job.yaml: no such file"),
]
# fmt: on


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write_tiny_job(tmp_path)
    return tmp_path


def contents() -> dict[str, bytes]:
    return {name: Path(name).read_bytes() for name in files_in(HERE)}


def said(text: str) -> list[str]:
    """The lines of a message without what the command line adds, and without the display's own hash."""
    lines = text.splitlines()
    if lines[0].startswith("Usage: "):
        return [f"usage: {lines[-1]}"]
    return [re.sub(r"(?<=has )[0-9a-f]{12}…", "HASH…", line.removeprefix("error: ")) for line in lines]


def test_there_are_many_and_none_twice() -> None:
    assert len(CASES) == len({case.title for case in CASES}) == 109
    assert len({tuple(case.messages) for case in CASES}) > 100


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.title)
def test_render_says_what_is_wrong_and_leaves_nothing(case: Case, tiny: Path) -> None:
    for step in case.steps:
        step()
    before = contents()
    result = CliRunner().invoke(main, ["render", JOB, *case.words])
    assert said(result.stderr) == case.messages
    single = len(case.messages) == 1 and not case.messages[0].startswith("usage: ")
    assert result.stderr.startswith("error: ") == single
    assert (result.exit_code, result.stdout) == (2, "")
    assert contents() == before


def can_be_checked(case: Case) -> bool:
    """Whether the files alone are wrong; a scene where a job should be is a good scene."""
    return not case.words and not case.title.startswith("out:") and case.title != "yaml: other kind"


CHECKED = list(filter(can_be_checked, CASES))


@pytest.mark.parametrize("case", CHECKED, ids=lambda case: case.title)
def test_check_says_it_too(case: Case, tiny: Path) -> None:
    for step in case.steps:
        step()
    result = CliRunner().invoke(main, ["check", JOB])
    assert (result.exit_code, result.stderr) == (1, "")
    assert set(case.messages) <= set(said(result.stdout))


def test_the_job_itself_is_good(tiny: Path) -> None:
    put(LAYOUT, PLACES)()
    NAMED()
    result = CliRunner().invoke(main, ["render", JOB, "--dry-run"])
    assert (result.exit_code, result.stdout) == (0, "nothing is wrong with this job\n")
