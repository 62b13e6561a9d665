"""Pixel to ray and back, one file a kind."""
