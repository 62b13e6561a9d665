"""The textures of a scene in one flat piece of memory, and which of them vary what of each material.

A texel is four half floats in one number of 64 bits. Levels lie one behind the other, each with a border
of one texel that goes on as the texture does, so that the four texels around any place have one address:

    ┌──────────────┐   border: repeats, ends or is mirrored
    │ ┌──────────┐ │
    │ │ w × h    │ │   texel (x, y) at first + y·stride + x
    │ └──────────┘ │
    └──────────────┘
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import Problem, SceneError
from quiltcli.formats.capacity import bytes_text
from quiltcli.geometry import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from quiltcli.scene.materials import Texture
from quiltcli.scene.scene import Scene
from quiltcli.scene.textures.heights import normals_of
from quiltcli.scene.textures.levels import Texels, level_sizes, levels_of
from quiltcli.scene.textures.picture import Picture

ROLES = ("color", "emission", "metallic", "roughness", "normal", "occlusion", "opacity", "bump")
"""What textures vary that are drawn; heights (`bump`) are made normals of, and are looked up as these."""
IN_SRGB = ("color", "emission")
"""Roles of textures whose numbers are encoded for displays."""
WRAPS = ("repeat", "clamp", "mirror")
_PERIODS = {"repeat": 1.0, "clamp": 0.0, "mirror": 2.0}
_MEGABYTE = 1_000_000
_LISTED = 3


@dataclass(frozen=True)
class TextureLimits:
    """What textures may take, and how well they are filtered.

    Attributes:
        memory: megabytes.
        largest: texels from side to side; larger pictures are reduced.
        anisotropy: the most places that one pixel looks at.
    """

    memory: float = 4096
    largest: int = 8192
    anisotropy: int = 16


@dataclass(frozen=True)
class Sheet:
    """A picture as texels: the same picture is there once for every way in which it is used."""

    picture: Picture
    srgb: bool
    wrap: tuple[str, str]
    nearest: bool = False
    heights: bool = False
    opaque: bool = False


@dataclass(frozen=True, eq=False)
class Lay:
    """How textures lie on triangles, a row a material; rows without a texture mean nothing else.

    Attributes:
        matrix: (M, 2, 3) u, v of the texture from those of the triangle, both with v down.
        uv_set: (M,) which texture coordinates, 0 or 1.
        period: (M, 2) after how many pictures they come again along u and v; 0 where they do not.
    """

    matrix: FloatArray
    uv_set: Int32Array
    period: FloatArray


@dataclass(frozen=True, eq=False)
class Slot:
    """The textures of one role, a row a material; rows without a texture mean nothing else.

    Attributes:
        image: (M,) row of `Textures.start`, −1 for none; slots of the same pictures share the array.
        channel: (M,) which of red, green, blue and alpha, where the role takes one number.
        gain: (M, 2) base and gain of its values, base + gain · value.
        strength: (M,) scale of a normal map, strength of an occlusion map.
        lay: which of `Textures.lays` says how it lies.
    """

    image: Int32Array
    channel: Int32Array
    gain: Float32Array
    strength: Float32Array
    lay: int


@dataclass(frozen=True, eq=False)
class Textures:
    """All textures of a scene; equal only to itself.

    Attributes:
        texels: (N,) four half floats each.
        first: (L,) address of each level's texel at the upper left.
        stride: (L,) texels from one row of a level to the next.
        width: (L,) texels.
        height: (L,) texels.
        start: (I+1,) first level of each image, the largest.
        wrap: (I, 2) how it goes on along u and v, rows of `WRAPS`.
        slots: by role, those that some material has.
        lays: how they lie; slots whose textures lie alike share one.
        anisotropy: the most places that one pixel looks at.
        nearest: (I,) images whose texels are squares of one colour where they are enlarged; None for none.
    """

    texels: NDArray[np.uint64]
    first: IntArray
    stride: IntArray
    width: Float32Array
    height: Float32Array
    start: Int32Array
    wrap: NDArray[np.int8]
    slots: Mapping[str, Slot]
    lays: tuple[Lay, ...]
    anisotropy: int
    nearest: BoolArray | None = None


def mean_texels(scene: Scene, role: str) -> Float32Array:
    """The mean colour (M, 3) of each material's texture of a role, 1 where it has none."""
    textures = scene.textures
    result = np.ones((len(scene.materials.color), 3), dtype=np.float32)
    if textures is not None and role in textures.slots:
        image = textures.slots[role].image
        rows = np.flatnonzero(image >= 0)
        last = textures.first[textures.start[image[rows] + 1] - 1]
        result[rows] = textures.texels[last].view(np.float16).reshape(-1, 4)[:, :3]
    return result


@dataclass
class TextureStore:
    """Makes the textures of scenes; of several scenes with the same pictures they are the same.

    Attributes:
        limits: what they may take.
    """

    limits: TextureLimits = field(default_factory=TextureLimits)
    _last: tuple[tuple[tuple[Texture, ...], ...], Textures] | None = None

    def of(self, materials: Sequence[tuple[Texture, ...]]) -> Textures | None:
        """The textures of materials, None where none has any that is drawn.

        Raises:
            SceneError: a picture cannot be read, or all of them take more memory than they may.
        """
        key = tuple(materials)
        drawn = [texture for textures in key for texture in textures if texture.role in ROLES]
        if not drawn:
            return None
        if self._last is None or self._last[0] != key:
            self._last = key, _filled(key, drawn, self.limits)
        return self._last[1]


def sheet_of(texture: Texture) -> Sheet:
    """The texels that a texture is looked up in."""
    srgb = texture.role in IN_SRGB and not texture.raw
    heights = texture.role == "bump"
    return Sheet(texture.picture, srgb, texture.wrap, texture.nearest, heights, texture.opaque)


def check_textures(textures: Iterable[Texture], limits: TextureLimits | None = None) -> None:
    """Look at the headers of the pictures.

    Raises:
        SceneError: some cannot be read, each with the material that wants it; or they take too much.
    """
    problems: list[Problem] = []
    sizes: dict[Sheet, list[tuple[int, int]]] = {}
    most = TextureLimits() if limits is None else limits
    for texture in textures:
        if texture.role in ROLES and sheet_of(texture) not in sizes:
            try:
                size = texture.picture.size(texture.use)
            except SceneError as error:
                problems += error.problems
                continue
            sizes[sheet_of(texture)] = level_sizes(size.width, size.height, most.largest)
    if problems:
        raise SceneError(list(dict.fromkeys(problems)))
    if limits is not None:
        _demand(sizes, limits)


def _bytes(sizes: Iterable[tuple[int, int]]) -> int:
    return sum((width + 2) * (height + 2) * 8 for width, height in sizes)


def _demand(sizes: Mapping[Sheet, list[tuple[int, int]]], limits: TextureLimits) -> None:
    """Raise unless all levels fit into the memory that textures may take."""
    needed = sum(_bytes(levels) for levels in sizes.values())
    if needed <= limits.memory * _MEGABYTE:
        return
    largest = sorted(sizes.items(), key=lambda item: -_bytes(item[1]))[:_LISTED]
    names = "; ".join(
        f"{sheet.picture.name}, {levels[0][0]:,} × {levels[0][1]:,} pixels" for sheet, levels in largest
    )
    raise SceneError(
        Problem(
            f"the textures would take {bytes_text(needed)} of memory (expected at most"
            f" {bytes_text(limits.memory * _MEGABYTE)}, render.texture_memory; render.max_texture reduces"
            f" large ones; the largest: {names})"
        )
    )


def _filled(
    materials: Sequence[tuple[Texture, ...]], drawn: Sequence[Texture], limits: TextureLimits
) -> Textures:
    """Read, decode and reduce all pictures."""
    check_textures(drawn, limits)
    first_use: dict[Sheet, Texture] = {}
    for texture in drawn:
        first_use.setdefault(sheet_of(texture), texture)
    sizes = []
    for texture in first_use.values():
        size = texture.picture.size(texture.use)
        sizes.append(level_sizes(size.width, size.height, limits.largest))
    flat = np.array([size for levels in sizes for size in levels], dtype=np.int64)
    width, height = flat.T
    offset = np.cumsum([0, *((width + 2) * (height + 2))])
    texels = np.empty(int(offset[-1]), dtype=np.uint64)
    start = np.cumsum([0, *map(len, sizes)])
    for row, (sheet, texture) in enumerate(first_use.items()):
        _write(texels, offset[start[row] :], sizes[row], sheet, texture)
    rows = {sheet: row for row, sheet in enumerate(first_use)}
    squares = np.array([sheet.nearest for sheet in first_use])
    slots, lays = _slots(materials, rows)
    return Textures(
        texels=texels,
        first=offset[:-1] + (width + 2) + 1,
        stride=width + 2,
        width=width.astype(np.float32),
        height=height.astype(np.float32),
        start=start.astype(np.int32),
        wrap=np.array([[WRAPS.index(w) for w in sheet.wrap] for sheet in first_use], dtype=np.int8),
        slots=slots,
        lays=lays,
        anisotropy=limits.anisotropy,
        nearest=squares if squares.any() else None,
    )


def _write(
    texels: NDArray[np.uint64],
    offset: IntArray,
    sizes: Sequence[tuple[int, int]],
    sheet: Sheet,
    texture: Texture,
) -> None:
    """Write a picture's levels of some sizes into the pool, each with its border."""
    pixels = sheet.picture.pixels(texture.use)
    if sheet.opaque and pixels.shape[2] in (2, 4):
        pixels = pixels[..., :-1]
    if sheet.heights:
        pixels = normals_of(pixels, sheet.wrap)
    srgb = sheet.srgb and pixels.dtype.kind == "u"
    row = 0
    for level in levels_of(pixels, srgb=srgb):
        high, wide = level.shape[:2]
        if (wide, high) != tuple(sizes[row]):
            continue  # larger than any that is kept
        place = slice(int(offset[row]), int(offset[row]) + (wide + 2) * (high + 2))
        _bordered(texels[place].reshape(high + 2, wide + 2), level, sheet.wrap)
        row += 1
        if row == len(sizes):
            return


def _bordered(into: NDArray[np.uint64], level: Texels, wrap: tuple[str, str]) -> None:
    """A level in memory that has room for its border."""
    into[1:-1, 1:-1] = np.ascontiguousarray(level).view(np.uint64)[..., 0]
    around = wrap[0] == "repeat"
    into[1:-1, 0], into[1:-1, -1] = (
        into[1:-1, -2 if around else 1],
        into[1:-1, 1 if around else -2],
    )
    around = wrap[1] == "repeat"
    into[0], into[-1] = into[-2 if around else 1], into[1 if around else -2]


def _slots(
    materials: Sequence[tuple[Texture, ...]], rows: Mapping[Sheet, int]
) -> tuple[dict[str, Slot], tuple[Lay, ...]]:
    """The textures by role, and how they lie; `rows` are those of the sheets."""
    slots: dict[str, Slot] = {}
    lays: list[list[Texture | None]] = []
    for role in ROLES:
        # Of several in one material the last counts, as in the file.
        found = [_last_of(textures, role) for textures in materials]
        if role == "normal":
            found = [own or _last_of(each, "bump") for own, each in zip(found, materials, strict=True)]
        if role == "bump" or not any(found):
            continue
        number = next((k for k, lay in enumerate(lays) if all(map(_lie_alike, found, lay))), len(lays))
        if number == len(lays):
            lays.append(found)
        lays[number] = [old or new for old, new in zip(lays[number], found, strict=True)]
        image = np.array([-1 if t is None else rows[sheet_of(t)] for t in found], dtype=np.int32)
        # Roles of the same pictures share the array, by which they are told to be looked up together.
        same = (s.image for s in slots.values() if s.lay == number and np.array_equal(s.image, image))
        slots[role] = Slot(
            image=next(same, image),
            channel=np.array([0 if t is None else "rgba".find(t.channel or "r") for t in found], np.int32),
            gain=np.array([(0, 1) if t is None else t.gain for t in found], dtype=np.float32),
            strength=np.array([1 if t is None else _strength(t) for t in found], dtype=np.float32),
            lay=number,
        )
    return slots, tuple(map(_lay, lays))


def _strength(texture: Texture) -> float:
    """The factor of a texture; a gain of heights makes slopes steeper."""
    return texture.strength * (texture.gain[1] if texture.role == "bump" else 1.0)


def _last_of(textures: Sequence[Texture], role: str) -> Texture | None:
    return next((texture for texture in reversed(textures) if texture.role == role), None)


def _lie_alike(a: Texture | None, b: Texture | None) -> bool:
    """Whether two textures of one material lie alike; what is not there is not in the way."""
    return a is None or b is None or (a.matrix, a.uv_set, a.wrap) == (b.matrix, b.uv_set, b.wrap)


def _lay(found: Sequence[Texture | None]) -> Lay:
    plain = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    matrices = [plain if t is None else t.matrix for t in found]
    periods = [(0.0, 0.0) if t is None else (_PERIODS[t.wrap[0]], _PERIODS[t.wrap[1]]) for t in found]
    return Lay(
        matrix=np.array(matrices).reshape(-1, 2, 3),
        uv_set=np.array([0 if t is None else t.uv_set for t in found], dtype=np.int32),
        period=np.array(periods),
    )
