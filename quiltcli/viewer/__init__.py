"""Where the viewer's eye is in a frame, and where it looks."""
