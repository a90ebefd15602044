"""Exposure and lamp, by what images show: brightness of the target, whatever lights it.

Only images decide. The brightness of white on the target, over the exposure that it took, says what
light there is: sunlight asks for tens of microseconds, the lamp for a millisecond and more. Where
white would need longer than sunlight ever does, it is night, and the lamp goes on; where it needs
so little that no lamp could have done it, the Sun is back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, kw_only=True)
class Light:
    """What the next image is taken with."""

    exposure: float
    lamp: bool


@dataclass(frozen=True, kw_only=True)
class ExposureControl:
    """The rules.

    goal : of white on the target, as a share of full scale
    shortest, longest : exposure [s]
    night : the lamp goes on where white needs longer than this [s]
    day : and off where it needs less [s]; the lamp alone never asks for so little
    max_change : between images, either way
    unseen : share of full scale below which nothing is seen
    """

    goal: float = 0.55
    shortest: float = 1e-5
    longest: float = 0.25
    night: float = 6e-4
    day: float = 1.5e-4
    max_change: float = 4.0
    unseen: float = 0.004

    def after(self, now: Light, used: Light, brightness: float) -> Light:
        """What to use next, from an image.

        used : what the image was taken with, which may be some images ago
        brightness : of white on the target, as a share of full scale
        """
        if used.lamp != now.lamp:
            # Taken before the lamp was switched: it says nothing about the light there is now.
            return now
        change = self.max_change if brightness < self.unseen else self.goal / brightness
        if brightness > 0.97:
            # Clipped: how much too bright it is cannot be seen.
            change = 1.0 / self.max_change
        wanted = used.exposure * min(max(change, 1.0 / self.max_change), self.max_change)
        lamp = (now.lamp and wanted > self.day) or wanted > self.night
        return replace(now, exposure=min(max(wanted, self.shortest), self.longest), lamp=lamp)
