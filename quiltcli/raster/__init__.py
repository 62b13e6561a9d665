"""Rasterization: which triangle does each pixel's ray meet first?"""
