"""A light field that was loaded: its cameras, and which file has the picture of each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from quiltcli.errors import JobError, Problem, first_of
from quiltcli.geometry import Float32Array
from quiltcli.job.lightfield import LightfieldFile
from quiltcli.lightfield.cameras import Cameras, ring_cameras
from quiltcli.lightfield.pictures import Pictures, decoding, read_depth
from quiltcli.lightfield.transforms import read_transforms

_MOST = 12


@dataclass(frozen=True, eq=False)
class Field:
    """A light field.

    Attributes:
        file: what its file says.
        cameras: the cameras.
        files: picture of every view, where a file of poses names them.
        pictures: those that were read.
        curve: (256,) linear light of the bytes of a picture.
        depths: depth maps that were read.
        copied: whether pixels of the nearest view are copied, not blended with their neighbours.
    """

    file: LightfieldFile
    cameras: Cameras
    files: tuple[Path, ...]
    pictures: Pictures
    curve: Float32Array
    depths: Pictures = field(repr=False)
    copied: bool = False

    def picture(self, row: int, view: int, frame: int) -> Path:
        """File of the picture of a view; rows and views from 0."""
        if self.files:
            return self.files[view]
        assert self.file.images is not None
        return self.file.named(self.file.images, row, view, frame)

    def depth(self, row: int, view: int, frame: int) -> Path:
        """File of the depth map of a view."""
        assert self.file.depths is not None
        return self.file.named(self.file.depths, row, view, frame)

    def missing(self, frames: Iterable[int]) -> Iterator[Path]:
        """Pictures and depth maps of frames that there are not."""
        shown = list(frames) if self.file.is_animated else [1]
        for frame in shown:
            for r, row in enumerate(self.cameras.rows):
                for view in row.view.tolist():
                    paths = [self.picture(r, view, frame)]
                    if self.file.focus == "depth":
                        paths.append(self.depth(r, view, frame))
                    yield from (path for path in paths if not path.is_file())


def load_field(file: LightfieldFile, frames: Iterable[int] = (1,)) -> Field:
    """Find the cameras and pictures of a light field.

    Args:
        file: the light field file.
        frames: frames whose pictures have to be there.

    Raises:
        JobError: a picture is missing, or a file of poses has none that can be used.
    """
    transforms = file.camera.transforms
    if transforms is not None:
        posed = read_transforms(transforms, file.camera.up_axis)
        cameras, files = posed.cameras, posed.files
    else:
        cameras, files = ring_cameras(file), ()
    size = cameras.lens.size
    found = Field(file, cameras, files, Pictures(size), decoding(file.encoding), Pictures(size, read_depth))
    gone = [Problem("no such picture of the light field", str(path)) for path in found.missing(frames)]
    if gone:
        raise JobError(first_of(gone, _MOST, str(file.source.path or "")))
    return found
