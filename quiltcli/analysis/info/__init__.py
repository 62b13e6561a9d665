"""What a file is: a display, a mesh, a layout, a scene, a job, an EXR image or a render's output."""

from __future__ import annotations

from pathlib import Path

from quiltcli.analysis.info.record import Info
from quiltcli.formats.inputs import name_fault
from quiltcli.job import file_kind
from quiltcli.job.model import MESHES

__all__ = ["Info", "describe"]


def describe(path: Path | str) -> Info:
    """What a file is, told by its kind.

    Raises:
        QuiltError: the file is missing, of no kind that is known, or wrong.
    """
    path = Path(path)
    if not name_fault(path) and path.is_dir():
        from quiltcli.analysis.info.outputs import output_info

        return output_info(path)
    suffix = path.suffix.lower()
    if suffix == ".exr":
        from quiltcli.analysis.info.images import image_info

        return image_info(path)
    if suffix in MESHES:
        from quiltcli.analysis.info.scenes import mesh_info

        return mesh_info(path)
    return _yaml_info(file_kind(path), path)


def _yaml_info(kind: str, path: Path) -> Info:
    from quiltcli.analysis.info.displays import display_info
    from quiltcli.analysis.info.jobs import job_info
    from quiltcli.analysis.info.layouts import layout_info
    from quiltcli.analysis.info.rings import calibration_info, lightfield_info
    from quiltcli.analysis.info.scenes import scene_info

    tell = {
        "quilt_display": display_info,
        "quilt_layout": layout_info,
        "quilt_scene": scene_info,
        "quilt_job": job_info,
        "quilt_lightfield": lightfield_info,
        "quilt_calibration": calibration_info,
    }
    return tell[kind](path)
