"""Which triangles may show on which facets."""
