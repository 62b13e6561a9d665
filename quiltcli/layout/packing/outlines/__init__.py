"""Packing by outlines, which interlock."""
