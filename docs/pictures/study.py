"""The chart of persons in docs/study.md, of the log that the tests make up: `study.py LOG.csv CHART.svg`."""

import sys
from pathlib import Path

from quiltcli.analysis.ease import ease_of_use, read_log
from quiltcli.analysis.ease.report import persons_chart

log, out = map(Path, sys.argv[1:])
chart = persons_chart(ease_of_use(read_log(log)))
end = chart.index(">") + 1
out.write_text(
    f'{chart[:end]}\n<rect width="100%" height="100%" fill="#fff"/>{chart[end:]}\n', encoding="utf-8"
)
