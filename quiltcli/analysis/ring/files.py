"""Pictures of what eyes around the display see, as files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from quiltcli.analysis.ring.simulate import EyeOptions, default_eyes, look_at_display, told
from quiltcli.analysis.simulate.compare import heat_map, heat_scale
from quiltcli.analysis.simulate.files import Pictures, check_names, numbered
from quiltcli.images.preview import write_bytes, write_png
from quiltcli.job import JobFile
from quiltcli.render.ring.setup import set_ring_stage


def write_eye_pictures(
    job: JobFile, frames: Sequence[int], options: EyeOptions, pictures: Pictures
) -> Iterator[str]:
    """Look at the display in frames and write what is seen; yields what there is to say, line by line.

    Without an eye in the options there is a picture from the ring at 0° and from each user; the second and
    later ones have their number in their names.

    Raises:
        QuiltError: bad input, or a file that cannot be written.
    """
    stage = set_ring_stage(job, frames)
    check_names(
        [path for path in (pictures.picture, pictures.direct, pictures.heat_map) if path], len(frames)
    )
    for frame in frames:
        eyes = [options.eye] if options.eye else default_eyes(stage, frame)
        for number, eye in enumerate(eyes):
            found = look_at_display(job, frame, replace(options, eye=eye))
            who = f"{eye[0]:g}°, {eye[1]:g} m high, {eye[2]:g} m away"
            yield from told(found, who)
            for path, light in ((pictures.picture, found.picture), (pictures.direct, found.direct)):
                if path is not None:
                    place = _eye_path(path, frame, number)
                    write_png(place, light, pictures.view, pictures.exposure)
                    yield f"{'picture':<24}{place}"
            if pictures.heat_map is not None and found.comparison is not None:
                place, error = _eye_path(pictures.heat_map, frame, number), found.comparison.error
                write_bytes(place, heat_map(error, heat_scale(error)))
                yield f"{'errors':<24}{place}"


def _eye_path(path: Path, frame: int, number: int) -> Path:
    path = numbered(path, frame)
    return path.with_stem(f"{path.stem}_{number + 1}") if number else path
