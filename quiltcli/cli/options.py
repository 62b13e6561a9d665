"""Options that several commands have, and values that the library reads from text."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from quiltcli.errors import JobError

PATH = click.Path(path_type=Path)


def refuse_typed(why: str, names: Iterable[str] = (), *, but: Iterable[str] | None = None) -> None:
    """Refuse options of the running command that were typed and would do nothing.

    Args:
        why: when they mean nothing, such as `on a ring of viewers`.
        names: the parameters that do nothing.
        but: instead of `names`, the only ones that do something.

    Raises:
        click.UsageError: some were typed.
    """
    context = click.get_current_context()
    idle = set(names) if but is None else {str(param.name) for param in context.command.params} - set(but)
    typed = [
        max(param.opts, key=len)
        for param in context.command.params
        if param.name in idle and context.get_parameter_source(param.name) is ParameterSource.COMMANDLINE
    ]
    if typed:
        raise click.UsageError(f"{', '.join(typed)}: {'mean' if len(typed) > 1 else 'means'} nothing {why}")


class Parsed(click.ParamType):  # type: ignore[type-arg] # generic only in some versions of click
    """A value that a function of the library reads from text."""

    def __init__(self, name: str, read: Callable[[str], Any]) -> None:
        self.name = name
        self.read = read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The value, or a usage error with the library's own words."""
        if not isinstance(value, str):
            return value
        try:
            return self.read(value)
        except ValueError as error:
            return self.fail(str(error), param, ctx)


class Words(click.ParamType):  # type: ignore[type-arg] # generic only in some versions of click
    """A word that the library judges, and that shells complete."""

    name = "text"

    def __init__(self, known: Callable[[], Iterable[str]]) -> None:
        self.known = known

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """The known words that begin so."""
        return [CompletionItem(word) for word in self.known() if word.startswith(incomplete)]


class FarmFrames(Parsed):
    """Frames, in whose text a colon is a step for farms that mean that by it (`--progress openjd`)."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """As `Parsed`; the option that says who asks has been read before."""
        if isinstance(value, str) and ctx is not None and ctx.params.get("progress") == "openjd":
            from quiltcli.job.frames import parse_frames

            return Parsed(self.name, lambda text: parse_frames(text, colon=True)).convert(value, param, ctx)
        return super().convert(value, param, ctx)


def _frames(text: str) -> tuple[int, ...]:
    from quiltcli.job.frames import parse_frames

    return parse_frames(text)


def _facets(text: str) -> tuple[int, ...] | str:
    from quiltcli.job.frames import parse_facets

    # Names are known when the display is.
    return text if any(letter.isalpha() for letter in text) else parse_facets(text)


def _positions(text: str) -> tuple[int, ...]:
    from quiltcli.job.frames import parse_frames

    try:
        return parse_frames(text)
    except JobError as error:
        raise JobError(error.problems[0].message.replace("frame", "position")) from None


def _size(text: str) -> tuple[int, int] | None:
    if text == "auto":
        return None
    if text.isalnum() and not text[0].isdigit():
        from quiltcli.job.layout import CANVASES

        if text in CANVASES:
            return CANVASES[text]
    width, cross, height = text.lower().partition("x")
    sides = [
        int(side) if side.isascii() and side.isdigit() and len(side) < 8 else 0 for side in (width, height)
    ]
    if not cross or not all(1 <= side <= 1_000_000 for side in sides):
        raise JobError(f"expected WIDTHxHEIGHT in pixels, such as 8192x8192, or auto, got {text!r}")
    return sides[0], sides[1]


def _aspect(text: str) -> Any:
    from quiltcli.job.layout import read_aspect

    return read_aspect(text)


def _point(text: str) -> tuple[float, ...]:
    try:
        point = tuple(map(float, text.split(",")))
    except ValueError:
        point = ()
    if len(point) != 3 or not all(abs(value) < float("inf") for value in point):
        raise JobError(f"expected a point in metres, such as 0,1.6,2.5, got {text!r}")
    return point


def _numbers(text: str, count: int, what: str) -> tuple[float, ...]:
    try:
        found = tuple(map(float, text.split(",")))
    except ValueError:
        found = ()
    if len(found) != count or not all(abs(value) < float("inf") for value in found):
        raise JobError(f"expected {what}, got {text!r}")
    return found


def _pair(text: str) -> tuple[float, ...]:
    return _numbers(text, 2, "two numbers, such as 0.02,0")


def _eye(text: str) -> str | tuple[float, ...]:
    if text in ("left", "right"):
        return text
    return _numbers(text, 3, "left, right, or an azimuth, height and distance such as 40,0.4,1")


def _area(text: str) -> tuple[float, ...]:
    try:
        area = tuple(map(float, text.split(",")))
    except ValueError:
        area = ()
    if len(area) != 4 or not all(abs(value) < float("inf") for value in area):
        raise JobError(f"expected an area x0,z0,x1,z1 in metres, such as -2,1,2,4, got {text!r}")
    return area


def _packing_methods() -> Iterable[str]:
    from quiltcli.job.layout import PACKING_METHODS

    return PACKING_METHODS


def _render_methods() -> Iterable[str]:
    from quiltcli.job.job import METHODS

    return METHODS


def _map_formats() -> Iterable[str]:
    from quiltcli.exchange.pixelmaps import FORMATS

    return FORMATS


def _patterns() -> Iterable[str]:
    from quiltcli.calibration.pattern import KINDS, MARKERS

    return (*KINDS, MARKERS, "all")


def _job_keys() -> Iterable[str]:
    from quiltcli.job.reference import keys

    return (f"{path}=" for path, _ in keys("quilt_job") if "[]" not in path)


FRAMES = FarmFrames("frames", _frames)
FACETS = Parsed("facets", _facets)
POSITIONS = Parsed("positions", _positions)
SIZE = Parsed("size", _size)
ASPECT = Parsed("aspect", _aspect)
POINT = Parsed("point", _point)
PAIR = Parsed("pair", _pair)
EYE = Parsed("eye", _eye)
AREA = Parsed("area", _area)
PACKING_METHOD = Words(_packing_methods)
RENDER_METHOD = Words(_render_methods)
MAP_FORMAT = Words(_map_formats)
PATTERN = Words(_patterns)
VIEW = click.Choice(("aces", "srgb"))
STILL_VIEW = click.Choice(("aces", "srgb", "raw"))
THREADS = click.option("-j", "--threads", type=click.IntRange(min=1), help="Threads; every core by default.")
SETS = click.option(
    "--set",
    "sets",
    type=Words(_job_keys),
    metavar="KEY=VALUE",
    multiple=True,
    help="Set a value of the job, by dotted path.",
)
OVERWRITE = click.option("--overwrite", is_flag=True, help="Replace images that exist.")
COLORSPACE = click.option(
    "--colorspace",
    type=click.Choice(("auto", "srgb", "linear")),
    default="auto",
    show_default=True,
    help="What numbers of pictures mean; auto takes whole numbers for sRGB, floats for light.",
)
EXPOSURE = click.option("--exposure", type=float, default=0.0, show_default=True, help="Stops brighter.")


def frames_option(words: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The option `-f`, which is `--frames` and `--frame`."""
    return click.option("-f", "--frames", "--frame", "frames", type=FRAMES, help=words)
