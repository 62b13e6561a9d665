"""The YAML files: their models, how they are read, and how they are written back.

Load a file and every problem in it comes in one `JobError`; every model and part of a model has a
`source`, whose `problem(key, message)` points into the file when a later stage finds something.
"""

from quiltcli.job.calibration import CalibrationFile
from quiltcli.job.check import check_file
from quiltcli.job.digest import file_sha256, job_sha256
from quiltcli.job.display import DisplayFile, FacetSpec, PanelSpec, ResolutionSpec, TransformSpec
from quiltcli.job.dump import dump_job, dump_yaml
from quiltcli.job.job import COMPRESSIONS, JobFile, OutputSpec, RenderSpec
from quiltcli.job.layout import (
    CANVASES,
    PACKING_METHODS,
    LayoutFile,
    PackSpec,
    PageSpec,
    PlaceSpec,
    UvLayoutSpec,
    read_aspect,
)
from quiltcli.job.lengths import UNITS
from quiltcli.job.lightfield import LightfieldFile
from quiltcli.job.lights import AmbientLight, AreaLight, DirectionalLight, LightSpec, PointLight, SpotLight
from quiltcli.job.load import (
    file_kind,
    load_calibration_file,
    load_camera_file,
    load_display_file,
    load_job,
    load_layout_file,
    load_lightfield_file,
    load_scene_file,
    pack_spec,
)
from quiltcli.job.recorded import FilterSpec, GapsSpec, MarkerSpec, RecordedSpec
from quiltcli.job.scene import MaterialSpec, ObjectSpec, SceneFile
from quiltcli.job.viewer import CsvSpec, KeyframeSpec, OrbitSpec, PathSpec, ViewerSpec

__all__ = [
    "CANVASES",
    "COMPRESSIONS",
    "PACKING_METHODS",
    "UNITS",
    "AmbientLight",
    "AreaLight",
    "CalibrationFile",
    "CsvSpec",
    "DirectionalLight",
    "DisplayFile",
    "FacetSpec",
    "FilterSpec",
    "GapsSpec",
    "JobFile",
    "KeyframeSpec",
    "LayoutFile",
    "LightSpec",
    "LightfieldFile",
    "MarkerSpec",
    "MaterialSpec",
    "ObjectSpec",
    "OrbitSpec",
    "OutputSpec",
    "PackSpec",
    "PageSpec",
    "PanelSpec",
    "PathSpec",
    "PlaceSpec",
    "PointLight",
    "RecordedSpec",
    "RenderSpec",
    "ResolutionSpec",
    "SceneFile",
    "SpotLight",
    "TransformSpec",
    "UvLayoutSpec",
    "ViewerSpec",
    "check_file",
    "dump_job",
    "dump_yaml",
    "file_kind",
    "file_sha256",
    "job_sha256",
    "load_calibration_file",
    "load_camera_file",
    "load_display_file",
    "load_job",
    "load_layout_file",
    "load_lightfield_file",
    "load_scene_file",
    "pack_spec",
    "read_aspect",
]
