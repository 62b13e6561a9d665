"""The pictures of a file: their bytes, their sizes and their pixels, each only when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from numpy.typing import NDArray

from quiltcli.formats.gltf.accessors import Accessors
from quiltcli.formats.gltf.container import Container
from quiltcli.formats.gltf.json_values import Json
from quiltcli.formats.picture_bytes import PictureSize, UnreadablePictureError, picture_pixels, picture_size

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Images:
    """The images of a file, by their index."""

    container: Container
    accessors: Accessors

    def name(self, index: int) -> str:
        """What to call an image: its file, its name, or its number."""
        entry = self._entry(index)
        uri = entry["uri"].text("")
        if uri and not uri.startswith("data:"):
            return repr(uri if len(uri) <= 80 else uri[:79] + "…")
        return repr(entry["name"].text()) if entry["name"] else f"image {index}"

    def data(self, index: int) -> bytes:
        """The bytes of an image as they are stored.

        Raises:
            MeshError: they are not there.
        """
        entry = self._entry(index)
        if entry["uri"]:
            return self.container.resource(entry["uri"])
        if not entry["bufferView"]:
            raise entry.expected("a uri or a bufferView")
        return bytes(self.accessors.view(entry["bufferView"]))

    def header(self, index: int, use: str = "") -> PictureSize:
        """What the header of an image says.

        Args:
            index: of the image.
            use: whose picture it is, to say so in errors.

        Raises:
            MeshError: it is not there, of no kind that is read, or larger than any that is shown.
        """
        return self._read(picture_size, index, use)

    def size(self, index: int, use: str = "") -> tuple[int, int]:
        """Width and height of an image, as `header`."""
        found = self.header(index, use)
        return found.width, found.height

    def pixels(self, index: int, use: str = "") -> NDArray[Any]:
        """The pixels (H, W, channels) of an image as they are stored, alpha not multiplied in.

        Raises:
            MeshError: as of `header`, and for a file that is cut off or broken.
        """
        return self._read(picture_pixels, index, use)

    def _read(self, read: Callable[[bytes], T], index: int, use: str) -> T:
        try:
            return read(self.data(index))
        except UnreadablePictureError as error:
            start = f"{use}: " if use else ""
            words = f"{start}{self.name(index)} cannot be read: {error}"
            raise self._entry(index).error(words) from None

    def _entry(self, index: int) -> Json:
        return self.container.json["images"].at(index)
