"""Reduce the pictures of this folder to 960 pixels and a palette of 256 colours each, in place."""

from pathlib import Path

from PIL import Image

for path in sorted(Path(__file__).parent.glob("*.png")):
    picture = Image.open(path).convert("RGB")
    picture.thumbnail((960, 960), Image.Resampling.LANCZOS)
    picture.quantize(256, Image.Quantize.MEDIANCUT).save(path, optimize=True)
