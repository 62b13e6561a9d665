"""Pictures of films, by their time (extra `video`)."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

from quiltcli.errors import OutputError, Problem
from quiltcli.formats.inputs import check_input
from quiltcli.formats.pictures import linear_light
from quiltcli.formats.video import load_av
from quiltcli.geometry import Float32Array

FILMS = (".mov", ".mp4", ".mkv", ".avi", ".mxf", ".webm", ".m4v")
"""What names of films end in."""
_UNSAID = (0, 2)  # FFmpeg's numbers of "RGB", which some leave there, and "unspecified"
_HIGH = 720  # lines from which a film that does not say is BT.709


def film_picture(path: Path, seconds: float, colorspace: str = "auto") -> Float32Array:
    """The picture (H, W, 4) that a film shows at a time, in linear light; alpha is 1 where it has none.

    Pictures are read one after another, so times should ascend.

    Args:
        path: the film.
        seconds: from its first picture.
        colorspace: a name of `COLORSPACES`; films hold screen values, as `auto` has it.

    Raises:
        OutputError: it cannot be read, or is shorter.
        MissingExtraError: PyAV is not installed.
    """
    check_input(path, OutputError, "a film")
    found = _opened(path, path.stat().st_mtime_ns)
    return linear_light(found.picture(seconds), curved=colorspace != "linear", apart=True)


def film_pictures(path: Path) -> tuple[int, Fraction]:
    """How many pictures a film says it has, 0 where it does not say, and how many it shows a second.

    Raises:
        OutputError: it cannot be read.
        MissingExtraError: PyAV is not installed.
    """
    check_input(path, OutputError, "a film")
    found = _opened(path, path.stat().st_mtime_ns)
    return found.count, found.rate


@lru_cache(maxsize=1)
def _opened(path: Path, changed: int) -> _Film:
    return _Film(path)


class _Film:
    """A film that is being read.

    Attributes:
        count: of its pictures, as it says; 0 where it does not.
        rate: pictures a second.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._av = load_av()
        self._container: Any = None
        self._pictures: Iterator[Any] = iter(())
        self._shown: Any = None
        self._at = -1
        self._rewind()

    def picture(self, seconds: float) -> Any:
        """Numbers (H, W, 4) of 16 bits of the picture at a time."""
        # A hair's breadth beyond: where both have one rate, rounding must not give the picture before.
        wanted = int(Fraction(seconds).limit_denominator(10**6) * self.rate + Fraction(1, 1000))
        if seconds < 0:
            raise self.wrong(f"has nothing at second {seconds:.3f}, before its first picture (frame 1)")
        if wanted < self._at:
            self._rewind()
        try:
            while self._at < wanted:
                self._shown = next(self._pictures)
                self._at += 1
        except StopIteration:
            self._rewind()
            count = f"{self.count} pictures" if self.count else "fewer pictures"
            words = f"has {count} at {float(self.rate):g} a second, and none at second {seconds:.3f}"
            raise self.wrong(words) from None
        except self._av.error.FFmpegError as error:
            raise self.wrong(f"cannot be read: {error.strerror or error}") from None
        return self._numbers(self._shown)

    def wrong(self, words: str) -> OutputError:
        """An error of the file."""
        return OutputError(Problem(words, file=str(self.path)))

    def _rewind(self) -> None:
        if self._container is not None:
            self._container.close()
        try:
            self._container = self._av.open(str(self.path))
        except self._av.error.FFmpegError as error:
            raise self.wrong(f"is no film that can be read: {error.strerror or error}") from None
        if not self._container.streams.video:
            raise self.wrong("holds no pictures")
        stream = self._container.streams.video[0]
        self.rate = Fraction(stream.average_rate or stream.guessed_rate or 0)
        if self.rate <= 0:
            raise self.wrong("does not say how many pictures a second it has")
        self.count = int(stream.frames)
        self._pictures, self._at, self._shown = self._container.decode(stream), -1, None

    def _numbers(self, frame: Any) -> Any:
        """Screen values of a decoded picture: by the matrix and range that it says, else by its size."""
        how = {}
        if not frame.format.is_rgb:
            matrix = "ITU709" if frame.height >= _HIGH else "ITU601"
            how = {"src_colorspace": matrix} if int(frame.colorspace) in _UNSAID else {}
            how["dst_color_range"] = "JPEG"
        return frame.reformat(format="rgba64le", **how).to_ndarray()
