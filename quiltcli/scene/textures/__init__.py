"""Pictures on surfaces: where they come from, and the memory they are looked up in."""
