"""Rays through quilt pixels: cast with Embree and, where that is not enough, met in double precision."""
