"""Opening USD stages: what is wrong with them, their unit, their axes and their clock."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quiltcli.errors import MeshError, Problem, missing_extra
from quiltcli.formats.inputs import check_input
from quiltcli.geometry import FloatArray

_LISTED = 8
_LONGEST = 300
_DEFAULT_RATE = 24.0


@dataclass(frozen=True, eq=False)
class Stage:
    """An open stage.

    Attributes:
        path: its file as the user named it.
        usd: the stage itself, of `pxr.Usd`.
        metres: of one of its units.
        z_up: whether Z is up in it, else Y is.
        rate: time codes a second.
        range: first and last time code, where it names both.
        notices: what was assumed.
    """

    path: Path
    usd: Any
    metres: float
    z_up: bool
    rate: float
    range: tuple[float, float] | None
    notices: tuple[str, ...]

    @property
    def world(self) -> FloatArray:
        """Metres with Y up from the stage's space (4, 4); of Z up, -Y faces +Z."""
        turn = np.eye(4)
        if self.z_up:
            turn[:3, :3] = ((1, 0, 0), (0, 0, 1), (0, -1, 0))
        turn[:3, :3] *= self.metres
        return turn

    def error(self, prim: Any, message: str) -> MeshError:
        """An error of a prim, or of what has a path in the stage."""
        return MeshError(Problem(message, str(self.path), key=path_of(prim)))


def path_of(prim: Any) -> str:
    """Path of a prim, property or schema in its stage, as text that can be printed."""
    path = prim.GetPath() if hasattr(prim, "GetPath") else prim
    text = str(path).encode("utf-8", "backslashreplace").decode()
    return text if len(text) <= 120 else f"{text[:58]}…{text[-58:]}"


def file_of(attribute: Any, asset: Any) -> str:
    """The file that an attribute names; if it is not there, where it would be beside the layer."""
    if asset.resolvedPath:
        return str(asset.resolvedPath)
    stack = attribute.GetPropertyStack()
    layer = stack[0].layer if stack else attribute.GetStage().GetRootLayer()
    return str(Path(layer.realPath).parent / asset.path)


def library() -> Any:
    """The package `pxr`.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import pxr
        from pxr import Ar, Gf, Sdf, Tf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel, UsdUtils, Vt
    except ImportError:
        raise missing_extra("A USD file", "usd-core", "usd") from None
    assert all((Ar, Gf, Sdf, Tf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel, UsdUtils, Vt))
    return pxr


@contextmanager
def understood(path: Path) -> Iterator[None]:
    """Turn what the library says of a stage into errors of ours, and keep its warnings from the terminal.

    Raises:
        MeshError: something of the stage cannot be read.
    """
    pxr = library()
    heard = pxr.UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    except (pxr.Tf.ErrorException, pxr.Tf.CppException) as error:
        raise MeshError(_problem(path, error)) from None
    except UnicodeDecodeError:
        raise MeshError(Problem("holds names or texts that are no UTF-8", str(path))) from None
    finally:
        heard.TakeUncoalescedDiagnostics()


def open_stage(path: Path | str) -> Stage:
    """Open a stage with all its payloads.

    Raises:
        MissingExtraError: the package of the extra `usd` is not installed.
        MeshError: the file or one that it draws in cannot be read, or what it says of its space is wrong.
    """
    path = Path(path)
    check_input(path, MeshError, "a mesh")
    pxr = library()
    with understood(path):
        usd = pxr.Usd.Stage.Open(str(path))
    faults = list(dict.fromkeys(_one_line(str(error)) for error in usd.GetCompositionErrors()))
    if faults:
        more = [f"and {len(faults) - _LISTED} faults more"] if len(faults) > _LISTED else []
        raise MeshError([Problem(words, str(path)) for words in (*faults[:_LISTED], *more)])
    return _described(path, usd, pxr)


def _described(path: Path, usd: Any, pxr: Any) -> Stage:
    geom = pxr.UsdGeom
    metres, rate = float(geom.GetStageMetersPerUnit(usd)), float(usd.GetTimeCodesPerSecond())
    for value, name in ((metres, "metersPerUnit"), (rate, "timeCodesPerSecond")):
        if not (0 < value < float("inf")):
            raise MeshError(Problem(f"is {value:g} (expected a number greater than 0)", str(path), key=name))
    span = None
    if usd.HasAuthoredTimeCodeRange():
        first, last = float(usd.GetStartTimeCode()), float(usd.GetEndTimeCode())
        if not (abs(first) < float("inf") and first <= last < float("inf")):
            words = f"is {last:g}, startTimeCode {first:g} (expected a time code that is not before it)"
            raise MeshError(Problem(words, str(path), key="endTimeCode"))
        span = first, last
    notices = []
    if not geom.StageHasAuthoredMetersPerUnit(usd):
        notices.append("does not say its metersPerUnit: taken as centimetres ('units: 100' makes it metres)")
    return Stage(path, usd, metres, geom.GetStageUpAxis(usd) == "Z", rate, span, tuple(notices))


def _problem(path: Path, error: Exception) -> Problem:
    """What the library's error says, without the places in its own sources."""
    try:
        text = str(error)
    except UnicodeDecodeError:
        return Problem("holds names or texts that are no UTF-8", str(path))
    found = re.findall(r"at line \d+ in file \S+ : '(.*?)'\s*(?:Error in|$)", text, re.DOTALL)
    words = _one_line(found[0] if found else text)
    place = re.match(re.escape(str(path)) + r":(\d+):(\d+): ", words)
    line, column = (int(place[1]), int(place[2])) if place else (0, 0)
    reason = words[place.end() :] if place else words
    return Problem(f"is no USD file that can be read: {reason}", str(path), line, column)


def _one_line(text: str) -> str:
    words = " ".join(re.sub(r"pxrInternal\S*?::|, ?@anon:[^@]*@\S*|<0x[0-9a-f]+>", "", text).split())
    return words if len(words) <= _LONGEST else words[: _LONGEST - 1] + "…"


def files_beside(path: Path) -> Iterator[Path]:
    """Other files that a stage draws in: layers, and pictures that it names; nothing where it is broken."""
    try:
        pxr = library()
        stage = open_stage(path)
        with understood(path):
            layers, assets, _ = pxr.UsdUtils.ComputeAllDependencies(str(path))
    except (MeshError, ImportError):
        return
    names = [layer.realPath for layer in (*layers, *stage.usd.GetUsedLayers())] + list(assets)
    own = path.resolve()
    for name in names:
        found = Path(str(name).split("[", 1)[0] if str(name).endswith("]") else str(name))
        if name and found.is_file() and found.resolve() != own:
            yield found
