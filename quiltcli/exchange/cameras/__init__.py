"""Cameras for other people's renderers: for every facet the pinhole whose picture is the facet's raster."""
