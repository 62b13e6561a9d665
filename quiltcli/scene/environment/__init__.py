"""Light from a picture of all that is around: read, and made into maps that shading looks up."""
