"""UsdLux lights, as the radiance, intensity or irradiance that they give (UsdLux overview, "Quantities")."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.formats.usd.stage import Stage, file_of, library

KINDS = ("DistantLight", "SphereLight", "RectLight", "DiskLight", "DomeLight", "DomeLight_1")
_WIDEST = math.pi / 2


@dataclass(frozen=True)
class Lamp:
    """A light in its own space, in the units of the stage.

    Attributes:
        kind: `directional`, `point`, `spot`, `area`, `ambient` or `environment`.
        color: irradiance of a directional light, else radiance, linear.
        size: radius of a sphere; width and height of an area.
        normalized: whether its strength is to be divided by its area, in the stage's units.
        cone: angles, radians, to where it begins to fade and to where it is dark.
        panorama: file of a picture, empty for none.
        notices: what of it is not drawn.
    """

    kind: str
    color: tuple[float, float, float]
    size: tuple[float, float] = (0.0, 0.0)
    normalized: bool = False
    cone: tuple[float, float] = (0.0, _WIDEST)
    panorama: str = ""
    notices: tuple[str, ...] = ()


def is_light(prim: Any) -> bool:
    """Whether a prim is a light of any kind."""
    return bool(prim.HasAPI(library().UsdLux.LightAPI))


def read_lamp(stage: Stage, prim: Any, time: Any) -> Lamp | None:
    """A light; None for a kind that is not drawn.

    Raises:
        MeshError: a value is not what it must be.
    """
    name = prim.GetTypeName()
    if name not in KINDS:
        return None
    read = _Reader(stage, prim, time)
    color, lost = read.color(), read.lost()
    normalized = bool(read.get("normalize", False))
    if name == "DistantLight":
        half = math.radians(read.number("angle", 0.53)) / 2
        # A sun of no size has its irradiance; another the radiance of its disc.
        seen = math.pi * math.sin(half) ** 2
        share = 1.0 if normalized or seen == 0 else seen
        return Lamp("directional", _times(color, share), notices=lost)
    if name.startswith("DomeLight"):
        return _dome(read, color, lost)
    if name == "RectLight":
        size = read.number("width", 1.0), read.number("height", 1.0)
        if read.get("texture:file", None):
            lost = (*lost, "its picture")
        return Lamp("area", color, size, normalized, notices=(*lost, *read.shaped()))
    radius = read.number("radius", 0.5)
    if name == "DiskLight":
        side = radius * math.sqrt(math.pi)
        more = (*lost, *read.shaped(), "its round shape (a square of its area shines)")
        return Lamp("area", color, (side, side), normalized, notices=more)
    cone = read.cone()
    kind = "point" if cone is None else "spot"
    return Lamp(kind, color, (radius, radius), normalized, cone or (0.0, _WIDEST), notices=lost)


def _dome(read: _Reader, color: tuple[float, float, float], lost: tuple[str, ...]) -> Lamp:
    asset = read.get("texture:file", None)
    if not asset or not asset.path:
        return Lamp("ambient", color, notices=lost)
    form = str(read.get("texture:format", "automatic"))
    if form not in ("automatic", "latlong"):
        words = f"is {form} (expected automatic or latlong)"
        raise read.stage.error(read.attribute("texture:format"), words)
    file = file_of(read.attribute("texture:file"), asset)
    return Lamp("environment", color, panorama=file, notices=lost)


@dataclass(frozen=True)
class _Reader:
    """The inputs of a light."""

    stage: Stage
    prim: Any
    time: Any

    def attribute(self, name: str) -> Any:
        return self.prim.GetAttribute(f"inputs:{name}")

    def get(self, name: str, default: Any) -> Any:
        attribute = self.attribute(name)
        value = attribute.Get(self.time) if attribute else None
        return default if value is None else value

    def number(self, name: str, default: float) -> float:
        """A number that is not negative."""
        value = float(self.get(name, default))
        if not 0 <= value < math.inf:
            raise self.stage.error(self.attribute(name), f"is {value:g} (expected a number, 0 or more)")
        return value

    def color(self) -> tuple[float, float, float]:
        """Its strength: colour, temperature, intensity and exposure."""
        given = np.asarray(self.get("color", (1.0, 1.0, 1.0)), dtype=np.float64)
        if given.shape != (3,) or not (np.isfinite(given).all() and (given >= 0).all()):
            raise self.stage.error(self.attribute("color"), f"is {given} (expected 3 numbers, 0 or more)")
        if self.get("enableColorTemperature", False):
            kelvin = self.number("colorTemperature", 6500.0)
            given = given * np.asarray(library().UsdLux.BlackbodyTemperatureAsRgb(kelvin), dtype=np.float64)
        exposure = float(self.get("exposure", 0.0))
        if not abs(exposure) < 100:
            words = f"is {exposure:g} (expected a number between -100 and 100)"
            raise self.stage.error(self.attribute("exposure"), words)
        strength = self.number("intensity", 1.0) * 2.0**exposure
        return _times((float(given[0]), float(given[1]), float(given[2])), strength)

    def cone(self) -> tuple[float, float] | None:
        """Where its cone begins to fade and ends, radians; None for a light that shines all around."""
        if not self.attribute("shaping:cone:angle").HasAuthoredValue():
            return None
        outer = math.radians(self.number("shaping:cone:angle", 90.0))
        if outer >= _WIDEST:
            return None
        return outer * (1 - min(self.number("shaping:cone:softness", 0.0), 1.0)), outer

    def shaped(self) -> tuple[str, ...]:
        """What shapes it that only a sphere's light is shaped by here."""
        return () if self.cone() is None else ("its cone",)

    def lost(self) -> tuple[str, ...]:
        """What is not drawn of any light."""
        found = []
        if self.get("shaping:focus", 0.0):
            found.append("its focus")
        if self.get("shaping:ies:file", None):
            found.append("its IES profile")
        if self.get("diffuse", 1.0) != 1 or self.get("specular", 1.0) != 1:
            found.append("its factors of diffuse and specular light")
        return tuple(found)


def _times(color: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    return color[0] * factor, color[1] * factor, color[2] * factor
