"""Meshes that skeletons and blend shapes move, by UsdSkel's own queries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from quiltcli.formats.usd.places import Moment
from quiltcli.formats.usd.stage import library, path_of
from quiltcli.geometry import FloatArray


@dataclass(frozen=True, eq=False)
class Skin:
    """What moves the points of a mesh.

    Attributes:
        skeleton: its skeleton's prim.
        skel: query of the skeleton.
        skinning: query of the mesh.
        shapes: query of its blend shapes, or None.
        cache: what keeps the queries alive.
    """

    skeleton: Any
    skel: Any
    skinning: Any
    shapes: Any
    cache: Any

    @property
    def moves(self) -> bool:
        """Whether it may look otherwise at another time."""
        animation = self.skel.GetAnimQuery()
        return bool(animation) and (
            animation.JointTransformsMightBeTimeVarying() or animation.BlendShapeWeightsMightBeTimeVarying()
        )

    def times(self) -> list[float]:
        """Time codes of its animation."""
        animation = self.skel.GetAnimQuery()
        if not animation:
            return []
        return [*animation.GetJointTransformTimeSamples(), *animation.GetBlendShapeWeightTimeSamples()]


def read_skins(prims: list[Any]) -> dict[str, Skin]:
    """The skins of mesh prims by their paths."""
    pxr = library()
    roots = {path_of(root.GetPrim()): root for prim in prims if (root := pxr.UsdSkel.Root.Find(prim))}
    found: dict[str, Skin] = {}
    for root in roots.values():
        cache = pxr.UsdSkel.Cache()
        predicate = pxr.Usd.TraverseInstanceProxies(pxr.Usd.PrimDefaultPredicate)
        cache.Populate(root, predicate)
        for binding in cache.ComputeSkelBindings(root, predicate):
            skeleton = binding.GetSkeleton()
            skel = cache.GetSkelQuery(skeleton)
            for skinning in binding.GetSkinningTargets():
                prim = skinning.GetPrim()
                shapes = None
                if skinning.HasBlendShapes():
                    shapes = pxr.UsdSkel.BlendShapeQuery(pxr.UsdSkel.BindingAPI(prim))
                found[path_of(prim)] = Skin(skeleton.GetPrim(), skel, skinning, shapes, cache)
    return found


def skinned(prim: Any, skin: Skin, moment: Moment, points: FloatArray) -> FloatArray:
    """Points (V, 3) of a mesh moved by its blend shapes and joints, in the mesh's own space.

    Raises:
        MeshError: the skin does not fit the mesh.
    """
    pxr, stage = library(), moment.stage
    moved = pxr.Vt.Vec3fArray.FromNumpy(points.astype(np.float32))
    if skin.shapes is not None:
        _deform(prim, skin, moment, moved)
    if not skin.skinning.HasJointInfluences():
        return np.asarray(moved, dtype=np.float64).reshape(-1, 3)
    joints = skin.skel.ComputeSkinningTransforms(moment.time)
    if joints is None:
        raise stage.error(skin.skeleton, "has no transforms that its joints could be moved by")
    if skin.skinning.IsRigidlyDeformed():
        rows = np.asarray(skin.skinning.ComputeSkinnedTransform(joints, moment.time), dtype=np.float64)
        carried = np.asarray(moved, dtype=np.float64).reshape(-1, 3) @ rows[:3, :3] + rows[3, :3]
    else:
        if not skin.skinning.ComputeSkinnedPoints(joints, moved, moment.time):
            raise stage.error(
                prim, "has joint indices and weights that fit neither its points nor its joints"
            )
        carried = np.asarray(moved, dtype=np.float64).reshape(-1, 3)
    # They are in the skeleton's space, wherever the mesh is.
    try:
        back = np.linalg.solve(moment.world(prim), moment.world(skin.skeleton))
    except np.linalg.LinAlgError:
        raise stage.error(prim, "has a skin, and a place that flattens it") from None
    result: FloatArray = carried @ back[:3, :3].T + back[:3, 3]
    return result


def _deform(prim: Any, skin: Skin, moment: Moment, moved: Any) -> None:
    """Add the blend shapes to points, in place."""
    animation, mapper = skin.skel.GetAnimQuery(), skin.skinning.GetBlendShapeMapper()
    weights = animation.ComputeBlendShapeWeights(moment.time) if animation else None
    if weights is None or not mapper:
        return
    own = mapper.Remap(weights)
    sub = None if own is None else skin.shapes.ComputeSubShapeWeights(own)
    if not sub or not skin.shapes.ComputeDeformedPoints(
        *sub,
        skin.shapes.ComputeBlendShapePointIndices(),
        skin.shapes.ComputeSubShapePointOffsets(),
        moved,
    ):
        raise moment.stage.error(prim, "has blend shapes that do not fit its points")
