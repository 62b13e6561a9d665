"""Cameras as a script for Blender, which makes them, and renders through them where it is asked to.

Blender's world has Z up: (x, y, z) here is (x, −z, y) there, as its glTF importer has it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from quiltcli.exchange.cameras.cameras import Camera, Shot
from quiltcli.exchange.cameras.tracks import Track, tracks

_SENSOR = 36.0  # millimetres; only its ratio to the lens matters
_LEAST_LENS = 1.0  # millimetres: Blender takes no shorter one

_SCRIPT = '''"""Cameras for the facets of a display, made by quilt.

    blender scene.blend -b -P THIS.py                      make the cameras
    blender scene.blend -b -P THIS.py -- --render DIR      and render every facet and frame into DIR
"""

import json
import os
import sys

import bpy
from mathutils import Matrix

DATA = json.loads(r"""
@DATA@
""")


def make(track):
    name = "quilt." + track["name"]
    data = bpy.data.cameras.new(name)
    data.sensor_fit = "HORIZONTAL"
    camera = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(camera)
    for key in track["keys"]:
        camera.matrix_world = Matrix(key["matrix"])
        camera.keyframe_insert("location", frame=key["frame"])
        camera.keyframe_insert("rotation_euler", frame=key["frame"])
        for attribute in ("sensor_width", "lens", "shift_x", "shift_y", "clip_start", "clip_end"):
            setattr(data, attribute, key[attribute])
            data.keyframe_insert(attribute, frame=key["frame"])
    return camera


def settle(scene, track, camera):
    """What Blender keeps with the scene, not with the camera."""
    scene.camera = camera
    render = scene.render
    render.resolution_x, render.resolution_y = track["pixels"]
    render.resolution_percentage = 100
    render.pixel_aspect_x, render.pixel_aspect_y = track["aspect"]


scene = bpy.context.scene
scene.render.fps, scene.render.fps_base = DATA["fps"]
scene.frame_start, scene.frame_end = DATA["frames"]
cameras = [make(track) for track in DATA["tracks"]]
if cameras:
    settle(scene, DATA["tracks"][0], cameras[0])
words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
if words[:1] == ["--render"] and len(words) == 2:
    settings = scene.render.image_settings
    if "OPEN_EXR" not in settings.file_format:
        if hasattr(settings, "media_type"):  # from Blender 5 on
            settings.media_type = "IMAGE"
        settings.file_format = "OPEN_EXR"
    for track, camera in zip(DATA["tracks"], cameras):
        settle(scene, track, camera)
        for key in track["keys"]:
            scene.frame_set(key["frame"])
            scene.render.filepath = os.path.join(words[1], "%s.%04d.exr" % (track["name"], key["frame"]))
            bpy.ops.render.render(write_still=True)
'''


def script(shots: Sequence[Shot], fps: Fraction) -> str:
    """A script that needs nothing but Blender."""
    frames = [shot.frame for shot in shots]
    data = {
        "fps": _rate(fps),
        "frames": [min(frames), max(frames)],
        "tracks": [_track(track) for track in tracks(shots)],
    }
    text = json.dumps(data, ensure_ascii=True)
    return _SCRIPT.replace("@DATA@", text)


def _rate(fps: Fraction) -> list[float]:
    """Frames a second as Blender has them: a whole number, and what divides it."""
    whole = -(-fps.numerator // fps.denominator)
    return [whole, float(whole / fps)]


def _track(track: Track) -> dict[str, Any]:
    camera = next(iter(track.keys.values()))
    left, right, bottom, top = camera.window
    across, down = track.pixels
    shape = (right - left) / across / ((top - bottom) / down)
    # Blender wants both parts of a pixel's shape to be 1 or more.
    aspect = [max(shape, 1.0), max(1.0 / shape, 1.0)] if abs(shape - 1) > 1e-9 else [1.0, 1.0]
    keys = [{"frame": frame, **_key(key)} for frame, key in track.keys.items()]
    return {"name": track.name, "pixels": list(track.pixels), "aspect": aspect, "keys": keys}


def _key(camera: Camera) -> dict[str, Any]:
    """Lens, shifts (in widths of the picture) and the matrix of a camera at a frame."""
    left, right, bottom, top = camera.window
    columns = [camera.axes[0], camera.axes[1], -camera.axes[2], camera.position]
    x, y, z = ([float(column[axis]) for column in columns] for axis in range(3))
    sensor = max(_SENSOR, _LEAST_LENS * (right - left))
    return {
        "sensor_width": sensor,
        "lens": sensor / (right - left),
        "shift_x": (right + left) / 2 / (right - left),
        "shift_y": (top + bottom) / 2 / (right - left),
        "clip_start": camera.near,
        "clip_end": camera.far,
        "matrix": [x, [-c + 0.0 for c in z], y, [0.0, 0.0, 0.0, 1.0]],
    }
