"""`quilt project`: one picture made for the viewpoint, put on the facets."""
