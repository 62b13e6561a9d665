"""What of a job is there already: the views that a resumed run need not draw."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from quiltcli.formats.temporary import remove_leftovers
from quiltcli.images.metadata import is_complete
from quiltcli.render.outputs import Outputs, facet_file, image_folders, view_files, view_lit
from quiltcli.render.report import known_views
from quiltcli.render.setup import Stage
from quiltcli.viewer.view import View, by_file


def unfinished(stage: Stage, out: Outputs, views: Iterable[View], threads: int = 1) -> list[View]:
    """Those of some views that are not finished, in their order; several files are read at a time."""
    groups = by_file(views)
    known = known_views(out.folder / "report.json", out.job_sha)
    with ThreadPoolExecutor(threads) as pool:
        finished = list(pool.map(partial(_are_finished, stage, out, known), groups))
    return [view for group, done in zip(groups, finished, strict=True) if not done for view in group]


def _are_finished(stage: Stage, out: Outputs, known: set[tuple[int, str]], views: tuple[View, ...]) -> bool:
    """Whether the report knows of views that share their files, and no bit of these is wrong.

    What has no record is drawn again: a run that was killed between the images and the record has taken
    the figures of the frame with it.
    """
    if any((view.frame, view.eye) not in known for view in views):
        return False
    missing = set(_skipped_files(stage, out, views))
    return all(
        is_complete(path, out.job_sha, views[0].frame) or (path in missing and not path.exists())
        for path in view_files(stage, out, views[0])
    )


def _skipped_files(stage: Stage, out: Outputs, views: tuple[View, ...]) -> Iterator[Path]:
    """Images of views that are not to be written, for their facets are not lit."""
    if stage.job.output.facets and stage.job.output.unlit == "skip":
        lit = np.logical_or.reduce([view_lit(stage, view) for view in views])
        for row in out.rows[~lit[out.rows]]:
            yield facet_file(stage, out, int(row), views[0])


def clear_away(stage: Stage, out: Outputs) -> None:
    """Remove what runs that were killed have left of files they were writing."""
    remove_leftovers(sorted({out.folder, *image_folders(stage, out)}))
