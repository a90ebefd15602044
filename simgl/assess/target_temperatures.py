"""What a thermal image shows of one target: its temperatures, and how it stands out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Image16, Mask
from simgl.camera.infrared_detector import InfraredDetector
from simgl.images import ThermalFrame


@dataclass(frozen=True, kw_only=True)
class TargetTemperatures:
    """A target in a thermal image.

    lowest, mean, highest : temperature of its surfaces in view [K]
    brightness : median of its pixels' brightness temperatures [K]
    background : the same beside it; None where there is nothing [K]
    netd : noise-equivalent temperature difference at its brightness [K]
    """

    lowest: float
    mean: float
    highest: float
    brightness: float
    background: float | None
    netd: float


def target_temperatures(
    frame: ThermalFrame, on_target: Mask, ring: Mask
) -> TargetTemperatures | None:
    """A target's temperatures; None where it is not in view.

    on_target, ring : (h, w) its pixels, and the background beside it
    """
    detector = frame.info.camera.thermal
    assert detector is not None
    kelvin = frame.temperature[on_target & (frame.temperature > 0.0)]
    if not kelvin.size:
        return None
    seen = frame.brightness_temperature
    brightness = float(np.median(seen[on_target]))
    signal = detector.signal(detector.emission(np.array(brightness)))
    return TargetTemperatures(
        lowest=float(kelvin.min()),
        mean=float(kelvin.mean(dtype=np.float64)),
        highest=float(kelvin.max()),
        brightness=brightness,
        background=float(np.median(seen[ring])) if ring.any() else None,
        netd=float(detector.noise(signal)) / detector.response(brightness),
    )


def thermal_signal_to_noise(
    dn: Image16, on_target: Mask, ring: Mask, detector: InfraredDetector
) -> Array:
    """(n,) of the target's pixels: difference to the background beside it, over the noise.

    All that a thermal camera sees is warm, so that only what differs is a signal; with nothing
    beside it, the signal above the lowest DN is.
    """
    per_dn = detector.electrons_per_dn if detector.table.kind == "photon" else 1.0
    background = float(np.median(dn[ring])) if ring.any() else 0.0
    target = dn[on_target].astype(np.float64)
    noise = detector.noise(target * per_dn) / per_dn
    return np.asarray(np.abs(target - background) / noise)
