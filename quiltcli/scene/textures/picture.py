"""Where a texture's pixels come from: a file of their own, or a place in a glTF file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from numpy.typing import NDArray

from quiltcli.errors import MeshError, Problem, SceneError
from quiltcli.formats.gltf.images import Images
from quiltcli.formats.packages import read_file
from quiltcli.formats.picture_bytes import PictureSize, UnreadablePictureError, picture_pixels, picture_size

T = TypeVar("T")


@dataclass(frozen=True)
class Picture:
    """A picture, read when it is asked for.

    Attributes:
        path: its file, inside of a package if it is in one, or the glTF file it is part of.
        images: the images of that glTF file; None for a file of its own.
        index: of the image in these.
    """

    path: str
    images: Images | None = None
    index: int = 0

    @property
    def name(self) -> str:
        """What to call it."""
        return self.path if self.images is None else f"{self.images.name(self.index)} of {self.path}"

    def size(self, use: str) -> PictureSize:
        """What its header says; `use` says whose picture it is.

        Raises:
            SceneError: it is not there, of no kind that is read, or larger than any that is shown.
        """
        return self._read(picture_size, lambda images: images.header(self.index, use), use)

    def pixels(self, use: str) -> NDArray[Any]:
        """Its pixels (H, W, channels) as they are stored, alpha not multiplied in.

        Raises:
            SceneError: as of `size`, and for a file that is cut off or broken.
        """
        return self._read(picture_pixels, lambda images: images.pixels(self.index, use), use)

    def _read(self, from_bytes: Callable[[bytes], T], from_gltf: Callable[[Images], T], use: str) -> T:
        if self.images is not None:
            try:
                return from_gltf(self.images)
            except MeshError as error:
                raise SceneError(error.problems) from None
        try:
            return from_bytes(read_file(self.path, SceneError, "a picture"))
        except UnreadablePictureError as error:
            raise SceneError(Problem(f"{use}: cannot be read: {error}", self.path)) from None
        except SceneError as error:
            raise SceneError([Problem(f"{use}: {p.message}", p.file) for p in error.problems]) from None
