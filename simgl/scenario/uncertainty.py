"""The table ``[uncertainty]``: what Monte Carlo draws of an assessment vary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from simgl.config.value_types import Table


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Standard deviations for the Monte Carlo draws of an assessment.

    The fields of ``UncertaintyTable``. The defaults are estimates for a target with finishes that
    have not been measured, and a calibrated camera.
    """

    draws: int = 40
    epochs: int = 24
    seed: int = 0
    albedo_sigma: float = 0.1
    exposure_sigma: float = 0.03
    attitude_sigma_deg: float = 1.0
    pointing_sigma_deg: float = 0.1
    weathers: int = 8


_RelativeSigma = Annotated[float, Meta(ge=0.0, le=1.0)]
_AngularSigma = Annotated[float, Meta(ge=0.0, le=180.0)]


class UncertaintyTable(Table, frozen=True, kw_only=True):
    """``[uncertainty]``: standard deviations for the Monte Carlo draws of an assessment.

    draws : number of draws; the errors of a draw are constant over the run
    epochs : number of epochs at which every draw is rendered, evenly spaced over the run
    seed : seed of the draws
    albedo_sigma : relative, of the light from the target to the camera
    exposure_sigma : relative, of exposure time, transmission and quantum efficiency together
    attitude_sigma_deg : attitude of the target, about each body axis
    pointing_sigma_deg : pointing of the camera, about each of its axes
    weathers : number of cloud fields, which the draws use in turn, if clouds follow a seed; 0 keeps
        that of the scenario
    """

    draws: Annotated[int, Meta(ge=2, le=1000)] = Uncertainty.draws
    epochs: Annotated[int, Meta(ge=2, le=1000)] = Uncertainty.epochs
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1)] = Uncertainty.seed
    albedo_sigma: _RelativeSigma = Uncertainty.albedo_sigma
    exposure_sigma: _RelativeSigma = Uncertainty.exposure_sigma
    attitude_sigma_deg: _AngularSigma = Uncertainty.attitude_sigma_deg
    pointing_sigma_deg: _AngularSigma = Uncertainty.pointing_sigma_deg
    weathers: Annotated[int, Meta(ge=0, le=1000)] = Uncertainty.weathers
