"""How grainy halftones are: the table and the picture of docs/halftones.md.

`python -m tests.benchmarks.halftones` prints the table, `--write docs/halftones.md` puts it into the page,
between its marks, and `--picture FILE.png` draws tones by every method. Grain is the mean power of a flat
tone's bits below half the principal frequency √g, g the smaller share of dark and lit pixels (Ulichney,
*Dithering with blue noise*, 1988), over that of bits thrown at random.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from quiltcli.formats.png import save_png
from quiltcli.geometry import BoolArray, Float32Array
from quiltcli.halftone import halftone
from quiltcli.job.halftone import HALFTONES, HalftoneSpec
from tests.benchmarks.packing import markdown

LEVELS = (8, 16, 32, 64, 96, 127, 160, 191, 224, 240)
SIDE = 256
CROP = slice(64, 192)


def grain(bits: BoolArray, tone: float) -> float:
    """Low-frequency power of bits (n, n) over that of white noise of the same tone."""
    power = np.abs(np.fft.fft2(bits - bits.mean())) ** 2 / bits.size
    f = np.fft.fftfreq(len(bits))
    away = np.hypot(f[:, None], f)
    low = (away > 0) & (away < np.sqrt(min(tone, 1 - tone)) / 2)
    return float(power[low].mean() / (tone * (1 - tone)))


def table() -> list[list[str]]:
    """A row for every level: the grain of every method."""
    methods = [method for method in HALFTONES if method != "none"]
    tones = np.stack([np.full((SIDE, SIDE), level / 255, np.float32) for level in LEVELS])
    inside = np.ones((SIDE, SIDE), dtype=np.bool_)
    found = {method: halftone(tones, inside, HalftoneSpec(method=method)) for method in methods}
    rows = [["tone", *methods, "at random"]]
    rng = np.random.default_rng(1)
    for k, level in enumerate(LEVELS):
        tone = level / 255
        noise = rng.random((SIDE, SIDE)) < tone
        cells = [f"{grain(bits[k][CROP, CROP], tone):.3f}" for bits in found.values()]
        rows.append([f"{level}/255", *cells, f"{grain(noise[CROP, CROP], tone):.2f}"])
    return rows


def motif(width: int, height: int) -> Float32Array:
    """A ball that is lit from above left over a ramp, linear light (height, width)."""
    y, x = np.mgrid[:height, :width].astype(np.float64)
    ramp = np.broadcast_to((x / (width - 1)) ** 2, (height, width)).copy()
    cx, cy, r = width / 2, height / 2, 0.42 * height
    u, v = (x - cx) / r, (y - cy) / r
    inside = u * u + v * v < 1
    w = np.sqrt(np.maximum(1 - u * u - v * v, 0))
    ramp[inside] = np.clip(0.02 + 0.9 * np.maximum(-0.5 * u - 0.6 * v + 0.62 * w, 0), 0, 1)[inside]
    return ramp.astype(np.float32)


def picture(path: Path) -> None:
    """Draw the motif by every method, one below the other, pixels doubled."""
    tones = motif(440, 72)
    inside = np.ones(tones.shape, dtype=np.bool_)
    strips = [halftone(tones[None], inside, HalftoneSpec(method=method))[0] for method in HALFTONES]
    gap = np.full((4, tones.shape[1]), 128, dtype=np.uint8)
    rows = [part for bits in strips for part in (np.where(bits, 255, 0).astype(np.uint8), gap)][:-1]
    save_png(path, np.concatenate(rows).repeat(2, axis=0).repeat(2, axis=1))


def main() -> None:
    """Print the table, or write it into a page between its marks; draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path, help="page to write the table into")
    parser.add_argument("--picture", type=Path, help="PNG to draw")
    options = parser.parse_args()
    if options.picture:
        picture(options.picture)
    text = markdown(table())
    if not options.write:
        print(text)
        return
    begin, end = "<!-- table: grain -->\n", "<!-- end -->"
    head, rest = options.write.read_text(encoding="utf-8").split(begin)
    written = head + begin + text + "\n" + end + rest.split(end, 1)[1]
    options.write.write_text(written, encoding="utf-8")


if __name__ == "__main__":
    main()
