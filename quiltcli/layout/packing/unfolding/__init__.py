"""Packing that keeps neighbours together: nets."""
