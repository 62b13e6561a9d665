"""OpenEXR files: pixels and attributes, and whether a file is whole."""
