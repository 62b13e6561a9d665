"""Pages and facet images: arrays and single files."""
