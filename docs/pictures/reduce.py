"""Reduce pictures to at most 960 pixels and a palette of 256 colours, in place.

python docs/pictures/reduce.py PICTURE.png…
"""

import sys

from PIL import Image

for path in sys.argv[1:]:
    with Image.open(path) as found:
        picture = found.convert("RGB")
    picture.thumbnail((960, 960), Image.Resampling.LANCZOS)
    picture.quantize(256, Image.Quantize.MEDIANCUT).save(path, optimize=True)
