"""What those who play the images ask of their names and sizes, told before they fail without a word."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from quiltcli.errors import Problem
from quiltcli.images.names import Names, names_of
from quiltcli.job import JobFile
from quiltcli.job.names import read_template
from quiltcli.layout import Layout
from quiltcli.viewer.view import EYES

_LARGEST = 16384
_SPECIAL = re.compile(r"_(region|v|frame|proxy)(?![a-z])", re.IGNORECASE)


@dataclass(frozen=True)
class Delivery:
    """What is delivered.

    Attributes:
        job: the job.
        layout: the job's layout.
        names: how the images are called.
    """

    job: JobFile
    layout: Layout
    names: Names

    @property
    def sizes(self) -> Iterator[tuple[str, int, int]]:
        """Every image: what it is, width and height."""
        if self.job.output.quilts:
            for page, (width, height) in enumerate(self.layout.pages.tolist(), 1):
                yield f"page {page}", width, height
        if self.job.output.facets:
            placed = self.layout.page >= 0
            for facet, size in zip(self.layout.facet[placed], self.layout.size[placed], strict=True):
                yield f"facet {facet}", int(size[0]), int(size[1])

    @property
    def templates(self) -> Iterator[tuple[str, str]]:
        """Kind and template of the names that are written."""
        for kind, wanted in (("page", self.job.output.quilts), ("facet", self.job.output.facets)):
            if wanted:
                yield kind, getattr(self.job.output.names, kind)

    def problem(self, kind: str, words: str) -> Problem:
        """A problem with a template."""
        return self.job.output.names.source.problem(kind, words)


def delivery_problems(
    job: JobFile, facet_names: tuple[str, ...], layout: Layout, target: str
) -> list[Problem]:
    """What keeps a job's images from being played by a system, a name of `TARGETS`."""
    what = Delivery(job, layout, names_of(job, facet_names))
    return [problem for rule in TARGETS[target] for problem in rule(what)]


def _not_too_large(what: Delivery) -> Iterator[Problem]:
    for name, width, height in what.sizes:
        if max(width, height) > _LARGEST:
            words = f"{name} is {width}×{height} pixels, more than {_LARGEST} a side"
            yield what.layout.problem(words)


def _in_fours(sides: str) -> Callable[[Delivery], Iterator[Problem]]:
    def rule(what: Delivery) -> Iterator[Problem]:
        wrong = [
            (name, width, height)
            for name, width, height in what.sizes
            if width % 4 or (sides == "both" and height % 4)
        ]
        for name, width, height in wrong[:10]:
            asked = "width and height" if sides == "both" else "a width"
            words = f"{name} is {width}×{height} pixels, expected {asked} in multiples of 4"
            yield what.layout.problem(words)
        if len(wrong) > 10:
            yield what.layout.problem(f"and {len(wrong) - 10} more sizes that are no multiples of 4")

    return rule


def _plain_words(what: Delivery) -> Iterator[Problem]:
    """Disguise reads these endings itself."""
    for kind, text in what.templates:
        if found := _SPECIAL.search(text):
            yield what.problem(
                kind, f"holds {found[0]!r}, which disguise takes for a word of its own: {text!r}"
            )
    if any("name" in read_template(text, kind).fields for kind, text in what.templates):
        for name in what.names.facets:
            if found := _SPECIAL.search(name):
                words = f"the facet's name {name!r} holds {found[0]!r}, which disguise takes for its own word"
                yield what.problem("facet", words)


def _digits_stay(what: Delivery) -> Iterator[Problem]:
    """A sequence whose numbers grow a digit, or are negative, is two sequences, or none."""
    frames = what.job.frames
    for kind, _ in what.templates:
        path = what.names.page if kind == "page" else what.names.facet
        ends = [re.findall(r"-?\d+", path(what.job.output.directory, 1, f).stem)[-1] for f in frames]
        if any(end.startswith("-") for end in ends):
            yield what.problem(kind, f"frame {frames[0]} is negative (expected frames from 0)")
        elif len({len(end) for end in ends}) > 1:
            words = f"frame numbers grow from {len(ends[0])} to {len(ends[-1])} digits within the sequence"
            yield what.problem(kind, f"{words} (expected {{frame:0{len(ends[-1])}}})")
        elif not 4 <= len(ends[0]) <= 12:
            words = f"frame numbers have {len(ends[0])} digits (expected 4 to 12: {{frame:04}})"
            yield what.problem(kind, words)


def _folder_each(what: Delivery) -> Iterator[Problem]:
    """A folder holds one movie."""
    stereo = what.job.is_stereo and what.job.output.stereo == "files"
    eyes = EYES if stereo else ("",)
    for kind, text in what.templates:
        numbers = range(1, len(what.layout.pages) + 1)
        if kind == "facet":
            numbers = what.layout.facet[what.layout.page >= 0].tolist()
        path = what.names.page if kind == "page" else what.names.facet
        folders = [path(what.job.output.directory, n, 0, eye).parent for n in numbers for eye in eyes]
        if len(set(folders)) < len(folders):
            field = "page:02" if kind == "page" else "name"
            eye = "{eye}/" if stereo else ""
            words = f"several sequences share a folder, {text!r} (expected such as {eye}{{{field}}}/…)"
            yield what.problem(kind, words)


def _one_image(what: Delivery) -> Iterator[Problem]:
    """Eyes as parts of one file are read by few."""
    if what.job.is_stereo and what.job.output.stereo == "parts":
        words = "both eyes are parts of one file, of which players read the first (expected stereo: files)"
        yield what.job.output.source.problem("stereo", words)


def film_problems(codec: str, paths: Sequence[Path], target: str) -> list[Problem]:
    """What keeps films, or folders of numbered pictures, from being played by a system.

    Args:
        codec: how they are coded.
        paths: the films or folders.
        target: a name of `TARGETS`.
    """
    taken, words = FILMS.get(target, ((), ""))
    problems = [Problem(f"--codec {codec}: {words}")] if taken and codec not in taken else []
    if _plain_words in TARGETS[target]:
        for path in paths:
            if found := _SPECIAL.search(path.stem):
                told = f"its name holds {found[0]!r}, which disguise takes for a word of its own"
                problems.append(Problem(told, file=str(path)))
    return problems


FILMS: dict[str, tuple[tuple[str, ...], str]] = {
    "disguise": (
        ("hap", "dxv", "prores", "dnxhr", "png", "tiff", "dpx"),
        "disguise plays films whose frames stand alone (expected hap, dxv, prores, dnxhr or pictures)",
    ),
    "7thsense": (("dpx",), "7thSense plays sequences (expected dpx, or the EXR pages as they are)"),
    "hap": (("hap",), "is no HAP (expected hap)"),
}
"""Codecs of films and pictures by system, as far as it cares, and what is said of others."""

TARGETS: dict[str, tuple[Callable[[Delivery], Iterator[Problem]], ...]] = {
    "disguise": (_not_too_large, _plain_words, _one_image),
    "7thsense": (_digits_stay, _folder_each, _in_fours("width"), _one_image),
    "resolume": (_not_too_large, _in_fours("both"), _one_image),
    "hap": (_not_too_large, _in_fours("both")),
}
"""Rules by system: what disguise and 7thSense write of theirs; blocks of HAP and DXV are of 4 × 4 pixels."""
