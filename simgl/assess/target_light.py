"""Light on one target in one frame: geometry of the Sun, and how many of its pixels are usable."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from simgl.arrays import Array, Array32, Mask
from simgl.assess.exposure_advice import DETECTION, exposure_limits, full_electrons
from simgl.assess.frame_geometry import FrameGeometry, frame_geometry
from simgl.assess.target_background import TargetBackground, backdrop, ring_around
from simgl.assess.target_temperatures import (
    TargetTemperatures,
    target_temperatures,
    thermal_signal_to_noise,
)
from simgl.camera.camera import Camera
from simgl.errors import ConfigError, did_you_mean
from simgl.figures.false_colour import relative_flux
from simgl.images import saturated
from simgl.physics.frames import angle_between
from simgl.scenario.schema import UsabilityCriteria
from simgl.scene.state import SceneState
from simgl.simulator import Capture

# Percentile of the target's electrons that counts as its bright part.
_BRIGHT = 98.0


@dataclass(frozen=True, kw_only=True)
class FrameAssessment:
    """Visibility and light of a target in one image.

    target : name of the spacecraft
    range : camera to the target's body origin [m]
    phase_angle : Sun - target - camera [rad]
    sun_to_boresight : [rad]
    sunlight : fraction of the Sun's light that Earth, atmosphere and Moon let reach the target,
        over all bands
    target_pixels : number of pixels at whose centre the target is visible
    saturated, dark, usable : fractions of these pixels; their sum is 1, or all are 0 without pixels
    median_snr : signal over noise of the target's pixels, for a thermal camera that of their
        difference from the background; 0 without pixels
    cut_off : the target touches the image's edge
    size_px : longer side of the box around the target's pixels; 0 where there are none
    edge_distance_px : pixels between that box and the nearest edge of the image; None where there
        are none
    backdrop : the background behind the target
    geometry : of Sun, Earth and orbit
    contrast : abs(t - b) / (t + b) of target and background, median electrons, for a thermal camera
        radiance; None without background beside the target
    temperatures : results of a thermal camera; None for visible light, and out of view

    For visible light, otherwise None:

    mean_radiance : of the target's pixels, R, G, B, N [W m-2 sr-1]
    relative_flux : mean over the target of the source study's flux: luminance relative to a sunlit
        white plate, weighted like a display's primaries, times 1367 [W m-2]; not a physical flux
    median_electrons : of the target's pixels [e-]
    bright_electrons : that 2 % of the target's pixels exceed [e-]
    full_electrons : at which a pixel or its converter is full [e-]
    better_exposure : recommended exposure time over the present one; None if the target gives no
        light
    """

    target: str
    range: float
    phase_angle: float
    sun_to_boresight: float
    sunlight: float
    target_pixels: int
    saturated: float
    dark: float
    usable: float
    median_snr: float
    cut_off: bool
    size_px: int
    edge_distance_px: int | None
    backdrop: TargetBackground
    contrast: float | None
    geometry: FrameGeometry
    temperatures: TargetTemperatures | None = None
    mean_radiance: tuple[float, float, float, float] | None = None
    relative_flux: float | None = None
    median_electrons: float | None = None
    bright_electrons: float | None = None
    full_electrons: float | None = None
    better_exposure: float | None = None

    @property
    def sun_exclusion(self) -> float | None:
        """``sun_to_boresight`` where sunlight reaches the camera; None in full eclipse [rad]."""
        return self.sun_to_boresight if self.geometry.camera_sunlight > 0.0 else None

    @property
    def exitance(self) -> float | None:
        """pi times the mean radiance of the target, 400-1000 nm [W m-2]; None of a thermal camera.

        This is the flux that leaves its surface if it is equally bright in all directions.
        """
        return None if self.mean_radiance is None else float(np.pi * sum(self.mean_radiance))


@dataclass(frozen=True, kw_only=True)
class _Signal:
    """Of a target's n pixels: which are full, which in the noise, signal over noise; contrast to
    what is behind; and fields of the assessment that one kind of camera has."""

    full: Mask
    dark: Mask
    snr: Array
    contrast: float | None
    fields: Mapping[str, Any]


def assess_frame(
    capture: Capture,
    state: SceneState,
    target: str,
    criteria: UsabilityCriteria = UsabilityCriteria(),
) -> FrameAssessment:
    """Assess a target in a capture of a state.

    capture : with DN, electrons, radiance and truth; for a thermal camera DN, thermal frame and
        truth
    state : that the capture shows
    target : name of the spacecraft
    criteria : limits; they include the fraction of the target that may saturate

    Raises ConfigError for an unknown target.
    """
    if target not in state.bodies:
        problem = f"is not in the scenario; {did_you_mean(target, state.bodies)}"
        raise ConfigError("assess", f'target "{target}"', problem)
    assert capture.truth is not None
    info = capture.info
    position = state.bodies[target].pose.position
    sun = state.sun.seen_from(position)
    to_camera = info.position - position
    instance = list(state.bodies).index(target) + 1
    instances = capture.truth.instance
    on_target = instances == instance
    ring = ring_around(on_target, instances > 0)
    if capture.thermal is not None:
        signal = _thermal_signal(capture, on_target, ring)
    else:
        signal = _light_signal(capture, on_target, ring, instances == 0, criteria)
    count = int(on_target.sum())

    def share(mask: Mask) -> float:
        return float(mask.sum()) / max(count, 1)

    pose = info.position, info.R_camera_from_icrf, info.camera.intrinsics
    size, edge_distance = _box(on_target)
    return FrameAssessment(
        target=target,
        range=float(np.linalg.norm(to_camera)),
        phase_angle=angle_between(sun.direction_icrf, to_camera),
        sun_to_boresight=angle_between(info.sun_direction_icrf, info.R_camera_from_icrf[2]),
        sunlight=state.sunlit_share(position),
        target_pixels=count,
        saturated=share(signal.full),
        dark=share(signal.dark),
        usable=share(~signal.full & ~signal.dark),
        median_snr=float(np.median(signal.snr)) if count else 0.0,
        cut_off=edge_distance == 0,
        size_px=size,
        edge_distance_px=edge_distance,
        backdrop=backdrop(ring, state, *pose),
        contrast=signal.contrast,
        geometry=frame_geometry(state, info.camera.name, target),
        **signal.fields,
    )


def _light_signal(
    capture: Capture, on_target: Mask, ring: Mask, sky: Mask, criteria: UsabilityCriteria
) -> _Signal:
    """Of visible light."""
    assert capture.digital is not None
    assert capture.electrons is not None
    assert capture.radiance is not None
    camera, image = capture.info.camera, capture.electrons.electrons
    electrons = image[on_target].astype(np.float64)
    full = saturated(capture.digital.dn[on_target], camera.detector)
    snr = _signal_to_noise(electrons, camera)
    count = int(on_target.sum())
    radiance = capture.radiance.radiance[on_target].mean(axis=0) if count else np.zeros(4)
    return _Signal(
        full=full,
        dark=~full & (snr < DETECTION),
        snr=snr,
        contrast=_contrast(electrons, image[ring]),
        fields={
            "mean_radiance": _four(radiance),
            "relative_flux": float(relative_flux(radiance.astype(np.float32))),
            "median_electrons": float(np.median(electrons)) if count else 0.0,
            "bright_electrons": float(np.percentile(electrons, _BRIGHT)) if count else 0.0,
            "full_electrons": full_electrons(camera),
            "better_exposure": _better_exposure(electrons, image[sky], camera, criteria),
        },
    )


def _thermal_signal(capture: Capture, on_target: Mask, ring: Mask) -> _Signal:
    """Of a thermal camera; what is colder than its lowest DN counts as dark."""
    assert capture.digital is not None
    assert capture.thermal is not None
    camera, dn, seen = capture.info.camera, capture.digital.dn, capture.thermal
    assert camera.thermal is not None
    full = saturated(dn[on_target], camera.detector)
    snr = thermal_signal_to_noise(dn, on_target, ring, camera.thermal)
    return _Signal(
        full=full,
        dark=~full & ((snr < DETECTION) | (dn[on_target] == 0)),
        snr=snr,
        contrast=_contrast(seen.radiance[on_target].astype(np.float64), seen.radiance[ring]),
        fields={"temperatures": target_temperatures(seen, on_target, ring)},
    )


def _four(values: Array) -> tuple[float, float, float, float]:
    r, g, b, n = values.tolist()
    return r, g, b, n


def _box(mask: Mask) -> tuple[int, int | None]:
    """Longer side of the box around a mask, and its distance from the nearest edge [px]."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if rows.size == 0:
        return 0, None
    top, bottom, left, right = rows[0], rows[-1], columns[0], columns[-1]
    height, width = mask.shape
    edge = min(top, left, height - 1 - bottom, width - 1 - right)
    return int(max(bottom - top, right - left)) + 1, int(edge)


def _signal_to_noise(electrons: Array, camera: Camera) -> Array:
    """Of each pixel; a full one counts as just full."""
    counted = np.minimum(electrons, full_electrons(camera))
    return counted / np.sqrt(counted + camera.detector.read_noise**2 + 1.0 / 12.0)


def _better_exposure(
    target: Array, sky: Array32, camera: Camera, criteria: UsabilityCriteria
) -> float | None:
    """Factor on the exposure time; None where there is no target, or no limit."""
    if target.size == 0:
        return None
    better = exposure_limits(target, sky, camera, criteria).time / camera.exposure_time
    return better if math.isfinite(better) else None


def _contrast(target: Array, background: Array32) -> float | None:
    if target.size == 0 or background.size == 0:
        return None
    t, b = float(np.median(target)), float(np.median(background))
    return abs(t - b) / (t + b) if t + b > 0.0 else 0.0
