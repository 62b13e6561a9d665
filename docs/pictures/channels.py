"""Three channels of a facet side by side: the picture, its motion, and its mattes.

python docs/pictures/channels.py FACET.exr -o PICTURE.png
"""

import sys

import numpy as np
from PIL import Image

from quiltcli.images.layers import read_view
from quiltcli.images.preview import tone_map


def colors_of(identity):
    """A colour (H, W, 3) for each identity, as viewers of mattes show them: any that differ."""
    bits = identity.view(np.uint32)
    return np.stack([(bits >> shift & 255) / 255 for shift in (0, 8, 16)], axis=-1) * (bits != 0)[..., None]


def mattes(channels):
    """The identities' colours by their coverage (H, W, 3)."""
    pairs = [
        (f"CryptoObject{k:02d}.{a}", f"CryptoObject{k:02d}.{b}") for k in range(3) for a, b in ("RG", "BA")
    ]
    return sum(colors_of(channels[a]) * channels[b][..., None] for a, b in pairs)


def motion(channels, most):
    """Right is red, left cyan, down green; grey for what rests, black for nothing (H, W, 3)."""
    x, y = (channels[f"motion.{axis}"] / most for axis in "XY")
    seen = np.isfinite(channels["Z"])[..., None]
    return np.clip(np.stack((0.5 + x, 0.5 - x / 2 + y, 0.5 - x / 2 - y), axis=-1), 0, 1) * seen


facet, out = sys.argv[1], sys.argv[3]
channels = read_view(facet).channels
rgb = np.stack([channels[name] for name in "RGB"], axis=-1).astype(np.float32)
most = 2 * max(np.abs(channels[f"motion.{axis}"]).max() for axis in "XY")
panels = [
    tone_map(rgb, "aces", 0.0).astype(np.uint8),
    (255 * motion(channels, most)).astype(np.uint8),
    (255 * mattes(channels)).astype(np.uint8),
]
Image.fromarray(np.concatenate(panels, axis=1)).save(out)
