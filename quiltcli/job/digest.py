"""The hash of all that makes a job's pixels, so that a finished frame can be told from a stale one."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from quiltcli.formats.gltf.container import files_beside
from quiltcli.formats.mesh.mtl import read_mtl
from quiltcli.formats.noted import note_digest, note_input, noted_digest
from quiltcli.formats.usd import SUFFIXES
from quiltcli.job.dump import plain
from quiltcli.job.job import JobFile
from quiltcli.job.layout import PackSpec
from quiltcli.job.layout_table import places_sha256, read_layout_table
from quiltcli.job.load import load_any_display, load_lightfield_file, load_scene_file
from quiltcli.job.model import YAMLS

_HEAD = 1 << 16  # bytes of a PLY file that hold its header
_PACKING = {"net": 2}
"""Raised from 1 where a method comes to another layout than before from the same wishes."""


def job_sha256(job: JobFile) -> str:
    """Hash of what makes the pixels of a job's frames, hexadecimal.

    Files count by their contents, not by their names: a moved folder keeps its hash and an edited
    mesh changes it. A layout counts by how it was packed, whether the job says that or names the file
    that came of it; a layout that was not packed, or changed since, counts by its places. Which frames
    are rendered, where to, whether as quilts or facet images, and what becomes of facets that are not
    lit, makes no difference to any pixel and is left out. Within `noting_inputs` files count as they were
    read, whatever they are by now.
    """
    data = plain(job, file_sha256)
    data["display"] = _display(job.display)
    data["scene"] = _scene(job.scene) if job.lightfield is None else _lightfield(job.scene, job.frames)
    if isinstance(job.layout, Path):
        data["layout"] = _layout_sha256(job.layout)
    elif isinstance(job.layout, PackSpec):
        data["layout"] = wishes_sha256(job.layout)
    if job.render.scale == 1:
        del data["render"]["scale"]  # what there was before there was this key
    else:
        data["layout"] = "packed anew"
    if job.render.corrections:
        del data["render"]["corrections"]  # likewise
    del data["frames"], data["render"]["texture_memory"]
    data["output"] = {key: data["output"][key] for key in ("channels", "compression", "data_window")}
    return _text_sha256(data)


def wishes_sha256(wishes: PackSpec) -> str:
    """Hash of how to pack, hexadecimal; facets that are to stay count by the places their file gives them."""
    data = {**plain(wishes, str), "packing": _PACKING.get(wishes.method, 1)}
    if wishes.pins is not None:
        data["pins"] = places_sha256(read_layout_table(wishes.pins))
    return _text_sha256(data)


def _layout_sha256(path: Path) -> str:
    """What counts of a layout file: how it was packed, or where its facets lie if that was changed since."""
    table = read_layout_table(path)
    packed, places = table.head.packed, places_sha256(table)
    return packed.wishes_sha256 if packed is not None and packed.places_sha256 == places else places


def _text_sha256(data: Any) -> str:
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _display(path: Path) -> dict[str, Any]:
    """A display, with the display that is its screen."""
    display = load_any_display(path)
    data: dict[str, Any] = plain(display, file_sha256)
    screen = getattr(display, "screen", None)
    return data if screen is None else data | {"screen": plain(load_any_display(screen), file_sha256)}


def _scene(path: Path) -> dict[str, Any]:
    """A scene with the hashes of its meshes, of every file of a sequence."""
    scene = load_scene_file(path)
    data: dict[str, Any] = plain(scene, file_sha256)
    for item, entry in zip(scene.objects, data["objects"], strict=True):
        if item.sequence is not None:
            entry["mesh"] = [file_sha256(file) for _, file in item.sequence.files()]
    return data


def _lightfield(path: Path, frames: Sequence[int]) -> dict[str, Any]:
    """A light field with the hashes of its pictures."""
    file = load_lightfield_file(path)
    data: dict[str, Any] = plain(file, file_sha256)
    data["pictures"] = [file_sha256(picture) for picture in file.pictures(frames)]
    return data


def file_sha256(path: Path) -> str:
    """Hash of a file's bytes and of the files it draws in (materials, buffers, pictures)."""
    if path.suffix.lower() in YAMLS or not path.is_file():
        return ""
    total = hashlib.sha256()
    for part in (path, *sorted(set(_drawn_in(path)))):
        digest = _sha256(part) if part.is_file() else b""
        total.update(digest)
    return total.hexdigest()


def _sha256(path: Path) -> bytes:
    """Hash of a file: as it was read, or else as it is now."""
    digest = noted_digest(path)
    if digest is None:
        with path.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        note_digest(path, digest)
    return bytes.fromhex(digest)


def _bytes(path: Path) -> bytes:
    data = path.read_bytes()
    note_input(path, data)
    return data


def _drawn_in(path: Path) -> Iterator[Path]:
    """Files that a mesh file names."""
    suffix = path.suffix.lower()
    if suffix in (".gltf", ".glb"):
        yield from files_beside(path)
    if suffix in SUFFIXES:
        from quiltcli.formats.usd.stage import files_beside as files_of_stage

        yield from files_of_stage(path)
    if suffix == ".obj":
        for name in _named(path, rb"mtllib"):
            yield path.parent / name
            if (path.parent / name).is_file():
                materials = read_mtl(_bytes(path.parent / name), path.parent)
                yield from (texture.path for found in materials.values() for texture in found.textures)
    if suffix == ".ply":
        yield from (path.parent / name for name in _named(path, rb"comment[ \t]+TextureFile", most=_HEAD))


def _named(path: Path, words: bytes, most: int | None = None) -> Iterator[str]:
    """What stands behind words at the start of lines, among the first `most` bytes; and its last word."""
    for match in re.finditer(
        rb"^[ \t]*(?:" + words + rb")[ \t]+(.*?)[ \t\r]*$", _bytes(path)[:most], re.MULTILINE
    ):
        text = match[1].decode("utf-8", "replace")
        yield from dict.fromkeys((text, text.split()[-1])) if text.split() else ()
