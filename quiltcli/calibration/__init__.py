"""Finding out where the pieces of a real display are."""
