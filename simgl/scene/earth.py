"""The Earth as an ellipsoid with a Lambertian surface."""

from __future__ import annotations

from dataclasses import dataclass

from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS


@dataclass(frozen=True, kw_only=True)
class Earth:
    """Semi-axes [m] and the surface's reflectance.

    albedo : Lambert albedo per band R, G, B, N; None takes the shipped day map
    """

    equatorial_radius: float = WGS84_EQUATORIAL_RADIUS
    polar_radius: float = WGS84_POLAR_RADIUS
    albedo: tuple[float, float, float, float] | None = None

    @property
    def radii(self) -> tuple[float, float, float]:
        """Semi-axes along the Earth-fixed x, y, z [m]."""
        return self.equatorial_radius, self.equatorial_radius, self.polar_radius
