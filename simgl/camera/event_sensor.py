"""An event sensor as data: thresholds, dead time and noise of its pixels."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class EventSensor:
    """Pixels that report changes of light; they share a camera's lens and photodiodes.

    threshold_on, threshold_off : change of the logarithm of the photo-current that makes an event
    threshold_spread : standard deviation of the logarithm of the thresholds from pixel to pixel
    refractory_time : after an event, for which a pixel is blind [s]
    leak_rate : of ON events of a pixel in light that does not change [s-1]
    shot_noise_rate : of events of either sign of a pixel in darkness [s-1]
    """

    threshold_on: float
    threshold_off: float
    threshold_spread: float
    refractory_time: float
    leak_rate: float
    shot_noise_rate: float
