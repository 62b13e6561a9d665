"""The parts a glTF 2.0 file is made of: its JSON text, and the bytes of its buffers and images.

A `.glb` holds the text and one buffer in chunks; other bytes stand beside the file, or in the text
as `data:` URIs. Nothing is fetched: a URI names a file by a relative path.
"""

from __future__ import annotations

import base64
import binascii
import re
import stat
import struct
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

from quiltcli.errors import MeshError, Problem
from quiltcli.formats.gltf.json_values import Json, parse_json
from quiltcli.formats.inputs import read_input
from quiltcli.formats.noted import note_input

_MAGIC = b"glTF"
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_DATA = re.compile(r"data:[^,]*?(;base64)?,", re.IGNORECASE)


@dataclass(eq=False)
class Container:
    """A file's JSON text as a document, and its bytes on demand.

    Attributes:
        path: the file.
        json: the document.
        chunk: the binary chunk of a GLB, None where there is none.
        repeated: keys that stand twice in an object of the text.
    """

    path: Path
    json: Json
    chunk: memoryview | None
    repeated: tuple[str, ...] = ()
    _buffers: dict[int, memoryview] = field(default_factory=dict)

    def buffer(self, index: int) -> memoryview:
        """The bytes of a buffer, read once.

        Raises:
            MeshError: they are not there, or fewer than the file says.
        """
        if index not in self._buffers:
            entry = self.json["buffers"].at(index)
            length = entry["byteLength"].whole()
            if entry["uri"]:
                data = memoryview(self.resource(entry["uri"]))
            elif index == 0 and self.chunk is not None:
                data = self.chunk
            else:
                raise entry["uri"].expected("the name of a file, as there is no binary chunk")
            if len(data) < length:
                raise entry["byteLength"].error(f"{length:,} bytes, but only {len(data):,} are there")
            self._buffers[index] = data[:length]
        return self._buffers[index]

    def view(self, view: Json) -> memoryview:
        """The bytes of a bufferView that is not compressed."""
        buffer = self.buffer(view["buffer"].index(self.json["buffers"].length(), "buffer"))
        first, length = view["byteOffset"].whole(0), view["byteLength"].whole(low=1)
        if first + length > len(buffer):
            raise view.error(f"ends at byte {first + length:,} of a buffer of {len(buffer):,} bytes")
        return buffer[first : first + length]

    def resource(self, uri: Json) -> bytes:
        """The bytes a URI stands for: its own, or those of a file beside this one.

        Raises:
            MeshError: it is no relative path, or the file cannot be read.
        """
        text = uri.text()
        if text[:5].lower() == "data:":
            return _embedded(uri, text)
        path = self.beside(uri)
        try:
            if not stat.S_ISREG(path.stat().st_mode):
                raise uri.error(f"{_short(text)} is not a file")
            data = path.read_bytes()
        except FileNotFoundError:
            raise uri.error(f"{_short(text)} is missing beside it") from None
        except OSError as error:
            raise uri.error(f"{_short(text)} cannot be read: {error.strerror}") from None
        note_input(path, data)
        return data

    def beside(self, uri: Json) -> Path:
        """Path of the file a relative URI names; `%20` in it is a space."""
        text = uri.text()
        if _SCHEME.match(text) or text.startswith(("/", "\\")):
            raise uri.error(f"{_short(text)} is not a path relative to the file (nothing else is read)")
        name = unquote(text)
        if not name or "\0" in name:
            raise uri.error(f"{_short(text)} is no file name")
        path = self.path.parent / name
        # Some programs write names as they are, with a % that starts no code.
        try:
            as_written = self.path.parent / text
            return as_written if not path.is_file() and as_written.is_file() else path
        except OSError as error:
            raise uri.error(f"{_short(text)} cannot be read: {error.strerror}") from None


def files_beside(path: Path) -> list[Path]:
    """The files that the buffers and images of a glTF file lie in; none for a file that cannot be read."""
    try:
        container = _opened(path)
    except MeshError:
        return []
    entries: list[Json] = []
    for kind in ("buffers", "images"):
        with suppress(MeshError):
            entries += container.json[kind].items()
    found = []
    for entry in entries:
        with suppress(MeshError):
            if entry["uri"] and not entry["uri"].text().startswith("data:"):
                found.append(container.beside(entry["uri"]))
    return found


def _embedded(uri: Json, text: str) -> bytes:
    """The bytes of a `data:` URI (RFC 2397)."""
    head = _DATA.match(text)
    if head is None:
        raise uri.error("is a 'data:' URI without a comma")
    if head[1] is None:
        return unquote_to_bytes(text[head.end() :])
    body = text[head.end() :]
    # Padding that is left out does no harm, nor do line breaks.
    body = "".join((unquote(body) if "%" in body else body).split()).rstrip("=")
    try:
        return base64.b64decode(body + "=" * (-len(body) % 4), validate=True)
    except (binascii.Error, ValueError):
        raise uri.error("its base64 text is broken") from None


def _short(text: str) -> str:
    return repr(text if len(text) <= 80 else text[:79] + "…")


def read_container(path: Path) -> Container:
    """Read a `.gltf` or `.glb` file, its buffers not yet.

    Raises:
        MeshError: the file cannot be read, is cut off, is not glTF, or not of version 2.
    """
    container = _opened(path)
    _check_version(container.json)
    return container


def _opened(path: Path) -> Container:
    """The parts of a file of any version."""
    data = read_input(path, MeshError, "a mesh")
    binary = path.suffix.lower() == ".glb"
    if data[:4] == _MAGIC and not binary:
        raise _error(path, "is binary glTF (name it .glb)")
    if data[:4] != _MAGIC and binary:
        is_text = data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{"
        raise _error(
            path, "is glTF as text (name it .gltf)" if is_text else "cannot be read as GLB: it is none"
        )
    text, chunk = _chunks(path, data) if binary else (data, None)
    json, repeated = parse_json(text, str(path))
    return Container(path, json, chunk, repeated)


def _error(path: Path, message: str) -> MeshError:
    return MeshError(Problem(message, str(path)))


def _chunks(path: Path, data: bytes) -> tuple[bytes, memoryview | None]:
    """The JSON text and the binary chunk of a GLB; chunks of other kinds are passed over."""
    damaged = "cannot be read as GLB: the file is damaged or incomplete"
    if len(data) < 20:
        raise _error(path, damaged)
    version, total = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise _error(path, f"is glTF {version} (only glTF 2 is read)")
    if total > len(data):
        raise _error(path, f"{damaged} ({len(data):,} of {total:,} bytes)")
    view = memoryview(data)
    found: dict[int, memoryview] = {}
    at = 12
    while at + 8 <= total:
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > total:
            raise _error(path, f"{damaged} (the chunk at byte {at:,} ends beyond the file)")
        if at == 12 and kind != _JSON:
            raise _error(path, f"{damaged} (its first chunk is not JSON)")
        found.setdefault(kind, view[at + 8 : at + 8 + size])
        at += 8 + size
    if _JSON not in found:
        raise _error(path, f"{damaged} (it holds no chunk)")
    # Some programs fill the text up with zeros where the format wants spaces.
    return bytes(found[_JSON]).rstrip(b"\0"), found.get(_BIN)


def _check_version(json: Json) -> None:
    if not isinstance(json.value, dict):
        raise json.expected("an object")
    version = json["asset"]["version"]
    if not version:
        raise version.error("is missing (only glTF 2 is read, and its files say so)")
    if re.match(r"2\.\d+$", version.text()) is None:
        raise version.error(f"is glTF {version.text()[:20]} (only glTF 2 is read)")
    least = json["asset"]["minVersion"].text("2.0")
    if least not in ("2.0", "2.1"):
        raise json["asset"]["minVersion"].error(f"needs glTF {least[:20]} (glTF 2.0 is read)")
