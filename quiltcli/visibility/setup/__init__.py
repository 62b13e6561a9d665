"""What is made ready once a frame: blocks, triangles in them, planes."""
