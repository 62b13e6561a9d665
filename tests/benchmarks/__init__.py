"""How fast is it? Measurements against other programs' ways of making the same pixels.

`python -m tests.benchmarks --help` from the root of the repository; docs/performance.md shows results.
"""

import os

# The program holds linear algebra to one thread; numpy reads this when it is first imported.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("LP_NUM_THREADS", "2")  # of the OpenGL renderer
