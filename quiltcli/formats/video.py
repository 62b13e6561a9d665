"""Films of pictures: H.264 in an MP4 file, or ProRes in a MOV file for those who edit on.

Colours are those of a screen by BT.709, limited range, and the file says so; a player that is told
nothing guesses by the picture's size. Encoders take even sizes only: an odd picture grows by a black
column or row at the right or bottom.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.errors import OutputError, Problem, missing_extra
from quiltcli.formats.whole import make_folder, whole_file

BT709 = 1
LIMITED = 1


@dataclass(frozen=True)
class Coding:
    """How a film is coded.

    Attributes:
        container: format of the file.
        codec: encoder.
        pixels: layout of the pixels it takes.
        source: layout of the pictures it is given: 8 or 16 bits a channel.
        options: of the encoder.
        container_options: of the file.
        tag: four letters by which players know the codec, where the file's own are not the best.
        least: width and height that the encoder takes at least.
        multiple: of which width and height must be multiples.
    """

    container: str
    codec: str
    pixels: str
    source: str
    options: dict[str, str]
    container_options: dict[str, str]
    tag: str = ""
    least: tuple[int, int] = (2, 2)
    multiple: int = 1

    @property
    def depth(self) -> int:
        """Bits a channel of the pictures that are to be given."""
        return 16 if self.source == "rgb48le" else 8


CODINGS = {
    ".mp4": Coding(
        "mp4", "libx264", "yuv420p", "rgb24", {"crf": "18", "threads": "1"}, {"movflags": "+faststart"}
    ),
    ".mov": Coding("mov", "prores_ks", "yuv422p10le", "rgb48le", {"profile": "3", "vendor": "apl0"}, {}),
}
"""By the ending of the film's name; ProRes is 422 HQ, 10 bits. What H.264 makes of a picture depends on
the number of threads: one is fast enough for pictures that have to be drawn."""


CODECS = {
    "h264": CODINGS[".mp4"],
    "prores": CODINGS[".mov"],
    "h265": Coding(
        "mp4",
        "libx265",
        "yuv420p10le",
        "rgb48le",
        {"crf": "20", "x265-params": "pools=1:frame-threads=1:log-level=error"},
        {"movflags": "+faststart"},
        "hvc1",  # without it Apple's players show nothing
    ),
    "dnxhr": Coding(
        "mov",
        "dnxhd",
        "yuv422p10le",
        "rgb48le",
        {"profile": "dnxhr_hqx", "threads": "1"},
        {},
        least=(256, 120),
    ),
    # FFmpeg's files of other sizes come back as noise.
    "dxv": Coding("mov", "dxv", "rgba", "rgb24", {"threads": "1"}, {}, multiple=16),
}
"""By name; DNxHR is HQX, 10 bits; DXV is Resolume's, of DXT1 without alpha."""


def coding_of(path: Path) -> Coding:
    """The coding that a film's name asks for.

    Raises:
        OutputError: its ending is none of `CODINGS`.
        MissingExtraError: PyAV is not installed.
    """
    coding = CODINGS.get(path.suffix.lower())
    if coding is None:
        wrong = "a film's name must end in .mp4 (H.264) or .mov (ProRes)"
        raise OutputError(Problem(wrong, file=str(path)))
    load_av()
    return coding


def load_av() -> Any:
    """PyAV (MissingExtraError where it is not installed)."""
    try:
        import av
    except ImportError:
        raise missing_extra("a film", "PyAV", "video") from None
    return av


Frame = NDArray[np.uint8] | NDArray[np.uint16]


@contextmanager
def film(path: Path, fps: Fraction, coding: Coding | None = None) -> Iterator[Callable[[Frame], None]]:
    """Write a film, whole or not at all; yields what takes its pictures one after another.

    A picture is (H, W, 3) display values, uint8 or uint16 as `Coding.depth` has it, all of one size.

    Args:
        path: the film; the folder is made.
        fps: pictures a second.
        coding: of the film; what its name asks for by default.

    Raises:
        OutputError: the film cannot be written, or its name says of no coding; nothing is left behind.
        MissingExtraError: PyAV is not installed.
    """
    coding, av = coding or coding_of(path), load_av()
    make_folder(path.parent)
    with whole_file(path) as temporary:
        try:
            with av.open(
                str(temporary), "w", format=coding.container, container_options=dict(coding.container_options)
            ) as container:
                stream = container.add_stream(coding.codec, rate=fps, options=dict(coding.options))

                def show(picture: Frame) -> None:
                    if picture.shape[1] < coding.least[0] or picture.shape[0] < coding.least[1]:
                        width, height = coding.least
                        words = f"{coding.codec} takes pictures of {width}×{height} pixels or more"
                        raise OutputError(Problem(words, file=str(path)))
                    if picture.shape[1] % coding.multiple or picture.shape[0] % coding.multiple:
                        found = f"{picture.shape[1]}×{picture.shape[0]}"
                        words = f"{coding.codec} takes width and height in multiples of {coding.multiple}"
                        raise OutputError(Problem(f"{words}, and this is {found} pixels", file=str(path)))
                    container.mux(_encoded(av, stream, coding, picture))

                yield show
                container.mux(stream.encode())
        except av.error.FFmpegError as error:
            words = f"cannot be written: {error.strerror or error}"
            raise OutputError(Problem(words, file=str(path))) from error


def _encoded(av: Any, stream: Any, coding: Coding, picture: Frame) -> Any:
    """Packets of one more picture; the first one sets the film's size."""
    even = np.pad(picture, ((0, picture.shape[0] % 2), (0, picture.shape[1] % 2), (0, 0)))
    codec = stream.codec_context
    if not codec.is_open:
        stream.height, stream.width = even.shape[:2]
        stream.pix_fmt = coding.pixels
        if coding.tag:
            codec.codec_tag = coding.tag
        codec.color_primaries = codec.color_trc = codec.colorspace = BT709
        codec.color_range = LIMITED
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format=coding.source)
    return stream.encode(
        frame.reformat(format=coding.pixels, dst_colorspace="ITU709", dst_color_range="MPEG")
    )
