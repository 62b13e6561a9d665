"""Ways to spoil an input that keep most of its structure, so that the damage gets past the first check."""

# ruff: noqa: E501 - tables are easier to read unbroken

from __future__ import annotations

import json
import random
import re
import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import yaml

NUMBERS = (
    "0", "-0", "1", "-1", "2", "3", "0.5", "1e-9", "-1e-9", "1e-300", "1e300", "-1e300", "1e400", "1e30", "1e9", "1e18",
    "255", "256", "32767", "32768", "65535", "65536", "1000000", "2147483647", "2147483648", "-2147483649",
    "4294967296", "9223372036854775807", "9223372036854775808", "99999999999999999999999", "nan", "inf", "-inf",
    ".nan", ".inf", "1_000", "0x10", "1e", "--1", "1.2.3", "1,5", "" , "1" * 400, "1" * 5000, "٣", "1/0", "1/3",
)  # fmt: skip
WORDS = (
    "", "x", "null", "true", "[]", "{}", "~", "\0", "\x1b[31m", "é", "\ufeff", "\u2028", "\ud83d\ude00".encode("utf-16", "surrogatepass").decode("utf-16"),
    "x" * 300, "x" * 5000, "../" * 50, "/dev/zero", "/dev/stdin", "con", ".", "..", "/", "a" * 255 + ".obj", "=1+1", "%s%n", "{0}",
    "display.yaml", "job.yaml", "scene.yaml", "layout.yaml", "walls.obj", "m.gltf", "b.glb", "m.ply", "track.csv", "pipe",
    "rows", "auto", "net", "nest", "raycast", "offaxis", "radial", "tight", "skip", "none", "dwaa", "1-1000000", "1-4x0", "-5--1",
)  # fmt: skip
_NUMBER = re.compile(rb"(?<![A-Za-z_])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
VALUES: tuple[Any, ...] = (
    *(
        0,
        1,
        -1,
        2,
        7,
        0.5,
        1e-9,
        1e-300,
        1e300,
        1e30,
        1e9,
        2**31,
        2**31 - 1,
        2**32,
        2**63,
        2**64,
        10**25,
        -(2**31),
    ),
    *(
        float("nan"),
        float("inf"),
        -float("inf"),
        True,
        False,
        None,
        "",
        "x",
        [],
        {},
        [[]],
        [0, 0, 0],
        [1, 2],
        [1e9] * 3,
    ),
    *(
        [1e-12] * 3,
        {"x": 1},
        [None],
        ["x"],
        "1e5",
        "0x10",
        [0] * 1000,
        90,
        45,
        4096,
        65536,
        1000000,
        1e-6,
        "1-100",
    ),
)


def mutated(path: Path, how: str, rng: random.Random) -> None:
    """Spoil a file in place."""
    data = path.read_bytes()
    changes = 1 if rng.random() < 0.6 else rng.randint(2, 4)
    for _ in range(changes):
        data = _WAYS[how](data, rng)
    path.write_bytes(data)


def setting(rng: random.Random, job: str) -> str:
    """A `--set` of some key of a job."""
    data = yaml.safe_load(job)
    place = rng.choice(list(_places(data)))
    key = ".".join(map(str, place))
    if rng.random() < 0.2:
        key = rng.choice(
            (key + ".x", "x." + key, key + "[0]", key + "[-1]", key + "[99999999999]", "." + key, key * 50)
        )
    value: str = rng.choice(
        (json.dumps(rng.choice(VALUES)), rng.choice(NUMBERS), rng.choice(WORDS), "[" * 300, "*a", "&a [*a]")
    )
    return f"{key}={value}".replace("\0", "\\0")  # no argument of a process can hold one


def _places(data: Any, above: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Paths of all values in plain data."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield (*above, key)
        yield from _places(value, (*above, key))


def _tree(data: Any, rng: random.Random) -> Any:
    """Plain data with something replaced, removed, added or moved."""
    places = list(_places(data))
    if not places:
        return rng.choice(VALUES)
    *above, last = rng.choice(places)
    holder = data
    for key in above:
        holder = holder[key]
    what = rng.randrange(8)
    if what == 0:
        del holder[last]
    elif what == 1 and isinstance(holder, dict):
        holder[rng.choice(WORDS) if rng.random() < 0.5 else str(last) + "s"] = holder[last]
    elif what == 2 and isinstance(holder, list):
        holder.append(holder[last])
    elif what == 3:
        holder[last] = [holder[last]] * rng.choice((1, 2, 3, 100))
    elif what == 4 and isinstance(holder[last], (int, float)):
        holder[last] = holder[last] * rng.choice((-1, 1e-6, 1e6, 1e12, 0, 3, 1.5))
    elif what == 5:
        holder[last] = rng.choice(WORDS)
    else:
        holder[last] = rng.choice(VALUES)
    return data


def _yaml(data: bytes, rng: random.Random) -> bytes:
    try:
        tree = yaml.safe_load(data.decode())
        if rng.random() < 0.1 or not isinstance(tree, dict):
            return _text(data, rng)
        return yaml.safe_dump(_tree(tree, rng), sort_keys=False, allow_unicode=True).encode(
            "utf-8", "surrogatepass"
        )
    except (yaml.YAMLError, ValueError, RecursionError):
        return _text(data, rng)


def _json(data: bytes, rng: random.Random) -> bytes:
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError):
        return _text(data, rng)
    return json.dumps(_tree(tree, rng)).encode()


def _text(data: bytes, rng: random.Random) -> bytes:
    """Text with a number, word or line changed."""
    what = rng.randrange(7)
    numbers = list(_NUMBER.finditer(data))
    if what < 3 and numbers:
        at = rng.choice(numbers)
        return data[: at.start()] + rng.choice(NUMBERS).encode() + data[at.end() :]
    lines = data.split(b"\n")
    line = rng.randrange(len(lines))
    if what == 3:
        lines[line : line + 1] = [lines[line]] * rng.choice((0, 2, 2, 1000))
    elif what == 4:
        other = rng.randrange(len(lines))
        lines[line], lines[other] = lines[other], lines[line]
    elif what == 5:
        words = lines[line].split(b" ")
        words[rng.randrange(len(words))] = rng.choice(WORDS).encode("utf-8", "surrogatepass")
        lines[line] = b" ".join(words)
    else:
        return _bytes(data, rng)
    return b"\n".join(lines)


def _bytes(data: bytes, rng: random.Random) -> bytes:
    """Bytes flipped, cut out, doubled, or replaced by numbers at the edge of a type."""
    if not data:
        return bytes([rng.randrange(256)])
    at = rng.randrange(len(data))
    what = rng.randrange(6)
    if what == 0:
        return data[:at]
    if what == 1:
        return data[:at] + data[at + rng.randint(1, 64) :]
    if what == 2:
        return data[:at] + data[at : at + rng.randint(1, 64)] + data[at:]
    if what == 3:
        edge = rng.choice((0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF))
        return data[:at] + struct.pack("<I", edge) + data[at + 4 :]
    if what == 4:
        return (
            data[:at]
            + struct.pack("<f", rng.choice((float("nan"), float("inf"), 1e38, 0.0, -1e-38)))
            + data[at + 4 :]
        )
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def _exr(data: bytes, rng: random.Random) -> bytes:
    """The header of an EXR image, mostly: an attribute's size, value or name."""
    names = list(re.finditer(rb"([\w:]+)\0(\w+)\0", data[:1500]))
    if not names or rng.random() < 0.3:
        return _bytes(data, rng)
    at = rng.choice(names)
    what = rng.randrange(4)
    if what == 0:  # a name or a type
        start, end = at.span(rng.choice((1, 2)))
        place = rng.randrange(start, end)
        return data[:place] + bytes([rng.choice((0xFF, 0x41, 0x80, 0))]) + data[place + 1 :]
    if what == 1:  # the size of the value
        return (
            data[: at.end()]
            + struct.pack("<i", rng.choice((-1, 0, 1, 3, 4, 2**31 - 1)))
            + data[at.end() + 4 :]
        )
    place = at.end() + 4 + rng.choice((0, 0, 4, 8, 12))
    edge = rng.choice((0, 1, 0xFF, 0xFFFF, 99999, 2**30, 2**31 - 1, 2**31, 2**32 - 1, 0x7FC00000))
    return data[:place] + struct.pack("<I", edge) + data[place + 4 :]


def _zip(data: bytes, rng: random.Random) -> bytes:
    """An archive with one of its members spoilt, by the way that suits the member."""
    import io

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except Exception:  # spoilt already, in a way of its own
        return _bytes(data, rng)
    if not members or rng.random() < 0.1:
        return _bytes(data, rng)
    name = rng.choice(sorted(members))
    if rng.random() < 0.1:
        del members[name]
    elif name.endswith(".json"):
        members[name] = _json(members[name], rng)
    else:
        members[name] = (_text if rng.random() < 0.7 else _bytes)(members[name], rng)
    packed = io.BytesIO()
    kind = rng.choice((zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2))
    with zipfile.ZipFile(packed, "w", kind) as archive:
        for member, content in members.items():
            archive.writestr(member, content)
    return packed.getvalue()


_WAYS: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "yaml": _yaml,
    "json": _json,
    "text": _text,
    "bytes": _bytes,
    "exr": _exr,
    "zip": _zip,
}
