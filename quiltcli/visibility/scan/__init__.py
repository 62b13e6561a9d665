"""Triangles to pixels: depth keys, and what is nearest."""
