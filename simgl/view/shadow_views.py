"""What the Sun's shadow maps hold: one map around each spacecraft, and one of what the camera sees.

Light axes: z towards the Sun, x and y across, turned against the body's axes so that straight
edges of the spacecraft cross the map's texels evenly. Heights are metres towards the Sun, from the
receiver's origin.

A map is drawn along a direction of a fixed grid in the body's axes, and serves all directions
of the Sun that are nearest to it: sunlight then leans against the map, and whoever reads it follows
the light aside as it rises. What a map holds depends on nothing that changes a little from frame to
frame.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.physics.frames import Pose, cross, norm, unit
from simgl.rays import ray_tracer
from simgl.sample_grid import ANGLE
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, SceneState, SunSeen
from simgl.view.depth_slices import NEAREST

# Texels along a map's edge.
SIZES = (512, 768, 1024, 1536, 2048)
# And those of scenarios that ask for more than ``_PLENTY`` samples per pixel.
_FINER_SIZES = (*SIZES, 3072, 4096)
# Of these, so many fall on the width of a pixel.
_TEXELS_PER_PIXEL = 3.0
# With more samples per pixel than this the texels limit how well a shadow's edge is placed: they
# become smaller as the samples do.
_PLENTY = 64.0
# Casters' heights are bounded in cells of so many texels along an edge, and so many cells around
# each (caster_level of shaders/surface/caster_bounds.glsl, there in texels).
CELL = 8
REACHES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
# A close map is drawn where the wide one has fewer texels per pixel than this.
_ENOUGH = 2.0
# Of both, what is enough where a body turns so far in sunlight while the shutter is open, four
# times the Sun's width, that no shadow has edges as sharp as those that the Sun casts [rad].
_BLURRED, _TURN_THAT_BLURS = 0.5, float(np.radians(2.0))
# Heights in a map reach so many radii of the receiver, which keeps them good to 2e-3 of the radius.
# Casters beyond are flattened onto that height; those of the receiver's size cover 1 % of the Sun.
_HIGHEST = 2000.0
# A caster that covers less of the Sun's disc than this casts nothing.
_MIN_FRACTION = 1e-3
# Step of the grid of directions, in radii of the Sun. Sunlight leans by at most 0.42 of them.
_DIRECTION_STEP = 0.6
# Places of bodies relative to each other are good to this [m]: rounding in an orbit is 1e-9 m.
_PLACE_STEP = 2.0**-20
# And turns [rad].
_TURN_STEP = 2.0**-24
# Rays along the edges of the image that find what it shows of a spacecraft.
_PROBES = (32, 24)


@dataclass(frozen=True, kw_only=True, eq=False)
class Caster:
    """A spacecraft in a shadow map, of the Sun or of a lamp.

    clip_from_body : (4, 4) float32
    both_sides : whether surfaces that face away from the light may be the first that it meets
    """

    model: SpacecraftModel
    clip_from_body: Array32
    both_sides: bool

    @property
    def key(self) -> bytes:
        """Equal keys mean that they leave the same in a map."""
        return self.model.outline.encode() + self.clip_from_body.tobytes()


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadowMap:
    """A parallel projection along the sunlight onto a square of texels.

    key : equal keys mean equal maps
    size : texels along an edge
    texel_from_body : (4, 4) float32, rows: column, row [texels], height [m], 1
    texel : edge of a texel [m]
    top, depth : height [m] where the map's depth is 0, and how far below depth is 1
    inset : receivers at least so many texels from the edge find all their casters in the map
    """

    key: bytes
    casters: tuple[Caster, ...]
    size: int
    texel_from_body: Array32
    texel: float
    top: float
    depth: float
    inset: float

    @property
    def bounds_width(self) -> int:
        """Cells beside each other: for each reach, and 8 times as large ones."""
        edge = self.size // CELL
        return len(REACHES) * edge + edge // 8


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadowView:
    """The shadow maps of one spacecraft.

    R_light_from_body : (3, 3) float32, rows: x, y across the light, height
    lean : (2,) float32, the Sun's light moves so far along x and y for each metre of height
    wide : around the spacecraft; receivers anywhere on it find their casters there
    close : of what the camera sees of it, where the wide map is too coarse for the image
    ahead : makes the maps of the nearest other direction of the grid, in the order of ``maps``: a
        Sun that goes on as it came needs them next
    ahead_of : that direction
    """

    R_light_from_body: Array32
    lean: Array32
    wide: ShadowMap
    close: ShadowMap | None
    ahead: Callable[[], tuple[ShadowMap, ...]]
    ahead_of: bytes

    @property
    def maps(self) -> tuple[ShadowMap, ...]:
        """Those that there are."""
        return (self.wide,) if self.close is None else (self.wide, self.close)


@dataclass(frozen=True, kw_only=True)
class _Near:
    """A body near the light's path: pose relative to the receiver's light axes."""

    model: SpacecraftModel
    R_light_from_other: Array
    offset: Array

    @cached_property
    def centre(self) -> Array:
        """(3,) of its bounding sphere, the receiver's light axes [m]."""
        return self.R_light_from_other @ self.model.posed_mesh.centre + self.offset

    @property
    def radius(self) -> float:
        """Of its bounding sphere [m]."""
        return self.model.posed_mesh.radius

    @property
    def top(self) -> float:
        """No part of it is higher [m]."""
        return float(self.centre[2]) + 1.01 * self.radius


@dataclass(frozen=True, kw_only=True, eq=False)
class TurnedFrom:
    """For what else the maps of a body that turns in sunlight are drawn.

    sun_body : (3,) unit, towards the light then
    body_from_camera : (4, 4) then
    turn : the light comes from within so much of that [rad]
    while_open : the body turns by so much while a row is exposed [rad]
    """

    sun_body: Array
    body_from_camera: Array
    turn: float
    while_open: float


def shadow_view(
    state: SceneState,
    body: BodyState,
    camera: Camera,
    sun: SunSeen,
    body_from_camera: Array,
    others: TurnedFrom | None = None,
    samples_per_pixel: float | None = None,
) -> ShadowView:
    """The maps that one spacecraft needs in an image.

    sun : its main light, Sun or Moon; the map is empty where that gives no light
    body_from_camera : (4, 4)
    others : what shares these maps; None for nothing
    samples_per_pixel : that the scenario asks for
    """
    sunlit = bool(sun.irradiance.any())
    sun_body = body.pose.R_icrf_from_body.T @ sun.direction_icrf
    radius = _coarse(sun.angular_radius)
    step = _DIRECTION_STEP * radius
    drawn_for, turn = sun_body, 0.0
    finer = 1.0 if samples_per_pixel is None else max(samples_per_pixel / _PLENTY, 1.0) ** 0.5
    fineness = finer
    if others is not None:
        drawn_for, turn, body_from_camera = others.sun_body, others.turn, others.body_from_camera
        fineness *= _BLURRED if others.while_open > _TURN_THAT_BLURS else 1.0
    nearest, next_nearest = _grid_directions(drawn_for, step)
    # Light reaches a receiver through a cone: casters lie as far outside as the cone is wide.
    cone = float(np.tan(radius + step / np.sqrt(2.0) + turn))
    sizes = SIZES if finer == 1.0 else _FINER_SIZES
    R_light = _light_axes(nearest)
    mesh = body.model.posed_mesh
    # The same for all directions of the Sun.
    seen_of_it = cache(lambda: _seen(body, camera, body_from_camera))

    def maps_along(R_light: Array) -> tuple[ShadowMap, ...]:
        casters = _casters(state, body, R_light, cone, float(np.tan(radius))) if sunlit else ()
        centre = R_light @ mesh.centre
        heights = float(centre[2] - 1.01 * mesh.radius), float(centre[2] + _HIGHEST * mesh.radius)
        focal = camera.focal_length_px * fineness
        footprint = _nearest(mesh.centre, mesh.radius, body_from_camera) / focal
        if not casters:
            footprint = np.inf

        def fitted(middle: Array, half: float, footprint: float) -> ShadowMap:
            return _map(casters, R_light, middle, half, cone, heights, footprint, sizes)

        wide = fitted(centre[:2], 1.01 * mesh.radius, footprint)
        if wide.texel * _ENOUGH > footprint:
            seen = seen_of_it()
            if seen is not None:
                points, distance = seen
                footprint = distance / focal
                if wide.texel * _ENOUGH > footprint:
                    middle, half = _square((R_light[:2] @ points.T).T, 1.01 * mesh.radius)
                    return wide, fitted(middle, half, footprint)
        return (wide,)

    wide, *close = maps_along(R_light)
    x, y, z = R_light @ sun_body
    return ShadowView(
        R_light_from_body=np.asarray(R_light, dtype=np.float32),
        lean=np.array([x / z, y / z], dtype=np.float32),
        wide=wide,
        close=close[0] if close else None,
        ahead=lambda: maps_along(_light_axes(next_nearest)),
        ahead_of=next_nearest.tobytes(),
    )


def _coarse(angular_radius: float) -> float:
    """At most 4.4 % above; the same all along an orbit, on which the Sun's distance varies."""
    return float(2.0 ** (np.ceil(16.0 * np.log2(angular_radius)) / 16.0))


def _grid_directions(direction: Array, step: float) -> tuple[Array, Array]:
    """The two nearest directions of the grid (3,): angles in steps on each face of a cube."""
    axis = int(np.argmax(np.abs(direction)))
    places = np.arctan(direction / abs(direction[axis])) / step
    places[axis] = 0.0
    nearest = np.round(places)
    component = int(np.argmax(np.abs(places - nearest)))
    other = nearest.copy()
    other[component] += np.copysign(1.0, places[component] - nearest[component])

    def towards(place: Array) -> Array:
        tangents = np.tan(step * place)
        tangents[axis] = np.sign(direction[axis])
        return unit(tangents)

    return towards(nearest), towards(other)


def _light_axes(sun_body: Array) -> Array:
    """(3, 3) rows: x and y across the light, and towards the Sun."""
    across = cross(np.eye(3)[int(np.argmin(np.abs(sun_body)))], sun_body)
    across /= norm(across)
    other = cross(sun_body, across)
    x = np.cos(ANGLE) * across + np.sin(ANGLE) * other
    # Right-handed with z away from the Sun, like a camera that looks along the light.
    return np.stack([x, cross(-sun_body, x), sun_body])


def _casters(
    state: SceneState, receiver: BodyState, R_light: Array, cone: float, disc: float
) -> tuple[_Near, ...]:
    """All bodies whose shadow may touch the receiver.

    cone, disc : tangents of the half angles within which light comes, and of the Sun's disc
    """
    pose, mesh = receiver.pose, receiver.model.posed_mesh
    R_body_from_icrf = pose.R_icrf_from_body.T
    near = []
    for other in state.bodies.values():
        R_body_from_other, offset = steady_pose(other.pose, R_body_from_icrf, pose.position)
        one = _Near(
            model=other.model,
            R_light_from_other=R_light @ R_body_from_other,
            offset=R_light @ offset,
        )
        place = one.centre - R_light @ mesh.centre
        reach = one.radius + mesh.radius
        if np.hypot(place[0], place[1]) > reach + max(place[2], 0.0) * cone:
            continue
        if place[2] < -reach:
            continue
        if other is not receiver:
            blur = (place[2] - mesh.radius) * disc
            if blur > 0.0 and (one.radius / blur) ** 2 < _MIN_FRACTION:
                continue
        near.append(one)
    return tuple(near)


def steady_pose(pose: Pose, R_frame_from_icrf: Array, origin: Array) -> tuple[Array, Array]:
    """R_frame_from_body (3, 3) and place (3,) [m] of a body in a frame about an origin in ICRF.

    In steps, for bodies that stand still to each other do so but for rounding.
    """
    R_frame_from_body = _in_steps(R_frame_from_icrf @ pose.R_icrf_from_body, _TURN_STEP)
    return R_frame_from_body, _in_steps(R_frame_from_icrf @ (pose.position - origin), _PLACE_STEP)


def _in_steps(values: Array, step: float) -> Array:
    # Zero has no sign, for maps are found by their bytes.
    return step * np.round(values / step) + 0.0


def _map(
    casters: tuple[_Near, ...],
    R_light: Array,
    middle: Array,
    half: float,
    cone: float,
    heights: tuple[float, float],
    footprint: float,
    sizes: tuple[int, ...],
) -> ShadowMap:
    """A map of a square about ``middle`` (2,) [m] with receivers within ``half`` of it [m].

    cone : tangent of the half angle within which light comes
    heights : lowest receiver, and highest that the map may reach [m]
    footprint : of a pixel on the spacecraft [m]
    sizes : that the map may have
    """
    bottom, highest = heights
    above = [
        c
        for c in casters
        if np.abs(c.centre[:2] - middle).max() < half + c.radius + max(c.top - bottom, 0.0) * cone
    ]
    top = min(max((c.top for c in above), default=bottom + 2.0 * half), highest)
    margin = (top - bottom) * cone
    reach = half + margin
    wanted = 2.0 * reach * _TEXELS_PER_PIXEL / footprint
    size = next((s for s in sizes if s >= wanted), sizes[-1])
    # The filter reaches two texels beyond.
    reach *= size / (size - 4.0)
    x, y = middle.tolist()
    depth = top - bottom
    clip_from_light = np.array(
        [
            [1.0 / reach, 0.0, 0.0, -x / reach],
            [0.0, 1.0 / reach, 0.0, -y / reach],
            # Depth grows downwards: -1 at the top, 1 at the bottom.
            [0.0, 0.0, -2.0 / depth, (top + bottom) / depth],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
    drawn = []
    for caster in above:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = caster.R_light_from_other, caster.offset
        clip = np.asarray(clip_from_light @ matrix, dtype=np.float32)
        sheets = caster.model.open_sheets
        drawn.append(Caster(model=caster.model, clip_from_body=clip, both_sides=sheets))
    texel = 2.0 * reach / size
    texel_from_body = np.eye(4)
    texel_from_body[:3, :3] = R_light
    texel_from_body[:2, :3] /= texel
    texel_from_body[:2, 3] = 0.5 * size - middle / texel
    digests = b"".join(c.key for c in drawn)
    return ShadowMap(
        key=size.to_bytes(4, "little") + digests,
        casters=tuple(drawn),
        size=size,
        texel_from_body=np.asarray(texel_from_body, dtype=np.float32),
        texel=texel,
        top=top,
        depth=depth,
        inset=2.0 + margin / texel,
    )


def _nearest(centre: Array, radius: float, body_from_camera: Array) -> float:
    """Least distance from the camera to a bounding sphere [m], at least 1 % of its radius."""
    distance = norm(body_from_camera[:3, 3] - centre)
    return max(distance - radius, 0.01 * radius)


def _seen(body: BodyState, camera: Camera, body_from_camera: Array) -> tuple[Array, float] | None:
    """Points (n, 3) of a body that the image shows, body axes [m], and the least depth [m]."""
    d = camera.detector
    rays = _probes(camera.intrinsics.tobytes(), d.width, d.height) @ body_from_camera[:3, :3].T
    # Nothing nearer is drawn: a camera may lie on the spacecraft that carries it.
    origins = body_from_camera[:3, 3] + NEAREST * rays
    triangle, distance = ray_tracer(body.model.posed_mesh).hits(origins, rays)
    hit = triangle >= 0
    if not np.any(hit):
        return None
    return origins[hit] + distance[hit, None] * rays[hit], NEAREST + float(distance[hit].min())


@lru_cache(maxsize=16)
def _probes(intrinsics: bytes, width: int, height: int) -> Array:
    """(n, 3) rays over an image to a depth of 1, camera axes."""
    columns, rows = _PROBES
    x, y = np.linspace(0.0, width, columns), np.linspace(0.0, height, rows)
    pixels = np.stack([*(g.ravel() for g in np.meshgrid(x, y)), np.ones(columns * rows)])
    rays = np.linalg.solve(np.frombuffer(intrinsics).reshape(3, 3), pixels).T
    rays.flags.writeable = False
    return np.asarray(rays)


def _square(points: Array, largest: float) -> tuple[Array, float]:
    """Middle (2,) and half edge of a square around points (n, 2), in coarse steps.

    The steps keep the square, and with it the drawn map, while the camera moves a little.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    # What lies between the probes at the image's edge, and steps of the middle: 15 %.
    half = 1.15 * 0.5 * float(np.max(high - low)) + 1e-3 * largest
    half = min(float(2.0 ** (np.ceil(4.0 * np.log2(half)) / 4.0)), largest)
    step = half / 8.0
    return np.round(0.5 * (low + high) / step) * step, half
