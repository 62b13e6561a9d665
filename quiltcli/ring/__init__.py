"""Displays of a spinning mirror: every pixel has a centre of projection of its own, on a ring of viewers.

Geometry after Jones et al., *Rendering for an Interactive 360° Light Field Display* (SIGGRAPH 2007).
"""
