"""What the user chose to see, as a frozen value."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

from simgl.errors import ConfigError, did_you_mean
from simgl.scenario.scenario import Scenario
from simgl.viewer.orbit_camera import OrbitCamera, opening_camera

# Limits of the speed, as doublings: 1/64 of real time to an orbit in 1.3 s.
_SLOWEST, _FASTEST = -6, 12


# Planes of ``displays.display`` side by side by the name of the view; "seen" is radiance as an eye
# with the display's exposure would see it.
ORBIT_VIEWS = {"radiance as seen": ("seen",), "radiance in false colours": ("radiance",)}
CAMERA_VIEWS = {
    "DN beside radiance": ("dn", "radiance"),
    "DN": ("dn",),
    "radiance in false colours": ("radiance",),
    "radiance as seen": ("seen",),
    "mean electrons": ("electrons",),
    "depth": ("depth",),
}


@dataclass(frozen=True, kw_only=True)
class ViewSettings:
    """What the user chose to see.

    tai_ns : instant of the scene
    target, orbit : the spacecraft in the centre and the camera about it
    camera : the scenario camera to look through; None for the orbit camera
    orbit_view, camera_view : what is shown of either, of ``ORBIT_VIEWS`` and ``CAMERA_VIEWS``
    exposure_thirds : longer exposure than the scenario's, and a brighter display, in thirds of an
        EV
    gain_thirds : more gain than the scenario's, in thirds of an EV
    sun_deg : right ascension and declination of the Sun; None for where the scenario has it
    speed_doublings : the scene's seconds for each of the user's are two to this power
    histogram : whether that of DN is shown
    """

    tai_ns: int
    target: str
    orbit: OrbitCamera
    camera: str | None = None
    orbit_view: str = "radiance as seen"
    camera_view: str = "DN beside radiance"
    exposure_thirds: int = 0
    gain_thirds: int = 0
    sun_deg: tuple[float, float] | None = None
    speed_doublings: int = 0
    playing: bool = False
    histogram: bool = True

    @property
    def exposure_value(self) -> float:
        """[EV]."""
        return self.exposure_thirds / 3.0

    @property
    def shown(self) -> tuple[str, tuple[str, ...]]:
        """The view and its planes."""
        if self.camera is None:
            return self.orbit_view, ORBIT_VIEWS[self.orbit_view]
        return self.camera_view, CAMERA_VIEWS[self.camera_view]

    @property
    def gain_factor(self) -> float:
        """Of the scenario's gain."""
        return 2.0 ** (self.gain_thirds / 3.0)

    @property
    def speed(self) -> float:
        """Seconds of the scene for each second of the user."""
        return 2.0**self.speed_doublings

    def later(self, seconds: float) -> ViewSettings:
        """After some seconds of the user's time at the chosen speed."""
        return replace(self, tai_ns=self.tai_ns + round(1e9 * seconds * self.speed))

    def faster(self, doublings: int) -> ViewSettings:
        """At another speed, within its limits."""
        speed = min(max(self.speed_doublings + doublings, _SLOWEST), _FASTEST)
        return replace(self, speed_doublings=speed)

    def same_image(self, other: ViewSettings) -> bool:
        """Whether both need the same capture."""
        return self._of_the_image == other._of_the_image

    @property
    def _of_the_image(self) -> tuple[Hashable, ...]:
        if self.camera is None:
            return self.tai_ns, self.sun_deg, self.target, self.orbit
        settings = self.camera, self.exposure_thirds, self.gain_thirds
        return self.tai_ns, self.sun_deg, settings


def opening_settings(
    scenario: Scenario, target: str | None, camera: str | None = None
) -> ViewSettings:
    """The first image: the scenario's epoch, a spacecraft in the centre or a camera's view.

    Raises ConfigError for a scenario without spacecraft, or a target or camera that it lacks.
    """
    if not scenario.models:
        raise ConfigError(
            scenario.name, "spacecraft", "is missing; the viewer circles a [spacecraft.NAME]"
        )
    if target is not None and target not in scenario.models:
        problem = f'"{target}" is not in {scenario.name}; {did_you_mean(target, scenario.models)}'
        raise ConfigError("command line", "--target", problem)
    if camera is not None and camera not in scenario.cameras:
        problem = f'"{camera}" is not in {scenario.name}; {did_you_mean(camera, scenario.cameras)}'
        raise ConfigError("command line", "--camera", problem)
    name = next(iter(scenario.models)) if target is None else target
    state = scenario.at(scenario.epoch_tai_ns)
    return ViewSettings(
        tai_ns=scenario.epoch_tai_ns,
        target=name,
        orbit=opening_camera(state, name),
        camera=camera,
    )
