"""Bytes to arrays and back: files of any kind. Nothing here knows a facet, a viewer or a quilt."""
