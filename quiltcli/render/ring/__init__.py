"""From a job with a ring of viewers to its files: a turn of the mirror a frame."""
