"""Textures at visible points: which picture, where in it, filtered over the pixel's footprint."""
