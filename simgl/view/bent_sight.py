"""Where what lies beyond the Earth's air is seen through it: stars, and discs on the sky.

Images are those of green light; the dispersion of air moves those of other bands by 1 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simgl.arrays import Array, IndexArray, Mask
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.atmosphere import Air
from simgl.physics.eclipse import limb_angle, limb_angles
from simgl.physics.frames import angle_between, cross, norm
from simgl.physics.refraction import BentRays, rays_from_inside, rays_from_space
from simgl.scene.state import SceneState

_GREEN = 1
# Nothing is lifted by more, and limbs that differ by less bend alike within 0.2 % [rad].
LIFT, _ALIKE = 0.03, 1e-3
# Step for the share of a star's light that bending leaves together [rad]: 0.5 km of the limb's
# height at 400 km.
_STEP = 2e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class SeenDisc:
    """A disc on the sky as it is seen: a cone whose section is an ellipse.

    direction : (3,) unit, of its middle
    axes : (2, 3) unit, of its section, square to the direction
    half_angles : (2,) along these [rad]
    """

    direction: Array
    axes: Array
    half_angles: Array

    @classmethod
    def round(cls, direction: Array, angular_radius: float) -> SeenDisc:
        """Seen along straight rays."""
        first = cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
        first /= norm(first)
        axes = np.stack([first, cross(direction, first)])
        return cls(direction=direction, axes=axes, half_angles=np.full(2, angular_radius))


@dataclass(frozen=True, eq=False)
class BentSight:
    """A place's sight past the Earth through its air.

    position : (3,) from the Earth's centre in its axes [m]
    """

    air: Air
    radii: Array
    position: Array
    R_itrf_from_icrf: Array

    @classmethod
    def at(cls, state: SceneState, place: Array) -> BentSight | None:
        """Of a place (3,) in ICRF [m]; None where no air bends rays."""
        if state.earth is None or state.earth.earth.air is None:
            return None
        if not any(state.earth.earth.air.refractivity):
            return None
        turn = state.earth.R_itrf_from_icrf
        position = turn @ (place - state.earth.position)
        return cls(state.earth.earth.air, np.array(state.earth.earth.radii), position, turn)

    @cached_property
    def _distance(self) -> float:
        return norm(self.position)

    @cached_property
    def _height(self) -> float:
        """Above the sphere through the ellipsoid's point below."""
        return self._distance * (1.0 - 1.0 / norm(self.position / self.radii))

    @cached_property
    def _rays_inside(self) -> BentRays:
        radius = self._distance - self._height
        # Near the zenith, where a ray has no side to bend to, the last one stands for all.
        return rays_from_inside(self.air, radius, self._height, 0.0, np.pi - 0.03)

    def _rays(self, direction: Array, from_nadir: float) -> BentRays | None:
        """Near a direction (3,) in ICRF; None where the ray misses the air."""
        if self._height < AIR_TOP:
            return self._rays_inside
        if from_nadir > 0.5 * np.pi:
            return None
        limb = limb_angle(self.position, self.R_itrf_from_icrf @ direction, self.radii)
        radius = self._distance * float(np.sin(limb))
        if self._distance * np.sin(from_nadir) > radius + AIR_TOP:
            return None
        return rays_from_space(self.air, radius, self._distance)

    def disc(self, direction: Array, angular_radius: float) -> SeenDisc:
        """A round disc, flattened: its top and its bottom are exact."""
        nadir = -self.R_itrf_from_icrf.T @ self.position / self._distance
        middle = angle_between(nadir, direction)
        # Its top may be in the air where its middle is not.
        rays = self._rays(direction, middle - angular_radius)
        sideways = cross(nadir, direction)
        length = norm(sideways)
        if rays is None or length < 1e-9:
            return SeenDisc.round(direction, angular_radius)
        ends = middle + angular_radius * np.array([-1.0, 1.0])
        bottom, top = rays.seen_at(ends, _GREEN)
        seen = 0.5 * (bottom + top)
        upwards = cross(sideways / length, nadir)
        wider = np.sin(seen) / np.sin(middle)
        return SeenDisc(
            direction=np.cos(seen) * nadir + np.sin(seen) * upwards,
            axes=np.stack([sideways / length, np.cos(seen) * upwards - np.sin(seen) * nadir]),
            half_angles=np.array([wider * angular_radius, 0.5 * (top - bottom)]),
        )

    def points(self, directions: Array) -> tuple[Array, Array]:
        """(n, 3) directions of points, and (n,) the share of their light that bending leaves.

        directions : (n, 3) unit, along straight rays
        """
        seen, shares = directions.copy(), np.ones(len(directions))
        nadir = -self.R_itrf_from_icrf.T @ self.position / self._distance
        rows, off, groups = self._in_air(directions, directions @ nadir)
        if not rows.size:
            return seen, shares
        cosine = directions[rows] @ nadir
        upwards = directions[rows] - np.outer(cosine, nadir)
        sine = np.linalg.norm(upwards, axis=1)
        true = np.arctan2(sine, cosine)
        steps = (true - off)[:, None] + _STEP * np.array([-1.0, 0.0, 1.0])
        for those, rays in groups:
            steps[those] = rays.seen_at(steps[those], _GREEN)
        low, at, high = steps.T
        at = at + off
        level = upwards / sine[:, None]
        seen[rows] = np.outer(np.cos(at), nadir) + np.sin(at)[:, None] * level
        spread = (high - low) / (2.0 * _STEP) * np.sin(at) / sine
        shares[rows] = np.minimum(spread, 1.0)
        return seen, shares

    def _in_air(
        self, directions: Array, cosine: Array
    ) -> tuple[IndexArray, Array, list[tuple[Mask, BentRays]]]:
        """Rows (k,) of directions within the air; by how much (k,) the limb is off that of their
        group; and the groups, whose limbs are alike, as masks (k,) with the rays there.

        cosine : (n,) of their angles from nadir
        """
        if self._height < AIR_TOP:
            rows = np.flatnonzero(np.abs(cosine) < 1.0 - 1e-6)
            return rows, np.zeros(len(rows)), [(np.ones(len(rows), dtype=bool), self._rays_inside)]
        sizes = np.array([min(self.radii), max(self.radii) + AIR_TOP])
        low, high = np.arcsin(np.minimum(sizes / self._distance, 1.0))
        rows = np.flatnonzero((cosine < np.cos(max(low - LIFT, 0.0))) & (cosine > np.cos(high)))
        limbs = limb_angles(self.position, directions[rows] @ self.R_itrf_from_icrf.T, self.radii)
        steps = np.round(limbs / _ALIKE)
        groups = []
        for step in sorted(set(steps.tolist())):
            radius = self._distance * float(np.sin(step * _ALIKE))
            groups.append((steps == step, rays_from_space(self.air, radius, self._distance)))
        return rows, limbs - steps * _ALIKE, groups
