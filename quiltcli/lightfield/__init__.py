"""Light fields: photographs from a ring around an object, and the rays between them.

`load_field` finds the cameras and their pictures, `rebin` the light along rays that a display shows.
"""

from quiltcli.lightfield.cameras import Cameras, Lens, Row
from quiltcli.lightfield.field import Field, load_field
from quiltcli.lightfield.rebin import Rays, rebin

__all__ = ["Cameras", "Field", "Lens", "Rays", "Row", "load_field", "rebin"]
