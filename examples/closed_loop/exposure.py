"""Auto-exposure and lamp control from the images alone.

The brightness of white surfaces on the target, divided by the exposure time, measures the light:
sunlight needs tens of microseconds, the lamp a millisecond and more. If white needs longer than in
any sunlight, it is night and the lamp is switched on. If it needs less than the lamp could give,
the Sun is back and the lamp is switched off.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, kw_only=True)
class Light:
    """Exposure time [s] and lamp state of an image."""

    exposure: float
    lamp: bool


@dataclass(frozen=True, kw_only=True)
class ExposureControl:
    """The control law.

    goal : brightness of white on the target, as a fraction of full scale
    shortest, longest : exposure [s]
    night : the lamp is switched on if white needs longer than this [s]
    day : and off if white needs less [s]; in lamp light white always needs more
    max_change : largest factor between images
    unseen : fraction of full scale below which nothing is visible
    """

    goal: float = 0.55
    shortest: float = 1e-5
    longest: float = 0.25
    night: float = 6e-4
    day: float = 1.5e-4
    max_change: float = 4.0
    unseen: float = 0.004

    def after(self, now: Light, used: Light, brightness: float) -> Light:
        """The settings of the next image.

        now : the current settings
        used : settings of the image that was evaluated, which may be some images old
        brightness : of white on the target in it, as a fraction of full scale
        """
        if used.lamp != now.lamp:
            # Taken before the lamp was switched: it does not show the present light.
            return now
        change = self.max_change if brightness < self.unseen else self.goal / brightness
        if brightness > 0.97:
            # Clipped: the excess is unknown.
            change = 1.0 / self.max_change
        wanted = used.exposure * min(max(change, 1.0 / self.max_change), self.max_change)
        lamp = (now.lamp and wanted > self.day) or wanted > self.night
        return replace(now, exposure=min(max(wanted, self.shortest), self.longest), lamp=lamp)
