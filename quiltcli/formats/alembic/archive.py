"""Opening Alembic archives, and what they show."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from quiltcli.errors import MeshError, Problem, counted, missing_extra
from quiltcli.formats.inputs import check_input

MOST_OBJECTS = 2**20
_DEEPEST = 1000
_KINDS = {
    "ICurves": "curves",
    "IPoints": "points",
    "INuPatch": "NURBS patch",
    "ICamera": "camera",
    "ILight": "light",
}


@dataclass(frozen=True, eq=False)
class Piece:
    """A mesh of an archive.

    Attributes:
        object: its object, of `alembic3d.Abc`.
        schema: its schema.
        xforms: schemas of the transforms above it, the outermost first.
        above: objects from the top to itself.
        materials: names of its sets of faces, the row of each one more than its number; row 0 is no set.
    """

    object: Any
    schema: Any
    xforms: tuple[Any, ...]
    above: tuple[Any, ...]
    materials: tuple[str, ...]

    @property
    def path(self) -> str:
        """Its path in the archive."""
        return str(self.object.getFullName())


@dataclass(frozen=True, eq=False)
class Archive:
    """An open archive.

    Attributes:
        path: its file as the user named it.
        pieces: its meshes.
        range: seconds of the first and the last sample; None where there is only one.
        notices: what is left out.
        opened: what keeps it open.
    """

    path: Path
    pieces: tuple[Piece, ...]
    range: tuple[float, float] | None
    notices: tuple[str, ...]
    opened: Any

    def error(self, piece: Piece, message: str) -> MeshError:
        """An error of a mesh."""
        return MeshError(Problem(message, str(self.path), key=piece.path))


def library() -> Any:
    """The package `alembic3d`.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import alembic3d
    except ImportError:
        raise missing_extra("An Alembic file", "alembic3d", "alembic") from None
    return alembic3d


def open_archive(path: Path | str) -> Archive:
    """Open an archive and look at all its objects.

    Raises:
        MissingExtraError: the package of the extra `alembic` is not installed.
        MeshError: the file is no archive that is read, or holds too much.
    """
    path = Path(path)
    check_input(path, MeshError, "a mesh")
    abc = library()
    try:
        opened = abc.Abc.IArchive(str(path))
        found = _Walk(path)
        found.take(opened.getTop())
        first, last = abc.Abc.GetArchiveStartAndEndTime(opened)
    except RuntimeError as error:
        words = f"is no Alembic file that can be read: {' '.join(str(error).split())[:200]}"
        advice = " (Ogawa archives are read, of HDF5 ones none)"
        raise MeshError(Problem(words + advice, str(path))) from None
    span = (float(first), float(last)) if first < last < float("inf") else None
    return Archive(path, tuple(found.pieces), span, tuple(found.notices()), opened)


@dataclass
class _Walk:
    """What has been seen so far."""

    path: Path
    pieces: list[Piece] = field(default_factory=list)
    left: Counter[str] = field(default_factory=Counter)
    cages: list[str] = field(default_factory=list)
    objects: int = 0

    def take(self, top: Any) -> None:
        """All objects below one, without recursion, in the order of the file."""
        waiting: list[tuple[Any, tuple[Any, ...], tuple[Any, ...]]] = [(top, (), ())]
        while waiting:
            one, xforms, above = waiting.pop()
            self.objects += 1
            if self.objects > MOST_OBJECTS:
                raise MeshError(Problem(f"shows more than {MOST_OBJECTS:,} objects", str(self.path)))
            if len(above) > _DEEPEST:
                raise MeshError(Problem(f"has objects more than {_DEEPEST} deep", str(self.path)))
            chain = (*above, one)
            xforms = self._object(one, xforms, chain) if above else xforms
            children = [one.getChild(number) for number in range(one.getNumChildren())]
            waiting += [(child, xforms, chain) for child in reversed(children)]

    def _object(self, one: Any, xforms: tuple[Any, ...], above: tuple[Any, ...]) -> tuple[Any, ...]:
        """Take one object; the transforms of what is below it."""
        geom, existing = library().AbcGeom, library().Abc.WrapExistingFlag.kWrapExisting
        header = one.getHeader()
        if geom.IXform.matches(header):
            return (*xforms, geom.IXform(one, existing).getSchema())
        for kind in (geom.IPolyMesh, geom.ISubD):
            if kind.matches(header):
                schema = kind(one, existing).getSchema()
                names = tuple(str(name) for name in schema.getFaceSetNames())
                self.pieces.append(Piece(one, schema, xforms, above, names))
                if kind is geom.ISubD:
                    self.cages.append(str(one.getFullName()))
                return xforms
        for name, words in _KINDS.items():
            if getattr(geom, name).matches(header):
                self.left[words] += 1
        return xforms

    def notices(self) -> Iterator[str]:
        """What is left out."""
        for words, count in sorted(self.left.items()):
            yield (
                f"{count:,} {words} left out" if words.endswith("s") else f"{counted(count, words)} left out"
            )
        if self.cages:
            more = f" and {len(self.cages) - 3} more" if len(self.cages) > 3 else ""
            yield f"{', '.join(self.cages[:3])}{more} subdivided: the polygons of the cage are drawn"
