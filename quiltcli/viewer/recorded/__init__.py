"""Recorded heads: takes of trackers and cameras, from their files to a path."""
