"""Meshes of scene objects, by file format."""
