from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import pytest

from quiltcli.errors import JobError
from quiltcli.formats.yaml import syntax as yamlsyntax
from quiltcli.formats.yaml.source import parse_value, read_yaml


def read(folder: Path, raw: bytes) -> Any:
    (folder / "a.yaml").write_bytes(raw)
    return read_yaml(folder / "a.yaml")[0]


def message(folder: Path, raw: bytes) -> str:
    with pytest.raises(JobError) as caught:
        read(folder, raw)
    return str(caught.value).replace(f"{folder}/", "")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000.0), ("1E-5", 1e-5), (".5e2", 50.0), ("+1.", 1.0), ("-0.5", -0.5),
        ("12", 12), ("-3", -3), ("017", 17), ("0o17", 15), ("0x1F", 31),
        ("true", True), ("FALSE", False), ("~", None), ("", None), ("null", None),
        ("on", "on"), ("off", "off"), ("yes", "yes"), ("no", "no"), ("y", "y"),
        ("1:30", "1:30"), ("2024-01-01", "2024-01-01"), ("1_000", "1_000"), ("e3", "e3"), (".", "."),
        ("'1'", "1"), ("=", "="), ("-.inf", -math.inf), ("1-240", "1-240"), ("1,5", "1,5"), ("!!str 5", "5"),
        ("[1, {a: b}]", [1, {"a": "b"}]),
    ],
)  # fmt: skip
def test_scalars_are_those_of_yaml_1_2(text: str, value: object) -> None:
    found = parse_value(text)
    assert found == value
    assert type(found) is type(value)


def test_nan_is_read_and_judged_later() -> None:
    assert math.isnan(parse_value(".nan"))


def test_merge_and_anchors(tmp_path: Path) -> None:
    raw = b"a: &a {x: 1, z: 4}\nb: {<<: *a, y: 2, x: 3}\nc: *a\nd: {<<: [{x: 5}, *a]}\n"
    assert read(tmp_path, raw) == {
        "a": {"x": 1, "z": 4},
        "b": {"y": 2, "x": 3, "z": 4},
        "c": {"x": 1, "z": 4},
        "d": {"x": 5, "z": 4},
    }


def test_byte_order_mark_and_crlf(tmp_path: Path) -> None:
    assert read(tmp_path, "\ufeffa: 1\r\nb: ä\r\n".encode()) == {"a": 1, "b": "ä"}


_BOMB = b"a0: &a0 [x]\n" + b"".join(
    b"a%d: &a%d [%s]\n" % (n, n, b", ".join([b"*a%d" % (n - 1)] * 10)) for n in range(1, 12)
)


@pytest.mark.parametrize(
    ("raw", "expected"),
    [
        (b"a: \xff", "a.yaml:1:4: not UTF-8 text: byte 0xff at offset 3 (save the file as UTF-8)"),
        (b"a: \xc3\xa4\nb: \xe4",
         "a.yaml:2:4: not UTF-8 text: byte 0xe4 at offset 9 (save the file as UTF-8)"),
        (b"\xff\xfea\x00", "a.yaml:1:1: not UTF-8 text: byte 0xff at offset 0 (save the file as UTF-8)"),
        (b"a: " + b"[" * 100_000, "a.yaml: the values are nested too deeply"),
        (b"- " * 3000, "a.yaml: the values are nested too deeply"),
        (b"a: {b: 1\n", "a.yaml:2:1: not YAML: expected ',' or '}', but got the end of the file"
         " (while parsing a mapping in { } that starts in line 1)"),
        (b"a: 'x' y\n",
         "a.yaml:1:8: this does not fit what stands before it (check the indentation and the quotes)"),
        (b"a:\n  - 1\n  b: 2\n",
         "a.yaml:3:3: this does not fit what stands before it (check the indentation and the quotes)"),
        (b'a: "C:\\scenes\\ball.obj"\n', "a.yaml:1:8: a \\ in double quotes starts an escape"
         " (write the text in single quotes, or a path with /)"),
        (b'a: "\\users"\n', "a.yaml:1:7: a \\ in double quotes starts an escape"
         " (write the text in single quotes, or a path with /)"),
        (b"a: @x\n", "a.yaml:1:4: a value cannot start with '@' (put it in quotes)"),
        (b"a: 1\nb: {<<: 3}\n", "a.yaml:2:9: b: '<<' merges mappings only"),
        (b"a: {x: 1, x: 2}\nb: 1\nb: 2\n", "a.yaml:1:11: a.x: duplicate key (first given in line 1)\n"
         "a.yaml:3:1: b: duplicate key (first given in line 2)"),
    ],
)  # fmt: skip
def test_message(raw: bytes, expected: str, tmp_path: Path) -> None:
    assert message(tmp_path, raw) == expected


@pytest.mark.parametrize("name", ["ball.obj", "ball.GLB", "page.0001.exr", "shot.jpg"])
def test_meshes_and_pictures_are_called_by_their_kind(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(b"v 0 0 0\n\xff")
    with pytest.raises(JobError) as caught:
        read_yaml(path)
    assert str(caught.value) == f"{path}: is a {path.suffix.lower()} file (expected a YAML file)"
    with pytest.raises(JobError, match="no such file"):
        read_yaml(tmp_path / "none.obj")


_MERGES = b"a0: &a0 {x: 1}\n" + b"".join(
    b"a%d: &a%d {k%d: 1, <<: [%s]}\n" % (n, n, n, b", ".join([b"*a%d" % (n - 1)] * 10)) for n in range(1, 12)
)
_FLAT_MERGES = (
    b"base: &b {" + b",".join(b"k%d: 1" % n for n in range(2000)) + b"}\n"
    + b"".join(b"m%d: {<<: *b}\n" % n for n in range(2000))
)  # fmt: skip


@pytest.mark.parametrize("bomb", [_BOMB, _MERGES, _FLAT_MERGES])
def test_aliases_and_merges_do_not_fill_the_memory(tmp_path: Path, bomb: bytes) -> None:
    start = time.process_time()
    found = message(tmp_path, bomb)
    assert found.endswith(": aliases stand for more than 100,000 values (write them out, or use fewer)")
    assert time.process_time() - start < 5


def test_many_values_that_are_written_out_are_no_bomb(tmp_path: Path) -> None:
    assert len(read(tmp_path, b"a: [" + b"1," * 150_000 + b"1]")["a"]) == 150_001


@pytest.mark.parametrize(
    ("raw", "expected"),
    [
        (b"a: " + b"9" * 5000, f"a.yaml:1:4: a: '{'9' * 39}…' has too many digits for a number"),
        (b"a: 0x" + b"f" * 5000, f"a.yaml:1:4: a: '0x{'f' * 37}…' has too many digits for a number"),
    ],
)
def test_numbers_longer_than_any_that_is_meant(raw: bytes, expected: str, tmp_path: Path) -> None:
    assert message(tmp_path, raw) == expected


def test_a_value_typed_by_hand_may_not_nest_without_end() -> None:
    with pytest.raises(JobError, match="nested too deeply"):
        parse_value("[" * 500 + "]" * 500)


def test_missing_file_and_directory(tmp_path: Path) -> None:
    with pytest.raises(JobError, match=r"none\.yaml: no such file$"):
        read_yaml(tmp_path / "none.yaml")
    with pytest.raises(JobError, match=r"is a directory \(a file was expected\)$"):
        read_yaml(tmp_path)


def test_both_readers_agree_on_values_and_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("a: {b: [1, 2e3], ä: 'x'}\nc:\n- d: 1\n  e:\n- |\n  text\nf: !!str 3\n")
    fast_data, fast = read_yaml(path)
    monkeypatch.setattr(yamlsyntax, "_is_deep", lambda text: True)
    slow_data, slow = read_yaml(path)
    assert (fast_data, fast.marks) == (slow_data, slow.marks)


def test_place_is_the_value_and_for_blocks_the_key(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("a:\n  b: 1\n  c:\n  - 5\n")
    source = read_yaml(path)[1]
    places = {
        key: (problem.line, problem.column)
        for key in [("a",), ("a", "b"), ("a", "c"), ("a", "c", 0), ("a", "x", 3), ("y",)]
        for problem in [source.problem(key, "")]
    }
    assert list(places.values()) == [(1, 1), (2, 6), (3, 3), (4, 5), (1, 1), (1, 1)]
    assert source.at("a").problem("b", "", on_key=True).column == 3
    assert source.problem(("a", "c", 0), "").key == "a.c[0]"
