"""Where the facets of a display really are, from photos of markers on it, or from measured corners."""
