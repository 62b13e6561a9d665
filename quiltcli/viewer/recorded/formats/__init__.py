"""The formats that takes come in. A row of `FORMATS` and a module are all that a new one needs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from quiltcli.errors import ViewerError
from quiltcli.job import RecordedSpec
from quiltcli.viewer.recorded.formats.arkit import read_arkit
from quiltcli.viewer.recorded.formats.chan import has_frames, read_chan, read_touchdesigner
from quiltcli.viewer.recorded.formats.freed import read_freed
from quiltcli.viewer.recorded.formats.gltf import read_gltf
from quiltcli.viewer.recorded.formats.hfcs import read_hfcs
from quiltcli.viewer.recorded.formats.motive import is_motive, read_motive
from quiltcli.viewer.recorded.formats.opentrack import read_opentrack
from quiltcli.viewer.recorded.formats.own import read_own
from quiltcli.viewer.recorded.formats.trc import read_trc
from quiltcli.viewer.recorded.formats.tum import read_tum
from quiltcli.viewer.recorded.formats.usd import read_usd
from quiltcli.viewer.recorded.formats.vicon import is_vicon, read_vicon
from quiltcli.viewer.recorded.take import Recording

FORMATS: dict[str, Callable[[RecordedSpec], Recording]] = {
    "csv": read_own,
    "tum": read_tum,
    "motive": read_motive,
    "vicon": read_vicon,
    "trc": read_trc,
    "opentrack": read_opentrack,
    "freed": read_freed,
    "chan": read_chan,
    "touchdesigner": read_touchdesigner,
    "arkit": read_arkit,
    "hfcs": read_hfcs,
    "gltf": read_gltf,
    "usd": read_usd,
}
_NAMELESS = ("csv", "tum", "chan", "touchdesigner", "arkit")
_BY_SUFFIX = {
    ".trc": "trc",
    ".hfcs": "hfcs",
    ".bren": "arkit",
    ".json": "arkit",
    ".tum": "tum",
    **dict.fromkeys((".freed", ".d1", ".pcap"), "freed"),
    **dict.fromkeys((".gltf", ".glb"), "gltf"),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), "usd"),
}
_LOOKED_AT = 65536


def read_recording(spec: RecordedSpec) -> Recording:
    """What the file of a take holds, by its format.

    Raises:
        ViewerError, JobError: the file cannot be read, or its format is not told.
    """
    kind = spec.format if spec.format != "auto" else _format_of(spec)
    if spec.subject is not None and kind in _NAMELESS:
        words = f"{spec.file} holds one head, which has no name (leave subject out)"
        raise ViewerError(spec.source.problem("subject", words))
    return FORMATS[kind](spec)


def _format_of(spec: RecordedSpec) -> str:
    """The format of a file, by its suffix or its first lines."""
    kind = _BY_SUFFIX.get(spec.file.suffix.lower()) or _format_of_text(spec, _beginning(spec.file))
    if kind is None:
        words = f"the format of {spec.file} is not plain from its name and first lines (state format)"
        raise ViewerError(spec.source.problem("format", words))
    return kind


def _beginning(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(_LOOKED_AT)


def _format_of_text(spec: RecordedSpec, data: bytes) -> str | None:
    """The format of a text by its first lines; of bytes, by what they begin with."""
    if data[:1] == b"\xd1" or data[:4] in (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4"):
        return "freed"
    text = data.decode("utf-8-sig", "replace")
    lines = text.splitlines()[:60]
    if spec.file.suffix.lower() == ".chan":
        if spec.columns is not None:
            return "touchdesigner"
        return "chan" if has_frames(lines) else None
    if is_motive(lines):
        return "motive"
    if is_vicon(lines):
        return "vicon"
    good = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if good and good[0].lower().startswith(("dt,rawtx", "dt;rawtx")):
        return "opentrack"
    plain = bool(good) and not set(good[0]) & {",", ";", "\t"} and len(good[0].split()) == 8
    if plain and spec.columns is None and not good[0][:1].isalpha():
        return "tum"
    return "csv" if spec.file.suffix.lower() in (".csv", ".txt", ".tsv") else None
