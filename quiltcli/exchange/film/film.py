"""Images of a render as films and numbered pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeAlias

from numpy.typing import NDArray

from quiltcli.analysis.simulate import PictureOptions, simulate
from quiltcli.errors import JobError, OutputError, Problem, missing_extra, raise_all
from quiltcli.exchange.film.reels import Reel, reels_of
from quiltcli.formats.hap import hap_film
from quiltcli.formats.stills import write_still
from quiltcli.formats.video import CODECS, film
from quiltcli.formats.whole import make_folder
from quiltcli.images.grade import Grade, graded
from quiltcli.images.names import frame_digits
from quiltcli.job import load_job
from quiltcli.viewer.view import EYES

Show: TypeAlias = Callable[[int, NDArray[Any]], None]
SUBJECTS = ("pages", "facets", "simulation")
FILMS = {**{name: f".{coding.container}" for name, coding in CODECS.items()}, "hap": ".mov"}
STILLS = {"png": ".png", "tiff": ".tif", "dpx": ".dpx"}
_BY_SUFFIX = {".mov": "prores", ".mp4": "h264"}


@dataclass(frozen=True)
class FilmOptions:
    """What is made of a render's images.

    Attributes:
        subject: a name of `SUBJECTS`.
        codec: a name of `FILMS` or `STILLS`; None goes by the name.
        frames: the only frames; None for all there are.
        grade: how light becomes values.
        bits: of numbered pictures, 8 or 16; a DPX has 10.
        size: of a simulation, width and height.
        overwrite: replace files that exist.
    """

    subject: str = "pages"
    codec: str | None = None
    frames: Sequence[int] | None = None
    grade: Grade = field(default_factory=Grade)
    bits: int = 8
    size: tuple[int, int] = (1920, 1080)
    overwrite: bool = False


def make_film(
    out: Path, path: Path, options: FilmOptions, say: Callable[[str], None] = lambda words: None
) -> list[Path]:
    """Make films, or folders of numbered pictures, of a render's output folder.

    Args:
        out: the folder.
        path: a film, or a folder: each page or facet and eye has a film there, or a folder of pictures.
        options: what of.
        say: told of every one that is done.

    Returns:
        The films, or the folders of pictures.

    Raises:
        JobError: the options do not go together.
        OutputError: there are no such images, or files cannot be written or are in the way.
        MissingExtraError: PyAV is not installed.
    """
    codec = _codec(path, options.codec)
    options.grade.check()
    if options.subject == "simulation":
        return _simulated(out, path, codec, options, say)
    reels = reels_of(out, options.subject.removesuffix("s"), options.frames)
    targets = [_target(path, codec, reel.name, len(reels)) for reel in reels]
    _refuse(targets, options)
    for reel, target in zip(reels, targets, strict=True):
        with _opened(target, codec, reel.fps, options) as show:
            for frame in reel.frames:
                show(frame, reel.light(frame))
        say(_told(target, reel))
    return targets


def _told(target: Path, reel: Reel) -> str:
    dark = len(reel.frames) - len(reel.files)
    more = f", {dark} of them black, for which there is no image" if dark else ""
    width, height = reel.size
    return f"{target}  {width}×{height}, {len(reel.frames)} frames, {reel.fps} a second{more}"


def _codec(path: Path, codec: str | None) -> str:
    """The codec by its name, or by the film's."""
    if codec is None:
        codec = _BY_SUFFIX.get(path.suffix.lower())
        if codec is None:
            words = "does not say what is wanted (expected a name in .mov or .mp4, or --codec)"
            raise OutputError(Problem(words, file=str(path)))
    suffix = FILMS.get(codec)
    if suffix and path.suffix and path.suffix.lower() != suffix and not path.is_dir():
        raise OutputError(Problem(f"must end in {suffix} for {codec}, or be a folder", file=str(path)))
    return codec


def _target(path: Path, codec: str, name: str, count: int) -> Path:
    """Film or folder of a reel."""
    suffix = FILMS.get(codec)
    if suffix is None:
        return path / name
    if path.suffix.lower() != suffix or path.is_dir():
        return path / f"{name}{suffix}"
    if count > 1:
        words = f"is one film, and there are {count} sequences (expected a folder, and --codec {codec})"
        raise OutputError(Problem(words, file=str(path)))
    return path


def _refuse(targets: Sequence[Path], options: FilmOptions) -> None:
    if not options.overwrite:
        there = [target for target in targets if target.exists()]
        words = "exists already (use --overwrite to replace it)"
        raise_all(OutputError, [Problem(words, file=str(target)) for target in there[:5]])


@contextmanager
def _opened(target: Path, codec: str, fps: Fraction, options: FilmOptions) -> Iterator[Show]:
    """What takes frame numbers and light (H, W, 3)."""
    if codec in STILLS:
        make_folder(target)
        bits = 10 if codec == "dpx" else options.bits

        def still(frame: int, light: NDArray[Any]) -> None:
            name = f"{target.name}.{frame_digits(frame)}{STILLS[codec]}"
            write_still(target / name, graded(light, options.grade, bits), bits)

        yield still
        return
    coding = CODECS.get(codec)
    depth = coding.depth if coding else 8
    opened = film(target, fps, coding) if coding else hap_film(target, fps)
    with opened as show:
        yield lambda _, light: show(graded(light, options.grade, depth))


def _simulated(
    out: Path, path: Path, codec: str, options: FilmOptions, say: Callable[[str], None]
) -> list[Path]:
    """A film of what the viewer sees; of two eyes one each."""
    _demand_av(codec)
    job = load_job(out / "job.yaml")
    if len(job.people) > 1:
        raise JobError("a film of a simulation shows one viewer's picture (expected a job with viewer)")
    frames = list(job.frames if options.frames is None else options.frames)
    eyes = EYES if job.is_stereo else ("",)
    names = [f"simulation.{eye}" if eye else "simulation" for eye in eyes]
    targets = [_target(path, codec, name, len(eyes)) for name in names]
    _refuse(targets, options)
    for eye, target in zip(eyes, targets, strict=True):
        seen = simulate(job, frames, PictureOptions(size=options.size, compare=False, eye=eye))
        with _opened(target, codec, job.fps, options) as show:
            for one in seen:
                show(one.frame, one.picture)
        width, height = options.size
        say(f"{target}  {width}×{height}, {len(frames)} frames, {job.fps} a second")
    return targets


def _demand_av(codec: str) -> None:
    """Say that PyAV is missing before anything is drawn."""
    if codec in FILMS:
        try:
            import av  # noqa: F401
        except ImportError:
            raise missing_extra("a film", "PyAV", "video") from None
