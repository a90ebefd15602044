"""What the Sun's shadow maps hold: one map around each spacecraft, and one of what the camera sees.

Light axes: z away from the Sun, x and y across, turned against the body's axes so that straight
edges of the craft cross the map's texels evenly. Heights are metres towards the Sun, from the
receiver's origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.physics.frames import cross
from simgl.rays import ray_tracer
from simgl.sample_grid import ANGLE
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, SceneState

# Texels along a map's edge.
SIZES = (512, 768, 1024, 1536, 2048)
# Of these, so many fall on the width of a pixel.
_TEXELS_PER_PIXEL = 3.0
# A close map is drawn where the whole one has fewer texels per pixel than this.
_ENOUGH = 2.0
# Heights in a map reach so many radii of the receiver, which keeps them good to 2e-3 of the radius.
# Casters beyond are flattened onto that height; those of the receiver's size cover 1 % of the Sun.
_HIGHEST = 2000.0
# A caster that covers less of the Sun's disc than this casts nothing.
_LEAST_SHARE = 1e-3
# Rays along the edges of the picture that find what it shows of a spacecraft.
_PROBES = (32, 24)


@dataclass(frozen=True, kw_only=True, eq=False)
class Caster:
    """A spacecraft in a shadow map, of the Sun or of a lamp.

    clip_from_body : (4, 4) float32
    """

    model: SpacecraftModel
    clip_from_body: Array32

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
        """Cells beside each other: of 8, 16, 32, 64 texels along an edge, and again of 64."""
        return self.size // 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadowView:
    """The shadow maps of one spacecraft.

    R_light_from_body : (3, 3) float32, rows: x, y across the light, height
    whole : around the spacecraft; receivers anywhere on it find their casters there
    close : of what the camera sees of it, where the whole map is too coarse for the picture
    """

    R_light_from_body: Array32
    whole: ShadowMap
    close: ShadowMap | None

    @property
    def maps(self) -> tuple[ShadowMap, ...]:
        """Those that there are."""
        return (self.whole,) if self.close is None else (self.whole, self.close)


@dataclass(frozen=True, kw_only=True)
class _Near:
    """A body near the light's path: pose relative to the receiver's light axes."""

    model: SpacecraftModel
    R_light_from_other: Array
    offset: Array


def shadow_view(
    state: SceneState, body: BodyState, camera: Camera, body_from_camera: Array
) -> ShadowView:
    """The maps that one spacecraft needs in a picture.

    body_from_camera : (4, 4)
    """
    sun = state.sun.seen_from(body.pose.position)
    R_light = _light_axes(body.pose.R_icrf_from_body.T @ sun.direction_icrf)
    tangent = float(np.tan(sun.angular_radius))
    casters = _casters(state, body, R_light, tangent)
    mesh = body.model.posed_mesh
    centre = R_light @ mesh.centre
    bottom = float(centre[2] - 1.01 * mesh.radius)
    top = max(
        float((c.R_light_from_other @ c.model.posed_mesh.centre + c.offset)[2])
        + 1.01 * c.model.posed_mesh.radius
        for c in casters
    )
    top = min(top, centre[2] + _HIGHEST * mesh.radius)
    # Light reaches a receiver through a cone: casters lie as far outside as the cone is wide.
    margin = (top - bottom) * tangent
    footprint = _nearest(mesh.centre, mesh.radius, body_from_camera) / camera.focal_length_px

    def fitted(middle: Array, half: float, footprint: float) -> ShadowMap:
        return _map(casters, R_light, middle, half, margin, (bottom, top), footprint)

    whole = fitted(centre[:2], 1.01 * mesh.radius, footprint)
    close = None
    if whole.texel * _ENOUGH > footprint:
        seen = _seen(body, camera, body_from_camera)
        if seen is not None:
            points, distance = seen
            footprint = distance / camera.focal_length_px
            if whole.texel * _ENOUGH > footprint:
                middle, half = _square(points @ R_light[:2].T, 1.01 * mesh.radius)
                close = fitted(middle, half, footprint)
    return ShadowView(
        R_light_from_body=np.asarray(R_light, dtype=np.float32), whole=whole, close=close
    )


def _light_axes(sun_body: Array) -> Array:
    """(3, 3) rows: x and y across the light, and towards the Sun."""
    across = cross(np.eye(3)[int(np.argmin(np.abs(sun_body)))], sun_body)
    across /= np.linalg.norm(across)
    other = cross(sun_body, across)
    x = np.cos(ANGLE) * across + np.sin(ANGLE) * other
    # Right-handed with z away from the Sun, like a camera that looks along the light.
    return np.stack([x, cross(-sun_body, x), sun_body])


def _casters(
    state: SceneState, receiver: BodyState, R_light: Array, tangent: float
) -> tuple[_Near, ...]:
    """All bodies whose shadow may touch the receiver."""
    pose, mesh = receiver.pose, receiver.model.posed_mesh
    R_light_from_icrf = R_light @ pose.R_icrf_from_body.T
    found = []
    for other in state.bodies.values():
        R = R_light_from_icrf @ other.pose.R_icrf_from_body
        offset = R_light_from_icrf @ (other.pose.position - pose.position)
        place = R @ other.model.posed_mesh.centre + offset - R_light @ mesh.centre
        reach = other.model.posed_mesh.radius + mesh.radius
        if np.hypot(place[0], place[1]) > reach + max(place[2], 0.0) * tangent:
            continue
        if place[2] < -reach:
            continue
        if other is not receiver:
            blur = (place[2] - mesh.radius) * tangent
            if blur > 0.0 and (other.model.posed_mesh.radius / blur) ** 2 < _LEAST_SHARE:
                continue
        found.append(_Near(model=other.model, R_light_from_other=R, offset=offset))
    return tuple(found)


def _map(
    casters: tuple[_Near, ...],
    R_light: Array,
    middle: Array,
    half: float,
    margin: float,
    heights: tuple[float, float],
    footprint: float,
) -> ShadowMap:
    """A map of a square about ``middle`` (2,) [m] with receivers within ``half`` of it [m]."""
    reach = half + margin
    wanted = 2.0 * reach * _TEXELS_PER_PIXEL / footprint
    size = next((s for s in SIZES if s >= wanted), SIZES[-1])
    # The filter reaches two texels beyond.
    reach *= size / (size - 4.0)
    bottom, top = heights
    clip_from_light = np.eye(4)
    clip_from_light[0, [0, 3]] = 1.0 / reach, -middle[0] / reach
    clip_from_light[1, [1, 3]] = 1.0 / reach, -middle[1] / reach
    # Depth grows downwards: -1 at the top, 1 at the bottom.
    clip_from_light[2, 2:] = -2.0 / (top - bottom), (top + bottom) / (top - bottom)
    drawn = []
    for caster in casters:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = caster.R_light_from_other, caster.offset
        clip = np.asarray(clip_from_light @ matrix, dtype=np.float32)
        drawn.append(Caster(model=caster.model, clip_from_body=clip))
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
        depth=top - bottom,
        inset=2.0 + margin / texel,
    )


def _nearest(centre: Array, radius: float, body_from_camera: Array) -> float:
    """Least distance from the camera to a bounding sphere [m], at least 1 % of its radius."""
    distance = float(np.linalg.norm(body_from_camera[:3, 3] - centre))
    return max(distance - radius, 0.01 * radius)


def _seen(body: BodyState, camera: Camera, body_from_camera: Array) -> tuple[Array, float] | None:
    """Points (n, 3) of a body that the picture shows, body axes [m], and the least distance [m]."""
    columns, rows = _PROBES
    x = np.linspace(0.0, camera.detector.width, columns)
    y = np.linspace(0.0, camera.detector.height, rows)
    pixels = np.stack([*(g.ravel() for g in np.meshgrid(x, y)), np.ones(columns * rows)])
    rays = np.linalg.solve(camera.intrinsics, pixels).T @ body_from_camera[:3, :3].T
    origins = np.repeat(body_from_camera[None, :3, 3], len(rays), axis=0)
    triangle, distance = ray_tracer(body.model.posed_mesh).hits(origins, rays)
    hit = triangle >= 0
    if not np.any(hit):
        return None
    return origins[hit] + distance[hit, None] * rays[hit], float(distance[hit].min())


def _square(points: Array, largest: float) -> tuple[Array, float]:
    """Middle (2,) and half edge of a square around points (n, 2), in coarse steps.

    The steps keep the square, and with it the drawn map, while the camera moves a little.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    # What lies between the probes at the picture's edge, and steps of the middle: 15 %.
    half = 1.15 * 0.5 * float(np.max(high - low)) + 1e-3 * largest
    half = min(float(2.0 ** (np.ceil(4.0 * np.log2(half)) / 4.0)), largest)
    step = half / 8.0
    return np.round(0.5 * (low + high) / step) * step, half
