"""`quilt film`: the images of a render as films and sequences that others play."""
