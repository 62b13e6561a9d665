"""File names: what an image holds, and of which view, is in its name; the frame number comes last."""

from __future__ import annotations

import glob
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from quiltcli.display import load_display
from quiltcli.errors import OutputError, Problem, QuiltError
from quiltcli.formats.inputs import is_regular
from quiltcli.formats.yaml.source import parse_yaml
from quiltcli.job import JobFile, load_display_file
from quiltcli.job.names import FACET, PAGE, NamesSpec, Template, read_template

_NAME = re.compile(
    r"(?P<kind>[A-Za-z]+)_(?P<number>\d{1,9})(?:\.(?P<eye>left|right))?\.(?P<frame>-?\d{4,9})\.exr"
)
_PLAIN = re.compile(r"[A-Za-z_][\w-]*")
_NUMBERED = re.compile(r"facet_\d+", re.IGNORECASE)


@dataclass(frozen=True)
class ImageName:
    """What the name of a file says.

    Attributes:
        kind: `page` or `facet`; of other programs' files, the word before the number.
        number: the page or facet id, from 1.
        frame: frame number.
        eye: `left` or `right`, empty where there is one eye.
    """

    kind: str
    number: int
    frame: int
    eye: str = ""


@dataclass(frozen=True)
class Names:
    """How the images of a job are called.

    Attributes:
        page_name, facet_name: templates, as `output.names` of a job has them.
        facets: names of the facets that are fit for files, by id from 1; none where no template asks.
    """

    page_name: str = PAGE
    facet_name: str = FACET
    facets: tuple[str, ...] = ()

    def page(self, out: Path, page: int, frame: int, eye: str = "") -> Path:
        """The file of a quilt's page (1-based) in a frame, for an eye where there are two."""
        return Path(out) / self._templates["page"].filled({"page": page, "frame": frame, "eye": eye})

    def facet(self, out: Path, facet_id: int, frame: int, eye: str = "") -> Path:
        """The file of a facet's image (1-based id) in a frame, for an eye where there are two."""
        name = self.facets[facet_id - 1] if self.facets else ""
        values: dict[str, int | str] = {"facet": facet_id, "name": name, "frame": frame, "eye": eye}
        return Path(out) / self._templates["facet"].filled(values)

    def found(self, out: Path) -> Iterator[tuple[ImageName, Path]]:
        """Every image in a folder, with what its name says: pages, then facets, each by their names."""
        for kind, template in self._templates.items():
            stars = "".join(glob.escape(p) if isinstance(p, str) else "*" for p in template.parts)
            for path in sorted(Path(out).glob(re.sub(r"\*+", "*", stars))):
                if name := self._read(kind, template, path.relative_to(out).as_posix()):
                    yield name, path

    def _read(self, kind: str, template: Template, text: str) -> ImageName | None:
        values = template.values_in(text)
        if values is None:
            return None
        number = values.get(kind, 1)
        if kind == "facet" and "name" in values:
            named = self._ids.get(str(values["name"]))
            if named is None or values.get("facet", named) != named:
                return None
            number = named
        return ImageName(kind, int(number), int(values["frame"]), str(values["eye"]))

    @cached_property
    def _templates(self) -> dict[str, Template]:
        texts = {"page": self.page_name, "facet": self.facet_name}
        return {kind: read_template(text, kind) for kind, text in texts.items()}

    @cached_property
    def _ids(self) -> dict[str, int]:
        return {name: facet for facet, name in enumerate(self.facets, 1)}


USUAL = Names()


def quilt_path(out: Path, page: int, frame: int, eye: str = "") -> Path:
    """As `Names.page`, where a job says nothing of names."""
    return USUAL.page(out, page, frame, eye)


def facet_path(out: Path, facet_id: int, frame: int, eye: str = "") -> Path:
    """As `Names.facet`, where a job says nothing of names."""
    return USUAL.facet(out, facet_id, frame, eye)


def frame_digits(frame: int) -> str:
    """A frame number as it ends a file name: a sign if negative, then four digits or more."""
    return f"{'-' if frame < 0 else ''}{abs(frame):04d}"


def layout_path(out: Path) -> Path:
    """The layout that was used."""
    return Path(out) / "layout.yaml"


def fit_names(names: Sequence[str]) -> tuple[str, ...]:
    """A name for every facet: its own where that is fit for a file and single, else `facet_0001`."""
    count = Counter(name.lower() for name in names)
    return tuple(
        name
        if _PLAIN.fullmatch(name) and not _NUMBERED.fullmatch(name) and count[name.lower()] == 1
        else f"facet_{facet:04}"
        for facet, name in enumerate(names, 1)
    )


def names_of(job: JobFile, facet_names: Sequence[str]) -> Names:
    """How a job calls its images, on a display whose facets have these names (empty for none)."""
    return Names(job.output.names.page, job.output.names.facet, fit_names(facet_names))


def names_problems(job: JobFile, pages: int, facets: int) -> Iterator[Problem]:
    """Names that several images would share, of so many pages and facets."""
    spec = job.output.names
    page, facet = read_template(spec.page, "page"), read_template(spec.facet, "facet")
    if job.output.quilts and pages > 1 and "page" not in page.fields:
        yield _shared(spec, "page", f"lacks {{page:02}}: {pages} pages would have one name")
    if job.output.facets and facets > 1 and not facet.fields & {"facet", "name"}:
        yield _shared(spec, "facet", f"lacks {{facet:04}} or {{name}}: {facets} facets would have one name")
    if job.output.quilts and job.output.facets and _alike(spec.page) == _alike(spec.facet):
        yield _shared(spec, "facet", "is the name of a page, too: an image would be written over another")


def _alike(text: str) -> str:
    """A template with no difference between what may come to the same text."""
    return re.sub(r"\{(page|facet|name)[^}]*\}", "*", text).lower()


def _shared(spec: NamesSpec, kind: str, words: str) -> Problem:
    return spec.source.problem(kind, words)


def names_in(out: Path) -> Names:
    """How the images in a render's folder are called, by the job.yaml that it has left there.

    Raises:
        OutputError: names of facets are asked for, and the display that has them cannot be read any more.
    """
    path = Path(out) / "job.yaml"
    if not is_regular(path):
        return USUAL
    try:
        data = parse_yaml(path).data
        names = data["output"]["names"]
        page, facet = str(names["page"]), str(names["facet"])
        for text, kind in ((page, "page"), (facet, "facet")):
            read_template(text, kind)
    except (QuiltError, KeyError, TypeError, ValueError):
        return USUAL  # an earlier version's, or somebody else's
    if "name" not in read_template(facet, "facet").fields:
        return Names(page, facet)
    try:
        names = _display_names(path, data)
    except (QuiltError, KeyError) as error:
        words = "names images by names of facets, and its display cannot be read"
        raise OutputError(Problem(f"{words}: {error}", file=str(path))) from None
    return Names(page, facet, names)


def facet_names_in(out: Path) -> tuple[str, ...]:
    """Names of the facets whose images a render has left in a folder; none where nothing tells."""
    path = Path(out) / "job.yaml"
    try:
        return _display_names(path, parse_yaml(path).data)
    except (QuiltError, KeyError):
        return ()


def _display_names(path: Path, data: Mapping[str, Any]) -> tuple[str, ...]:
    """Names fit for files of the display that a job names."""
    display = load_display(load_display_file(path.parent / str(data["display"])))
    return fit_names(display.names)


def name_of(path: Path) -> ImageName | None:
    """What the name of a file made by `quilt_path` or `facet_path` says; None of any other."""
    match = _NAME.fullmatch(path.name)
    if not match:
        return None
    return ImageName(match["kind"], int(match["number"]), int(match["frame"]), match["eye"] or "")
