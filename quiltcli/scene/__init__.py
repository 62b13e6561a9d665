"""The scene: every triangle in world space, with what shading needs to know of it."""

from __future__ import annotations

from quiltcli.scene.lights import Light
from quiltcli.scene.load import load_scene
from quiltcli.scene.scene import Materials, Scene

__all__ = ["Light", "Materials", "Scene", "load_scene"]
