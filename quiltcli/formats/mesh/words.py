"""Words and numbers of a text file, found for the whole file at once.

A file of a million numbers is read by a handful of operations on arrays: where words begin and end,
which words share a statement, and one conversion for all numbers of all statements of a kind.
"""

from __future__ import annotations

import codecs
import re
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import FloatArray, IntArray

_BLANK = 32
_LINE_FEED = 10
_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_COMMENT = re.compile(rb"#[^\n]*")
_JOINED = re.compile(rb"\\[ \t]*\n")


def plain_text(data: bytes) -> bytes:
    """The text in UTF-8 without a byte order mark, lines ending in line feeds.

    UTF-16 and UTF-32 are told by their marks, and UTF-16 without one by its zero bytes; characters
    that cannot be decoded become replacement characters.
    """
    for mark, encoding in _BOMS:
        if data.startswith(mark):
            data = data[len(mark) :] if encoding == "utf-8" else _recoded(data, encoding)
            break
    else:
        zeros = [data[k:64:2].count(0) for k in (0, 1)]
        if max(zeros) > 16 and not min(zeros):
            data = _recoded(data, "utf-16-be" if zeros[0] else "utf-16-le")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data


def _recoded(data: bytes, encoding: str) -> bytes:
    return data.decode(encoding, errors="replace").encode("utf-8")


def blanked(data: bytes, *, joins: bool = False) -> bytes:
    """The text with every comment (from `#` to the end of the line) blank, as long as before.

    With `joins`, a backslash at the end of a line makes one statement of it and the next.
    """
    comments = b"#" in data
    if not comments and not (joins and b"\\" in data):
        return data
    text = bytearray(data)
    for found in _COMMENT.finditer(data) if comments else ():
        text[found.start() : found.end()] = b" " * (found.end() - found.start())
    for found in _JOINED.finditer(bytes(text)) if joins else ():
        text[found.start() : found.end()] = b" " * (found.end() - found.start())
    return bytes(text)


@dataclass(frozen=True)
class Statements:
    """The statements of a text: its lines, but for the empty ones.

    Attributes:
        text: bytes, comments blank; ends in a line feed.
        line_ends: (L,) bytes at which the lines of the file end, ascending.
        start: (W,) byte at which each word begins.
        end: (W,) byte after each word.
        first: (S+1,) number of each statement's first word, and W.
    """

    text: bytes
    line_ends: IntArray
    start: IntArray
    end: IntArray
    first: IntArray

    @property
    def count(self) -> int:
        """Number of statements, S."""
        return len(self.first) - 1

    @cached_property
    def sizes(self) -> IntArray:
        """Number of words (S,) of each statement."""
        return np.diff(self.first)

    @cached_property
    def letters(self) -> NDArray[np.uint8]:
        """The text as an array."""
        return np.frombuffer(self.text, np.uint8)

    def lines(self, statements: IntArray) -> IntArray:
        """1-based lines on which these statements begin."""
        return 1 + np.searchsorted(self.line_ends, self.start[self.first[statements]])

    def line(self, statement: int) -> int:
        """1-based line on which one statement begins."""
        return int(self.lines(np.array([statement]))[0])

    def word(self, number: int) -> str:
        """One word."""
        return self.text[self.start[number] : self.end[number]].decode("utf-8", errors="replace")

    def words(self, statement: int) -> list[str]:
        """All words of one statement."""
        return [self.word(k) for k in range(self.first[statement], self.first[statement + 1])]

    def led_by(self, keyword: bytes) -> IntArray:
        """Statements whose first word is `keyword`, ascending."""
        start, length, letter = self._leads
        found = np.flatnonzero((length == len(keyword)) & (letter == keyword[0]))
        for place in range(1, len(keyword)):
            found = found[self.letters[start[found] + place] == keyword[place]]
        return found

    @cached_property
    def _leads(self) -> tuple[IntArray, IntArray, NDArray[np.uint8]]:
        """Where the first word (S,) of each statement begins, how long it is, and its first letter."""
        lead = self.first[:-1]
        start = self.start[lead]
        return start, self.end[lead] - start, self.letters[start]

    def spans(self, statements: IntArray, skip: int) -> bytes:
        """The text of these ascending statements without their first `skip` words, joined by blanks.

        Neighbours are cut out as one piece, so the words to skip are blanked first.
        """
        if not len(statements):
            return b""
        text = self.text
        if skip:
            text = self._without(statements, skip)
        breaks = np.flatnonzero(np.diff(statements) != 1) + 1
        heads = statements[np.concatenate(([0], breaks))]
        tails = statements[np.concatenate((breaks - 1, [len(statements) - 1]))]
        begin = self.start[self.first[heads]].tolist()
        end = self.end[self.first[tails + 1] - 1].tolist()
        return b" ".join(text[a:b] for a, b in zip(begin, end, strict=True))

    def _without(self, statements: IntArray, skip: int) -> bytes:
        """The text with the first `skip` words of the statements blank."""
        text = self.letters.copy()
        for rank in range(skip):
            word = self.first[statements] + rank
            start, length = self.start[word], self.end[word] - self.start[word]
            for place in range(int(length.max())):
                text[start[length > place] + place] = _BLANK
        return text.tobytes()


def statements(text: bytes, original: bytes | None = None) -> Statements:
    """Find the words and statements of a text.

    Args:
        text: comments blank, lines joined.
        original: the text of the same length whose lines are counted, if others.
    """
    text += b"\n"
    letters = np.frombuffer(text, np.uint8)
    solid = letters > _BLANK
    edges = np.flatnonzero(solid[1:] != solid[:-1]) + 1
    if solid[0]:
        edges = np.concatenate((np.zeros(1, np.int64), edges))
    start, end = edges[0::2], edges[1::2]
    line_ends = np.flatnonzero(letters == _LINE_FEED)
    # The first word after every line's end; lines without words repeat it.
    first = np.searchsorted(start, np.concatenate((np.zeros(1, np.int64), line_ends)))
    first = first[np.concatenate((first[1:] > first[:-1], [True]))]
    if original is not None:
        line_ends = np.flatnonzero(np.frombuffer(original, np.uint8) == _LINE_FEED)
    return Statements(text, line_ends, start, end, first)


def parsed_floats(text: bytes, count: int) -> FloatArray | None:
    """The `count` numbers (count,) of a text, or None where it holds anything else.

    A number beyond float64 is infinite.
    """
    found = _parsed(text, count, np.float64)
    return None if found is None else found.astype(np.float64, copy=False)


def parsed_integers(text: bytes, count: int) -> IntArray | None:
    """Likewise whole numbers; one beyond int64 becomes the last one there is."""
    found = _parsed(text, count, np.int64)
    return None if found is None else found.astype(np.int64, copy=False)


def _parsed(text: bytes, count: int, kind: type) -> NDArray[Any] | None:
    if not count:
        return np.zeros(0, kind)
    try:
        # Text that is not read to its end is an error of NumPy's, or a warning that is to become one.
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            numbers: NDArray[Any] = np.fromstring(text, dtype=kind, sep=" ")
    except (ValueError, DeprecationWarning):
        return None
    return numbers if len(numbers) == count else None


def float_or_none(word: str) -> float | None:
    """The number a word is, or None."""
    try:
        return None if "_" in word else float(word)
    except ValueError:
        return None


def bad_rows(text: Statements, rows: Iterable[int], skip: int, need: int) -> Iterator[tuple[int, list[str]]]:
    """Statements of which one of the `need` words after the first `skip` is no number, and those words."""
    for row in rows:
        words = text.words(row)[skip : skip + need]
        if any(float_or_none(word) is None for word in words):
            yield row, words
