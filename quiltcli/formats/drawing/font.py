"""A bitmap font of capitals, digits and signs, 5 × 7 pixels: text that is the same on every machine.

Fonts drawn by a library change with its version, and their soft edges are no exact pixels.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from quiltcli.geometry import BoolArray

WIDTH, HEIGHT, ADVANCE = 5, 7, 6
"""A glyph's box, and the step from one glyph to the next, pixels."""

_ART = """
0     1     2     3     4     5     6     7     8     9
.###. ..#.. .###. ##### ...#. ##### ..##. ##### .###. .###.
#...# .##.. #...# ...#. ..##. #.... .#... ....# #...# #...#
#..## ..#.. ....# ..#.. .#.#. ####. #.... ...#. #...# #...#
#.#.# ..#.. ...#. ...#. #..#. ....# ####. ..#.. .###. .####
##..# ..#.. ..#.. ....# ##### ....# #...# .#... #...# ....#
#...# ..#.. .#... #...# ...#. #...# #...# .#... #...# ...#.
.###. .###. ##### .###. ...#. .###. .###. .#... .###. .##..

A     B     C     D     E     F     G     H     I     J
.###. ####. .###. ####. ##### ##### .###. #...# .###. ..###
#...# #...# #...# #...# #.... #.... #...# #...# ..#.. ...#.
#...# #...# #.... #...# #.... #.... #.... #...# ..#.. ...#.
##### ####. #.... #...# ####. ####. #.### ##### ..#.. ...#.
#...# #...# #.... #...# #.... #.... #...# #...# ..#.. ...#.
#...# #...# #...# #...# #.... #.... #...# #...# ..#.. #..#.
#...# ####. .###. ####. ##### #.... .###. #...# .###. .##..

K     L     M     N     O     P     Q     R     S     T
#...# #.... #...# #...# .###. ####. .###. ####. .#### #####
#..#. #.... ##.## ##..# #...# #...# #...# #...# #.... ..#..
#.#.. #.... #.#.# #.#.# #...# #...# #...# #...# #.... ..#..
##... #.... #.#.# #.#.# #...# ####. #...# ####. .###. ..#..
#.#.. #.... #...# #..## #...# #.... #.#.# #.#.. ....# ..#..
#..#. #.... #...# #...# #...# #.... #..#. #..#. ....# ..#..
#...# ##### #...# #...# .###. #.... .##.# #...# ####. ..#..

U     V     W     X     Y     Z     -     _     .     :
#...# #...# #...# #...# #...# ##### ..... ..... ..... .....
#...# #...# #...# #...# #...# ....# ..... ..... ..... .....
#...# #...# #...# .#.#. .#.#. ...#. ..... ..... ..... ..#..
#...# #...# #.#.# ..#.. ..#.. ..#.. ##### ..... ..... .....
#...# #...# #.#.# .#.#. ..#.. .#... ..... ..... ..... .....
#...# .#.#. ##.## #...# ..#.. #.... ..... ..... ..... ..#..
.###. ..#.. #...# #...# ..#.. ##### ..... ##### ..#.. .....

+     /     (     )     #     ,     '     =     &     ?
..... ..... ...#. .#... .#.#. ..... ..#.. ..... .##.. .###.
..#.. ....# ..#.. ..#.. .#.#. ..... ..#.. ..... #..#. #...#
..#.. ...#. .#... ...#. ##### ..... ..... ##### #.#.. ....#
##### ..#.. .#... ...#. .#.#. ..... ..... ..... .#... ...#.
..#.. .#... .#... ...#. ##### ..##. ..... ##### #.#.# ..#..
..#.. #.... ..#.. ..#.. .#.#. ...#. ..... ..... #..#. .....
..... ..... ...#. .#... .#.#. ..#.. ..... ..... .##.# ..#..
"""


@cache
def _glyphs() -> dict[str, BoolArray]:
    """Glyph (7, 5) of every character there is, and of what stands for all others."""
    found = {" ": np.zeros((HEIGHT, WIDTH), dtype=np.bool_)}
    for block in _ART.strip().split("\n\n"):
        heading, *rows = block.splitlines()
        columns = [row.split() for row in rows]
        for at, character in enumerate(heading.split()):
            found[character] = np.array([[dot == "#" for dot in row[at]] for row in columns])
    hollow = np.ones((HEIGHT, WIDTH), dtype=np.bool_)
    hollow[1:-1, 1:-1] = False
    found[""] = hollow
    return found


def text_width(text: str) -> int:
    """Width of a line of text at scale 1, pixels."""
    return max(0, ADVANCE * len(text) - (ADVANCE - WIDTH))


def text_mask(text: str, scale: int = 1) -> BoolArray:
    """A line of text, every dot a square of `scale` pixels.

    Small letters are written as capitals; a character the font lacks is a hollow box.

    Returns:
        (7·scale, text_width(text)·scale) bool.
    """
    glyphs = _glyphs()
    mask = np.zeros((HEIGHT, text_width(text)), dtype=np.bool_)
    for at, character in enumerate(text):
        # ß and its kind become several capitals: then the small letter decides, as a box.
        glyph = glyphs.get(character.upper(), glyphs[""])
        mask[:, ADVANCE * at : ADVANCE * at + WIDTH] = glyph
    return mask.repeat(scale, axis=0).repeat(scale, axis=1)
