"""For other programs, and for people without quilt."""
