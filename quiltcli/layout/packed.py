"""What a layout was packed from: while that is the same, it need not be packed again."""

from __future__ import annotations

import hashlib

import numpy as np

from quiltcli.display import Facets
from quiltcli.job.digest import wishes_sha256
from quiltcli.job.layout import PackSpec
from quiltcli.layout.layout import Packed


def packed_from(facets: Facets, wishes: PackSpec, places: str) -> Packed:
    """What a layout of facets with this hash of its places is packed from.

    Args:
        facets: the display; its geometry has a hash of its own.
        wishes: what the layout is to be like.
        places: `places_sha256` of the layout.
    """
    digest = hashlib.sha256(np.packbits(facets.enabled).tobytes())
    if facets.places is not None:
        for each in (facets.places.facet, facets.places.page, facets.places.turn, facets.places.corner):
            digest.update(np.ascontiguousarray(each, dtype="<i8").tobytes())
        digest.update(np.packbits(facets.places.mirror).tobytes())
    return Packed(wishes_sha256(wishes), digest.hexdigest(), places)
