"""Write the reference of the YAML files: `python -m quiltcli.job.reference [FOLDER]`."""

import sys
from pathlib import Path

from quiltcli.job.reference import write_pages

if __name__ == "__main__":
    write_pages(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/reference"))
