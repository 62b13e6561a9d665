"""How the tones of a turn become bits: the job's key `halftone`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from quiltcli.job.model import Model, OneOf, Positive

HALFTONES = ("ostromoukhov", "fixed", "void_cluster", "bayer", "none")
COMPENSATIONS = ("none", "dwell")


class HalftoneSpec(Model):
    """How tones become light that is on or off."""

    method: Annotated[str, OneOf(HALFTONES)] = "ostromoukhov"
    """Error diffusion with shares that depend on the tone, or fixed ones; a mask of thresholds; none at ½."""
    exposure: Positive = 1.0
    """Factor on all tones, before they are cut at 1; linear."""
    angle: Annotated[float, Field(allow_inf_nan=False, ge=0, lt=0.5)] = 0.0
    """Share of a picture's error that the next one gets, turned with the mirror, linear. Dark tones get
    coarser by it, and the first pictures of a turn are off: 0 is best as a rule."""
    compensate: Annotated[str, OneOf(COMPENSATIONS)] = "none"
    """Whether pixels that dwell longer on a viewer get darker tones: none, or dwell."""
    before: bool = False
    """Whether photographs of a light field become bits before they are rearranged, and their pixels are
    copied then, to compare with: dots are torn apart by it."""
