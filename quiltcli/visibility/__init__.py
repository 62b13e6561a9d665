"""Which triangle the ray of each pixel meets first, and how far away. No colour."""
