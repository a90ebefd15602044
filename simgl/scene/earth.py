"""The Earth as an ellipsoid with a Lambertian surface and a clear atmosphere."""

from __future__ import annotations

from dataclasses import dataclass

from simgl.physics.air import Atmosphere
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS


@dataclass(frozen=True, kw_only=True)
class Earth:
    """Semi-axes [m] and the surface's reflectance.

    albedo : Lambert albedo per band R, G, B, N; None takes the shipped day map
    air : what sunlight passes on its way past the limb; None is a bare sphere
    """

    equatorial_radius: float = WGS84_EQUATORIAL_RADIUS
    polar_radius: float = WGS84_POLAR_RADIUS
    albedo: tuple[float, float, float, float] | None = None
    air: Atmosphere | None = None

    @property
    def radii(self) -> tuple[float, float, float]:
        """Semi-axes along the Earth-fixed x, y, z [m]."""
        return self.equatorial_radius, self.equatorial_radius, self.polar_radius
