"""Wavefront MTL: what materials are made of, and the images they name.

Statements follow the Wavefront "MTL material format" of 1995, with the PBR statements that came later
(`Pr`, `Pm`, `norm`, `map_Pr`, `map_Pm`, `map_Ke`). Colours are taken as written: whoever draws them
decides what space they are in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from quiltcli.formats.mesh.words import float_or_none, plain_text

Triple = tuple[float, float, float]

ROLES = {
    "map_kd": "color",
    "map_ke": "emission",
    "map_ks": "specular",
    "map_ns": "shininess",
    "map_d": "opacity",
    "map_pr": "roughness",
    "map_pm": "metallic",
    "norm": "normal",
    "map_bump": "bump",
    "bump": "bump",
    "disp": "displacement",
}
"""Statements that name an image, and what the image varies."""

# Options of those statements and how many words at most follow; `-s 2 b.png` has fewer.
_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-boost": 1, "-mm": 2, "-o": 3, "-s": 3, "-t": 3, "-texres": 1,
    "-clamp": 1, "-bm": 1, "-imfchan": 1, "-type": 1, "-cc": 1, "-colorspace": 1,
}  # fmt: skip
_NUMERIC = ("-boost", "-mm", "-o", "-s", "-t", "-texres", "-bm")


@dataclass(frozen=True)
class MeshTexture:
    """An image that a material names.

    Attributes:
        role: what it varies: a value of `ROLES`.
        name: the file name as written.
        path: where it should be, beside the material file unless the name says otherwise.
        offset: added to texture coordinates (u, v, w).
        scale: multiplies texture coordinates first.
        clamp: whether coordinates are held to 0…1 instead of repeating.
        strength: multiplies a bump.
        gain: base and gain: values become base + gain · value.
        channel: r, g, b, m (matte), l (luminance), z (depth), or empty.
        statement: what names it, as the file spells that.
    """

    role: str
    name: str
    path: Path
    offset: Triple = (0.0, 0.0, 0.0)
    scale: Triple = (1.0, 1.0, 1.0)
    clamp: bool = False
    strength: float = 1.0
    gain: tuple[float, float] = (0.0, 1.0)
    channel: str = ""
    statement: str = field(default="", compare=False)


@dataclass(frozen=True)
class MeshMaterial:
    """A material by its name; what its file does not say is None.

    Attributes:
        name: as faces name it.
        color: Kd.
        emission: Ke.
        specular: Ks.
        shininess: Ns, Blinn's exponent.
        opacity: d, or 1 − Tr.
        roughness: Pr.
        metallic: Pm.
        illumination: illum, the number of the old lighting models.
        textures: the images it names, in the order of the file.
        defined: whether a material file defines it.
    """

    name: str
    color: Triple | None = None
    emission: Triple | None = None
    specular: Triple | None = None
    shininess: float | None = None
    opacity: float | None = None
    roughness: float | None = None
    metallic: float | None = None
    illumination: int | None = None
    textures: tuple[MeshTexture, ...] = ()
    defined: bool = True


@dataclass
class _Library:
    """Materials gathered so far, by name, and the one that statements belong to."""

    folder: Path
    found: dict[str, MeshMaterial] = field(default_factory=dict)
    name: str | None = None

    def change(self, **values: Any) -> None:
        if self.name is not None:
            self.found[self.name] = replace(self.found[self.name], **values)


def read_mtl(data: bytes, folder: Path) -> dict[str, MeshMaterial]:
    """Materials by name from a material file's bytes; `folder` is where its images are looked for.

    Statements that are unknown or make no sense are passed over: a material file is never a reason not
    to show a mesh.
    """
    library = _Library(folder)
    for word, rest in _statements(plain_text(data).decode("utf-8", errors="replace")):
        keyword = word.lower()
        if keyword == "newmtl":
            library.name = rest
            library.found[rest] = MeshMaterial(rest)
        elif keyword in ROLES and library.name is not None:
            texture = _texture(word, rest, folder)
            if texture is not None:
                kept = library.found[library.name].textures
                library.change(textures=(*kept, texture))
        elif keyword in _VALUES:
            library.change(**_VALUES[keyword](_numbers(rest)))
    return library.found


def without_comment(text: str) -> str:
    """A name without a comment: names may hold a `#`, so a comment is one that blanks lead."""
    for place, letter in enumerate(text):
        if letter == "#" and (not place or text[place - 1] in " \t"):
            return text[:place].strip()
    return text.strip()


def material_named(found: Mapping[str, MeshMaterial], name: str) -> MeshMaterial | None:
    """The material of this name; with a comment behind one of both, or another case, if need be."""
    if name in found:
        return found[name]
    for same in (without_comment, lambda text: without_comment(text).lower()):
        for key, material in found.items():
            if same(key) == same(name):
                return material
    return None


def _statements(text: str) -> Iterator[tuple[str, str]]:
    """Yield (keyword, rest of the line)."""
    for line in text.replace("\\\n", " ").split("\n"):
        words = line.split(None, 1)
        if words and not words[0].startswith("#"):
            yield words[0], words[1].strip() if len(words) > 1 else ""


def _numbers(rest: str) -> list[float]:
    """The numbers a statement begins with."""
    found: list[float] = []
    for word in rest.split():
        number = float_or_none(word)
        if number is None or number != number or abs(number) == float("inf"):
            break
        found.append(number)
    return found


def _color(key: str) -> Callable[[Sequence[float]], dict[str, Any]]:
    """Three numbers, or one for all three."""

    def values(numbers: Sequence[float]) -> dict[str, Any]:
        if len(numbers) >= 3:
            return {key: (numbers[0], numbers[1], numbers[2])}
        return {key: (numbers[0],) * 3} if numbers else {}

    return values


def _number(key: str, convert: Callable[[float], Any] = float) -> Callable[[Sequence[float]], dict[str, Any]]:
    return lambda numbers: {key: convert(numbers[0])} if numbers else {}


_VALUES = {
    "kd": _color("color"),
    "ke": _color("emission"),
    "ks": _color("specular"),
    "ns": _number("shininess"),
    "d": _number("opacity"),
    "tr": _number("opacity", lambda transparency: 1 - transparency),
    "pr": _number("roughness"),
    "pm": _number("metallic"),
    "illum": _number("illumination", int),
}


def _texture(statement: str, rest: str, folder: Path) -> MeshTexture | None:
    """`[-options] NAME`, the name being all that follows the options, blanks included."""
    given: dict[str, list[str]] = {}
    while True:
        option, _, after = rest.partition(" ")
        if option.lower() not in _OPTIONS:
            break
        given[option.lower()], rest = _option(option.lower(), after.strip())
    name = without_comment(rest)
    if not name:
        return None
    role, options = ROLES[statement.lower()], _options(given)
    return MeshTexture(role, name, place_of(folder, name), statement=statement, **options)


def _option(option: str, rest: str) -> tuple[list[str], str]:
    """The words that belong to an option, and what follows them."""
    taken: list[str] = []
    while len(taken) < _OPTIONS[option]:
        word, _, after = rest.partition(" ")
        # The last word is the name, even where it is a number.
        if not after.strip() or (option in _NUMERIC and float_or_none(word) is None):
            break
        taken.append(word)
        rest = after.strip()
    return taken, rest


def _options(given: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    numbers = {option: [float(word) for word in given.get(option, ())] for option in _NUMERIC}
    if numbers["-o"]:
        result["offset"] = tuple((numbers["-o"] + [0.0] * 3)[:3])
    if numbers["-s"]:
        result["scale"] = tuple((numbers["-s"] + [1.0] * 3)[:3])
    if numbers["-bm"]:
        result["strength"] = numbers["-bm"][0]
    if len(numbers["-mm"]) == 2:
        result["gain"] = tuple(numbers["-mm"])
    if given.get("-clamp"):
        result["clamp"] = given["-clamp"][0].lower() == "on"
    if given.get("-imfchan"):
        result["channel"] = given["-imfchan"][0].lower()
    return result


def place_of(folder: Path, name: str) -> Path:
    """Where an image is: as named, or beside the material file where only its last part is found.

    Files that were made on Windows part folders by backslashes.
    """
    plain = name.strip('"').replace("\\", "/")
    place = folder / plain
    beside = folder / plain.rpartition("/")[2]
    return beside if not is_file(place) and is_file(beside) else place


def is_file(path: Path) -> bool:
    """Whether there is such a file; a name that none can have has none."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, or with a zero byte in it
        return False
