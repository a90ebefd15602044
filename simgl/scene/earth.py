"""The Earth as an ellipsoid with a Lambertian surface and a clear atmosphere."""

from __future__ import annotations

from dataclasses import dataclass

from simgl.physics.air import Atmosphere
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS

# Of ground and clouds together, in every band, for the light that goes to and fro between them and
# the air: the planet's Bond albedo is 0.29 (CERES EBAF).
MEAN_ALBEDO = 0.3


@dataclass(frozen=True, kw_only=True)
class Earth:
    """Semi-axes [m] and the surface's reflectance.

    albedo : Lambert albedo per band R, G, B, N; None takes the shipped day map
    air : what scatters and dims light above the ground; None is a bare sphere
    """

    equatorial_radius: float = WGS84_EQUATORIAL_RADIUS
    polar_radius: float = WGS84_POLAR_RADIUS
    albedo: tuple[float, float, float, float] | None = None
    air: Atmosphere | None = None

    @property
    def mean_albedo(self) -> tuple[float, float, float, float]:
        """Of the whole ground, per band."""
        return (MEAN_ALBEDO,) * 4 if self.albedo is None else self.albedo

    @property
    def radii(self) -> tuple[float, float, float]:
        """Semi-axes along the Earth-fixed x, y, z [m]."""
        return self.equatorial_radius, self.equatorial_radius, self.polar_radius
