"""quilt: a batch renderer for multiplanar displays.

The program reads in one direction, and so does the code: see `quiltcli.render.sequence` for the walk
from a job to its images.
"""

__version__ = "0.1.0"
