"""Put pictures side by side in one, and remove them: `python docs/pictures/join.py ALL.png PICTURE.png…`."""

import sys
from pathlib import Path

from PIL import Image

whole, *parts = sys.argv[1:]
pictures = [Image.open(path).convert("RGB") for path in parts]
height = min(picture.height for picture in pictures)
pictures = [picture.resize((picture.width * height // picture.height, height)) for picture in pictures]
joined = Image.new("RGB", (sum(picture.width for picture in pictures), height))
left = 0
for picture in pictures:
    joined.paste(picture, (left, 0))
    left += picture.width
joined.save(whole)
for path in parts:
    Path(path).unlink()
