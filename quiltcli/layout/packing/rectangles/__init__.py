"""Packing by bounding rectangles."""
