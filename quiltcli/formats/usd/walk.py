"""What a stage shows: its meshes with their places and materials, its lights, and what is left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from quiltcli.errors import counted
from quiltcli.formats.usd.lights import is_light
from quiltcli.formats.usd.materials import Material, read_material
from quiltcli.formats.usd.mesh import Asked
from quiltcli.formats.usd.places import Instancer, Place
from quiltcli.formats.usd.shapes import is_shape, shape_mesh
from quiltcli.formats.usd.skins import Skin, read_skins
from quiltcli.formats.usd.stage import Stage, library, path_of

MOST_PRIMS = 2**21
MOST_PLACES = 2**20
SUBDIVIDED = "catmullClark"
_DEEPEST = 16
_PLAIN = ("Xform", "Scope", "SkelRoot", "Skeleton", "SkelAnimation", "BlendShape", "Material", "Shader", "")
_SILENT = (*_PLAIN, "GeomSubset", "NodeGraph", "RenderSettings", "RenderProduct", "RenderVar", "Camera")


@dataclass(frozen=True, eq=False)
class Piece:
    """A mesh prim, or all native instances of one, with the same materials.

    Attributes:
        prim: the first of them.
        places: all of them.
        materials: what its faces are made of; None for a face without a material that is read.
        subsets: those of its faces that have materials of their own, and rows of `materials`.
        skin: what moves its points, or None.
        mesh: its schema, `pxr.UsdGeom.Mesh`; that of another stage for a shape by formula.
        shelf: that stage, which lives as long as somebody holds it.
    """

    prim: Any
    places: tuple[Place, ...]
    materials: tuple[Material | None, ...]
    subsets: tuple[tuple[Any, int], ...]
    skin: Skin | None
    mesh: Any
    shelf: Any

    def asked(self, uv_names: tuple[str, ...]) -> Asked:
        """The primvars that its materials look up, of texture coordinates the first two of these."""
        first, second = (*uv_names, "", "")[:2]
        shown = [one for one in self.materials if one is not None]
        plain = None in self.materials
        color = next((one.color for one in shown if one.color), "displayColor" if plain else "")
        opacity = next((one.opacity for one in shown if one.opacity), "displayOpacity" if plain else "")
        return Asked((first, second), color, opacity)


@dataclass(frozen=True, eq=False)
class Shown:
    """What a stage shows.

    Attributes:
        pieces: its meshes.
        lights: prims of its lights.
        notices: what is left out.
        cages: paths of meshes that are cages of subdivision surfaces.
    """

    pieces: tuple[Piece, ...]
    lights: tuple[Any, ...]
    notices: tuple[str, ...]
    cages: tuple[str, ...]


@dataclass(eq=False)
class _Found:
    """A mesh while its places are gathered."""

    prim: Any
    mesh: Any
    materials: tuple[Material | None, ...]
    subsets: tuple[tuple[Any, int], ...]
    places: list[Place] = field(default_factory=list)


def walk(stage: Stage, time: Any) -> Shown:
    """Look at all prims of a stage.

    Args:
        stage: the stage.
        time: when its materials are read.

    Raises:
        MeshError: there are too many, instancers show themselves, or a material is wrong.
    """
    return _Walk(stage, time).result()


@dataclass(eq=False)
class _Walk:
    """What has been seen so far."""

    stage: Stage
    time: Any
    found: dict[tuple[Any, ...], _Found] = field(default_factory=dict)
    lights: list[Any] = field(default_factory=list)
    materials: dict[str, Material | None] = field(default_factory=dict)
    left: Counter[str] = field(default_factory=Counter)
    foreign: list[str] = field(default_factory=list)
    cages: set[str] = field(default_factory=set)
    foreign_schemes: list[str] = field(default_factory=list)
    shelf: Any = None
    prims: int = 0
    places: int = 0

    def result(self) -> Shown:
        """Everything that is shown."""
        root = self.stage.usd.GetPseudoRoot()
        self._take(root, None, 0)
        skins = read_skins([one.prim for one in self.found.values()])
        pieces = tuple(
            Piece(
                one.prim,
                tuple(one.places),
                one.materials,
                one.subsets,
                skins.get(path_of(one.prim)),
                one.mesh,
                self.shelf,
            )
            for one in self.found.values()
        )
        return Shown(pieces, tuple(self.lights), tuple(self._notices()), tuple(sorted(self.cages)))

    def _take(self, top: Any, within: Instancer | None, depth: int) -> None:
        """All that is shown below a prim, itself included."""
        usd = library().Usd
        prims = iter(usd.PrimRange(top, usd.TraverseInstanceProxies(usd.PrimDefaultPredicate)))
        for prim in prims:
            self.prims += 1
            if self.prims > MOST_PRIMS:
                raise self.stage.error(top, f"shows more than {MOST_PRIMS:,} prims")
            kind = str(prim.GetTypeName())
            if kind == "PointInstancer":
                prims.PruneChildren()
                self._instance(prim, within, depth)
            elif kind == "Mesh" or is_shape(kind):
                self._mesh(prim, within)
            elif is_light(prim):
                if within is None and not _left_out(prim):
                    self.lights.append(prim)
                else:
                    self.left["light of an instancer" if within else "light that is no render purpose"] += 1
            elif kind == "Camera":
                self.left["camera"] += 1
            elif kind not in _SILENT and prim.IsA(library().UsdGeom.Boundable):
                self.left[f"{kind[:40]} prim"] += 1

    def _instance(self, prim: Any, within: Instancer | None, depth: int) -> None:
        """The prototypes of a point instancer."""
        if depth >= _DEEPEST:
            raise self.stage.error(prim, f"is the {depth + 1}th of instancers that show one another")
        if _left_out(prim):
            self.left["prim of purpose proxy or guide"] += 1
            return
        instancer = library().UsdGeom.PointInstancer(prim)
        for row, path in enumerate(instancer.GetPrototypesRel().GetForwardedTargets()):
            root = self.stage.usd.GetPrimAtPath(path)
            if not root:
                words = f"names the prototype {path_of(path)}, which is not there"
                raise self.stage.error(instancer.GetPrototypesRel(), words)
            if prim.GetPath().HasPrefix(path):
                raise self.stage.error(instancer.GetPrototypesRel(), "names what it is part of itself")
            self._take(root, Instancer(prim, row, root, Place(prim, within)), depth + 1)

    def _mesh(self, prim: Any, within: Instancer | None) -> None:
        if _left_out(prim):
            self.left["prim of purpose proxy or guide"] += 1
            return
        self.places += 1
        if self.places > MOST_PLACES:
            raise self.stage.error(prim, f"is one of more than {MOST_PLACES:,} meshes")
        materials, subsets = self._bound(prim)
        same = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        key = (same.GetPath(), *(None if one is None else one.path for one in materials))
        if key not in self.found:
            self.found[key] = _Found(prim, self._schema(prim), materials, subsets)
        self.found[key].places.append(Place(prim, within))

    def _schema(self, prim: Any) -> Any:
        """The mesh of a prim."""
        geom = library().UsdGeom
        if is_shape(str(prim.GetTypeName())):
            if self.shelf is None:
                self.shelf = library().Usd.Stage.CreateInMemory()
            return shape_mesh(self.stage, self.shelf, prim, self.time)
        mesh = geom.Mesh(prim)
        scheme = str(mesh.GetSubdivisionSchemeAttr().Get())
        if scheme == SUBDIVIDED:
            self.cages.add(path_of(prim))
        elif scheme not in ("none", "bilinear"):
            self.foreign_schemes.append(path_of(prim))
        return mesh

    def _bound(self, prim: Any) -> tuple[tuple[Material | None, ...], tuple[tuple[Any, int], ...]]:
        """The materials of a mesh: first of the mesh itself, then of its subsets."""
        api = library().UsdShade.MaterialBindingAPI
        rows = [self._material(prim)]
        subsets = []
        for subset in api(prim).GetMaterialBindSubsets():
            subsets.append((subset, len(rows)))
            rows.append(self._material(subset.GetPrim()))
        return tuple(rows), tuple(subsets)

    def _material(self, prim: Any) -> Material | None:
        shade = library().UsdShade
        material = shade.MaterialBindingAPI(prim).ComputeBoundMaterial(shade.Tokens.full)[0]
        if not material:
            return None
        # Instances share their prototype's materials.
        own = material.GetPrim()
        path = path_of(own.GetPrimInPrototype() if own.IsInstanceProxy() else own)
        if path not in self.materials:
            self.materials[path] = read_material(self.stage, material, self.time)
            if self.materials[path] is None:
                self.foreign.append(path_of(material))
        return self.materials[path]

    def _notices(self) -> Iterator[str]:
        for words, count in sorted(self.left.items()):
            yield f"{counted(count, words)} left out"
        if self.foreign_schemes:
            which = listed(self.foreign_schemes)
            yield f"subdivided by another scheme than {SUBDIVIDED}, drawn as cages: {which}"
        if self.foreign:
            yield f"no UsdPreviewSurface, drawn by displayColor: {listed(self.foreign)}"
        lost: dict[str, list[str]] = {}
        for material in self.materials.values():
            for what in () if material is None else material.notices:
                lost.setdefault(what, []).append(material.path)  # type: ignore[union-attr]
        for what, users in lost.items():
            yield f"{what} is not drawn ({listed(users)})"


def _left_out(prim: Any) -> bool:
    """Whether a prim is no part of a final picture."""
    return library().UsdGeom.Imageable(prim).ComputePurpose() in ("proxy", "guide")


def listed(names: Sequence[str]) -> str:
    """The first names of some, and how many more there are."""
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more
