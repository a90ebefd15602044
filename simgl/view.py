"""From the float64 scene to what one camera draws, float32 and relative to the camera.

The one place where large coordinates are subtracted. Camera axes are used throughout (z boresight,
x right, y down); the projection puts row 0 of the picture at row 0 of the target.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simgl.errors import ConfigError
from simgl.lattice import PIXEL_CENTRES, Lattice, choose_lattice, turned_lattice
from simgl.scene.camera import Camera
from simgl.scene.earth import Earth
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import BodyState, CameraState, EarthState, SceneState

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

# Nothing closer to the pinhole than this is drawn [m].
NEAREST = 0.01
# One 24-bit depth buffer covers distances up to this ratio: steps of 4e-6 of the distance.
SLICE_RATIO = 64.0


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadowCaster:
    """A spacecraft in a shadow map.

    light_from_body : (4, 4) float32, to the map's clip space
    """

    model: SpacecraftModel
    light_from_body: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class ShadowView:
    """One shadow map, fitted to the spacecraft that receives it.

    key : equal keys mean equal maps
    light_from_body : (4, 4) float32, of the receiver
    half_size : of the map's cube [m]; what lies before it towards the Sun is flattened onto it
    """

    key: bytes
    casters: tuple[ShadowCaster, ...]
    light_from_body: Floats
    half_size: float


@dataclass(frozen=True, kw_only=True, eq=False)
class CraftView:
    """A spacecraft before the camera.

    instance : index in the scene, counted from 1 (0 is no spacecraft)
    camera_from_body : (4, 4) float32
    sun_direction : (3,) float32 unit, camera axes
    sun_irradiance : (4,) float32 [W m-2], the eclipse by the Earth included
    sun_angular_radius : [rad]
    """

    name: str
    instance: int
    model: SpacecraftModel
    camera_from_body: Floats
    sun_direction: Floats
    sun_irradiance: Floats
    sun_angular_radius: float
    shadow: ShadowView


@dataclass(frozen=True, kw_only=True, eq=False)
class Tile:
    """A rectangle of the image that holds spacecraft, drawn on its own sampling lattice.

    x, y, width, height : pixels
    slices : clip_from_camera (4, 4) float32 of each depth slice, farthest first
    """

    x: int
    y: int
    width: int
    height: int
    lattice: Lattice
    slices: tuple[Floats, ...]
    craft: tuple[CraftView, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanetView:
    """The Earth before the camera, in a space where it is the unit sphere.

    sphere_from_camera : (3, 3) float32, turns and stretches directions
    camera_in_sphere : (3,) float32, place of the pinhole
    outside : |camera|^2 - 1, taken in float64
    sun_direction_itrf : (3,) float32
    sun_irradiance : (4,) float32 at the Earth [W m-2]
    """

    earth: Earth
    sphere_from_camera: Floats
    camera_in_sphere: Floats
    outside: float
    sun_direction_itrf: Floats
    sun_irradiance: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameView:
    """Everything that the passes need for one picture.

    planet : None where there is no Earth, or none in the field of view
    sun_direction : (3,) float32, camera axes, from the camera
    sun_radiance : (4,) float32 of the disc [W m-2 sr-1]; zero where it is not drawn or out of view
    sun_angular_radius : [rad]
    """

    camera: Camera
    sun_direction: Floats
    sun_radiance: Floats
    sun_angular_radius: float
    planet: PlanetView | None
    tiles: tuple[Tile, ...]


def frame_view(
    state: SceneState,
    camera_name: str,
    *,
    sample_budget: int,
    samples_per_pixel: int | None = None,
) -> FrameView:
    """What one camera of the scene draws.

    sample_budget : geometry samples that a tile may take where ``samples_per_pixel`` is None

    Raises ConfigError where the camera is inside a body or the Earth.
    """
    camera = state.cameras[camera_name]
    seen = state.sun.seen_from(camera.position)
    visible = state.sun.visible and _in_field(camera, seen.direction_icrf, seen.angular_radius)
    planet = None if state.earth is None else _planet(state, state.earth, camera)
    fixed = None if samples_per_pixel is None else turned_lattice(samples_per_pixel)
    return FrameView(
        camera=camera.camera,
        sun_direction=_float32(camera.R_camera_from_icrf @ seen.direction_icrf),
        sun_radiance=_float32(seen.radiance if visible else np.zeros(4)),
        sun_angular_radius=seen.angular_radius,
        planet=planet,
        tiles=_tiles(state, camera, sample_budget, fixed),
    )


def truth_tile(view: FrameView) -> Tile | None:
    """One tile over the whole image with a single sample at each pixel's centre."""
    craft = tuple(c for tile in view.tiles for c in tile.craft)
    if not craft:
        return None
    d = view.camera.detector
    depths = np.concatenate([_hull_in_camera(c)[:, 2] for c in craft])
    return _tile((0, 0, d.width, d.height), craft, depths, view.camera, PIXEL_CENTRES)


def _float32(values: Array) -> Floats:
    return np.asarray(values, dtype=np.float32)


def _in_field(camera: CameraState, direction_icrf: Array, angular_radius: float) -> bool:
    """Whether a disc on the sky may touch the picture."""
    d = camera.camera.detector
    half_diagonal = np.arctan(0.5 * np.hypot(d.width, d.height) / camera.camera.focal_length_px)
    boresight = camera.R_camera_from_icrf[2]
    sine = np.linalg.norm(np.cross(boresight, direction_icrf))
    off_axis = np.arctan2(sine, np.dot(boresight, direction_icrf))
    # Nearly a pixel more than enough: a disc's edge is drawn over one.
    return bool(off_axis < half_diagonal + angular_radius + 1.0 / camera.camera.focal_length_px)


def _planet(state: SceneState, earth: EarthState, camera: CameraState) -> PlanetView | None:
    radii = np.array(earth.earth.radii)
    stretch = radii[0] / radii
    position = earth.R_itrf_from_icrf @ (camera.position - earth.position)
    in_sphere = position / radii
    outside = float(np.dot(in_sphere, in_sphere)) - 1.0
    if outside <= 0.0:
        raise ConfigError(
            f"[camera.{camera.camera.name}]",
            "position",
            f"is {-0.5 * outside * radii[0]:.0f} m below the Earth's surface",
        )
    distance = float(np.linalg.norm(position))
    towards_earth = (earth.position - camera.position) / distance
    largest = np.arcsin(min(float(radii.max()) / distance, 1.0))
    if not _in_field(camera, towards_earth, largest):
        return None
    R_itrf_from_camera = earth.R_itrf_from_icrf @ camera.R_camera_from_icrf.T
    sun = state.sun.seen_from(earth.position)
    return PlanetView(
        earth=earth.earth,
        sphere_from_camera=_float32(stretch[:, None] * R_itrf_from_camera),
        camera_in_sphere=_float32(in_sphere),
        outside=outside,
        sun_direction_itrf=_float32(earth.R_itrf_from_icrf @ sun.direction_icrf),
        sun_irradiance=_float32(sun.irradiance),
    )


def _hidden_by_earth(earth: EarthState | None, camera: Array, body: Array) -> bool:
    """Whether the straight line between two places runs through the Earth."""
    if earth is None:
        return False
    radii = np.array(earth.earth.radii)
    start = (earth.R_itrf_from_icrf @ (camera - earth.position)) / radii
    line = (earth.R_itrf_from_icrf @ (body - camera)) / radii
    nearest = np.clip(-np.dot(start, line) / np.dot(line, line), 0.0, 1.0)
    return bool(np.linalg.norm(start + nearest * line) < 1.0)


def _matrix(rotation: Array, translation: Array) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = translation
    return matrix


def _camera_from_body(camera: CameraState, body: BodyState) -> Array:
    R = camera.R_camera_from_icrf
    offset = R @ (body.pose.position - camera.position)
    return _matrix(R @ body.pose.R_icrf_from_body, offset)


def _refuse_inside(camera: CameraState, name: str, body: BodyState) -> None:
    mesh = body.model.mesh
    pinhole = body.pose.R_icrf_from_body.T @ (camera.position - body.pose.position)
    if np.linalg.norm(pinhole - mesh.centre) > mesh.radius:
        return
    if mesh.winding_number(pinhole) > 0.5:
        place = ", ".join(f"{v:.3f}" for v in pinhole)
        raise ConfigError(
            f"[camera.{camera.camera.name}]",
            "position",
            f'is inside the body of "{name}" (at {place} m in its axes)',
        )


def _craft(state: SceneState, camera: CameraState) -> list[CraftView]:
    views = []
    for index, (name, body) in enumerate(state.bodies.items()):
        _refuse_inside(camera, name, body)
        if _hidden_by_earth(state.earth, camera.position, body.pose.position):
            continue
        sun = state.sun.seen_from(body.pose.position)
        views.append(
            CraftView(
                name=name,
                instance=index + 1,
                model=body.model,
                camera_from_body=_float32(_camera_from_body(camera, body)),
                sun_direction=_float32(camera.R_camera_from_icrf @ sun.direction_icrf),
                sun_irradiance=_float32(sun.irradiance * state.sunlight(body.pose.position)),
                sun_angular_radius=sun.angular_radius,
                shadow=_shadow(state, body, sun.direction_icrf),
            )
        )
    return views


def _shadow(state: SceneState, receiver: BodyState, sun_direction_icrf: Array) -> ShadowView:
    """A parallel projection along the sunlight that just holds the receiver.

    Light axes: z away from the Sun, x and y any. Casters are all bodies whose bounding sphere,
    moved along the light, meets the receiver's.
    """
    pose, mesh = receiver.pose, receiver.model.mesh
    sun_body = pose.R_icrf_from_body.T @ sun_direction_icrf
    z = -sun_body
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    R_light_from_body = np.stack([x, np.cross(z, x), z])
    centre = R_light_from_body @ mesh.centre
    radius = 1.01 * mesh.radius
    casters = []
    for other in state.bodies.values():
        R = R_light_from_body @ pose.R_icrf_from_body.T @ other.pose.R_icrf_from_body
        offset = R_light_from_body @ (
            pose.R_icrf_from_body.T @ (other.pose.position - pose.position)
        )
        place = R @ other.model.mesh.centre + offset - centre
        reach = other.model.mesh.radius + radius
        if np.hypot(place[0], place[1]) > reach or place[2] > reach:
            continue
        casters.append((other.model, _matrix(R, offset)))
    clip_from_light = np.diag([1.0 / radius, 1.0 / radius, 1.0 / radius, 1.0])
    clip_from_light[:3, 3] = -centre / radius
    drawn = tuple(
        ShadowCaster(model=model, light_from_body=_float32(clip_from_light @ light_from_other))
        for model, light_from_other in casters
    )
    key = b"".join(c.model.mesh.digest.encode() + c.light_from_body.tobytes() for c in drawn)
    own = clip_from_light @ _matrix(R_light_from_body, np.zeros(3))
    return ShadowView(
        key=key,
        casters=drawn,
        light_from_body=_float32(own),
        half_size=radius,
    )


def _hull_in_camera(craft: CraftView) -> Array:
    m = craft.camera_from_body.astype(np.float64)
    return np.asarray(craft.model.mesh.hull @ m[:3, :3].T + m[:3, 3])


def _before_the_camera(hull: Array) -> Array:
    """Points whose hull is the part of a convex hull that lies at least ``NEAREST`` away."""
    near = hull[:, 2] < NEAREST
    if not np.any(near):
        return hull
    back, front = hull[near][:, None], hull[~near][None, :]
    # Where each line from a point in front to one behind crosses the nearest plane.
    share = (NEAREST - back[..., 2]) / (front[..., 2] - back[..., 2])
    crossing = back + share[..., None] * (front - back)
    return np.concatenate([hull[~near], crossing.reshape(-1, 3)])


def _pixel_box(hull: Array, camera: Camera) -> tuple[int, int, int, int] | None:
    """x0, y0, x1, y1 of the pixels that a hull can touch; None where it is out of view."""
    d = camera.detector
    if np.all(hull[:, 2] < NEAREST):
        return None
    hull = _before_the_camera(hull)
    xy = hull[:, :2] / hull[:, 2:] * camera.focal_length_px + 0.5 * np.array([d.width, d.height])
    limits = np.array([d.width, d.height])
    low = np.clip(np.floor(xy.min(axis=0)), 0, limits).astype(int)
    high = np.clip(np.ceil(xy.max(axis=0)), 0, limits).astype(int)
    if np.any(high <= low):
        return None
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def _tiles(
    state: SceneState, camera: CameraState, sample_budget: int, fixed: Lattice | None
) -> tuple[Tile, ...]:
    groups: list[tuple[tuple[int, int, int, int], list[tuple[CraftView, Array]]]] = []
    for craft in _craft(state, camera):
        hull = _hull_in_camera(craft)
        box = _pixel_box(hull, camera.camera)
        if box is None:
            continue
        members = [(craft, hull)]
        # Spacecraft whose boxes overlap may hide each other and share a tile.
        while overlapping := [g for g in groups if _overlap(g[0], box)]:
            for group in overlapping:
                groups.remove(group)
                box = _union(group[0], box)
                members = group[1] + members
        groups.append((box, members))
    tiles = []
    for box, members in groups:
        pixels = (box[2] - box[0]) * (box[3] - box[1])
        lattice = fixed or choose_lattice(pixels, sample_budget)
        depths = np.concatenate([hull[:, 2] for _, hull in members])
        tiles.append(_tile(box, tuple(c for c, _ in members), depths, camera.camera, lattice))
    return tuple(tiles)


def _overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _union(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def _tile(
    box: tuple[int, int, int, int],
    craft: tuple[CraftView, ...],
    depths: Array,
    camera: Camera,
    lattice: Lattice,
) -> Tile:
    x0, y0, x1, y1 = box
    width, height = x1 - x0, y1 - y0
    shift = np.array([[1.0, 0.0, -x0], [0.0, 1.0, -y0], [0.0, 0.0, 1.0]])
    raster_from_camera = lattice.raster_from_pixel(width) @ shift @ camera.intrinsics
    size = np.array(lattice.raster_size(width, height))
    rows = 2.0 * raster_from_camera / size[:, None] - np.array([0.0, 0.0, 1.0])
    slices = []
    for near, far in _depth_slices(depths):
        clip = np.zeros((4, 4))
        clip[:2, :3] = rows
        clip[2, 2:] = (far + near) / (far - near), -2.0 * far * near / (far - near)
        clip[3, 2] = 1.0
        slices.append(_float32(clip))
    return Tile(
        x=x0,
        y=y0,
        width=width,
        height=height,
        lattice=lattice,
        slices=tuple(slices),
        craft=craft,
    )


def _depth_slices(depths: Array) -> list[tuple[float, float]]:
    """Near and far of the depth slices that hold the given depths [m], farthest first."""
    near = max(float(depths.min()) * 0.999, NEAREST)
    far = max(float(depths.max()) * 1.001, 2.0 * near)
    count = int(np.ceil(np.log(far / near) / np.log(SLICE_RATIO)))
    edges = np.geomspace(near, far, count + 1)
    # Neighbours overlap by 1e-4, so that rounding leaves no crack between them.
    return [(float(a), float(b) * 1.0001) for a, b in pairwise(edges)][::-1]
