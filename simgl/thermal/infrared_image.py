"""What a thermal camera sees: radiance of patches by temperature, the Earth, and space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, IndexArray, Mask
from simgl.physics.earth_infrared import Emission
from simgl.radiosity.gather_points import face_normals
from simgl.rays import ray_tracer
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.state import CameraState, SceneState
from simgl.thermal.body import ThermalBody, patches_met
from simgl.thermal.ground_seen import ground_radiance, ground_seen, infrared_air, sunlight_in
from simgl.thermal.heat_loads import heat_loads, light_of_sky, total_sunlight
from simgl.thermal.history import ThermalState
from simgl.thermal.network import SPACE_TEMPERATURE

# A surface below this emissivity is metal, whose emission does not fall off towards grazing.
_METAL = 0.3
# Reflections among patches; what is left after them is below 1 % of a percent for paints.
_BOUNCES = 8

Bodies = Mapping[str, tuple[ThermalBody, ThermalState]]


@dataclass(frozen=True, kw_only=True, eq=False)
class InfraredImage:
    """A camera's radiance image in one band.

    radiance : (h, w), mean over each pixel, in the unit of the emission asked for
    temperature : (h, w) of the surface in a pixel's middle [K]; not a number beyond spacecraft
    digest : of the thermal states of all spacecraft in it
    history : how these came about
    """

    radiance: Array
    temperature: Array
    digest: str
    history: str


def infrared_image(
    state: SceneState,
    camera: str,
    bodies: Bodies,
    band: tuple[float, float],
    emission: Emission,
    samples: int = 2,
) -> InfraredImage:
    """The image of a scene in a thermal band, by rays through the pixels.

    bodies : every spacecraft that is seen, with its temperatures
    band : [m], for the Earth's air
    emission : radiance of a black body in the band by temperature [K], in any unit
    samples : rays along each edge of a pixel, an odd number for one through its middle

    A patch sends emissivity times Planck's law, and reflects diffusely what the Earth, the Sun and
    other patches of its body send in the band. Emissivity by direction: of dielectrics falls as
    1 - (1 - cos)^5 with its hemispherical mean as given (Schlick's Fresnel term); metals have one
    value. Lenses that bend rays are followed; spacecraft do not mirror.
    """
    seen = state.cameras[camera]
    detector = seen.camera.detector
    shape = detector.height, detector.width
    row, column = (index.ravel() for index in np.indices(shape))
    middles = np.stack([column, row], axis=1).astype(np.float64) + 0.5
    lines, unseen = _lines_of_sight(seen, middles)
    radiance = _background(state, seen.position, lines, band, emission)
    radiance[unseen] = 0.0
    temperature = np.full(len(lines), np.nan)
    # Only pixels near a spacecraft need more than their middle.
    near = np.flatnonzero(_near_bodies(state, bodies, seen, lines) & ~unseen)
    steps = (np.arange(samples) + 0.5) / samples - 0.5
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    spread = np.asarray(middles[near, None] + offsets, dtype=np.float64)
    finer, beyond = _lines_of_sight(seen, spread.reshape(-1, 2))
    light = np.repeat(radiance[near], samples**2)
    kelvin, nearest = np.full(len(light), np.nan), np.full(len(light), np.inf)
    nearest[beyond] = 0.0
    for name, (body, thermal) in bodies.items():
        image = light, kelvin, nearest
        _draw(state, name, body, thermal, seen.position, finer, band, emission, image)
    radiance[near] = light.reshape(-1, samples**2).mean(axis=1)
    temperature[near] = kelvin.reshape(-1, samples**2)[:, samples**2 // 2]
    return InfraredImage(
        radiance=radiance.reshape(shape),
        temperature=temperature.reshape(shape),
        digest="+".join(thermal.digest for _, thermal in bodies.values()),
        history=", ".join(sorted({thermal.history for _, thermal in bodies.values()})),
    )


def _lines_of_sight(seen: CameraState, pixels: Array) -> tuple[Array, Mask]:
    """(k, 3) unit lines of sight in ICRF axes at pixel coordinates, and where the lens has none."""
    rays = seen.camera.rays(pixels)
    unseen: Mask = np.any(~np.isfinite(rays), axis=1)
    rays[unseen] = (0.0, 0.0, 1.0)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return rays @ seen.R_camera_from_icrf, unseen


def _near_bodies(state: SceneState, bodies: Bodies, seen: CameraState, lines: Array) -> Mask:
    """(k,) whether a pixel may see a spacecraft: within its bounding sphere or a pixel of it."""
    near = np.zeros(len(lines), dtype=np.bool_)
    for name in bodies:
        body = state.bodies[name]
        mesh = body.model.posed_mesh
        centre = body.pose.position + body.pose.R_icrf_from_body @ mesh.centre
        offset = centre - seen.position
        distance = float(np.linalg.norm(offset))
        if distance <= mesh.radius:
            return np.ones(len(lines), dtype=np.bool_)
        angle = np.arcsin(mesh.radius / distance) + 2.0 / seen.camera.focal_length_px
        near |= lines @ offset > distance * np.cos(angle)
    return near


def _background(
    state: SceneState, position: Array, lines: Array, band: tuple[float, float], emission: Emission
) -> Array:
    """(k,) radiance of the Earth and of space along lines of sight."""
    space = float(emission(np.array(SPACE_TEMPERATURE)))
    if state.earth is None:
        return np.full(len(lines), space)
    sun = state.sun.seen_from(state.earth.position)
    ground = ground_seen(lines, position, state.earth, sun.direction_icrf)
    air, total = infrared_air(state.earth, band), total_sunlight(sun.irradiance)
    light = ground_radiance(ground, state.tai_ns, air, emission, total)
    return np.where(ground.met, light, space)


def _draw(
    state: SceneState,
    name: str,
    body: ThermalBody,
    thermal: ThermalState,
    position: Array,
    lines: Array,
    band: tuple[float, float],
    emission: Emission,
    image: tuple[Array, Array, Array],
) -> None:
    """Put a spacecraft into the image's radiance, temperature and distance where it is nearest."""
    radiance, temperature, nearest = image
    seen = state.bodies[name]
    R_body_from_icrf = seen.pose.R_icrf_from_body.T
    eye = R_body_from_icrf @ (position - seen.pose.position)
    posed = seen.model.posed_mesh
    # Rays that pass its bounding sphere meet nothing.
    offset = eye - posed.centre
    along = lines @ (seen.pose.R_icrf_from_body @ offset)
    near = np.flatnonzero(offset @ offset - along * along <= (1.001 * posed.radius) ** 2)
    if len(near) == 0:
        return
    mesh = PosedMesh(mesh=body.mesh, joints=seen.model.joints, motion=posed.motion)
    ways = lines[near] @ R_body_from_icrf.T
    hit, distance = ray_tracer(mesh).hits(np.tile(eye, (len(near), 1)), ways)
    met = (hit >= 0) & (distance < nearest[near])
    chosen, triangle = near[met], hit[met].astype(np.int64)
    stored = _in_stored_axes(body, posed, triangle, ways[met])
    patch = patches_met(body, triangle, stored)
    cosine = np.abs(np.einsum("ij,ij->i", face_normals(body.mesh)[0][triangle], stored))
    emitted, reflected = _patch_light(body, state, thermal, band, emission)
    dielectric = body.emissivity[patch] >= _METAL
    # The hemispherical mean of 1 - (1 - cos)^5 is 20 / 21.
    by_direction = np.where(dielectric, 1.05 * (1.0 - (1.0 - cosine) ** 5), 1.0)
    emissivity = np.minimum(body.emissivity[patch] * by_direction, 1.0)
    radiance[chosen] = emissivity * emitted[patch] + (1.0 - emissivity) * reflected[patch]
    temperature[chosen] = thermal.temperatures[patch]
    nearest[chosen] = distance[met]


def _in_stored_axes(
    body: ThermalBody, posed: PosedMesh, triangle: IndexArray, ways: Array
) -> Array:
    """(k, 3) directions in body axes as they are to triangles before joints moved these."""
    if posed.motion is None:
        return ways
    group = body.group[body.patches.of_side[triangle]]
    return np.asarray(np.einsum("kji,kj->ki", posed.motion[group, :3, :3], ways))


def _patch_light(
    body: ThermalBody,
    state: SceneState,
    thermal: ThermalState,
    band: tuple[float, float],
    emission: Emission,
) -> tuple[Array, Array]:
    """(p,) black-body radiance of the patches, and the mean radiance that they reflect."""
    black = emission(thermal.temperatures[: body.patch_count])
    loads = heat_loads(body, state)
    incoming = loads.sunlight * sunlight_in(emission, 1.0)

    def radiances(lines: Array) -> Array:
        position = state.bodies[body.name].pose.position
        return _background(state, position, lines, band, emission)[:, None]

    incoming = incoming + light_of_sky(body, state, radiances)[:, 0]
    rho = 1.0 - body.emissivity
    light = incoming
    for _ in range(_BOUNCES):
        light = incoming + body.views.factors @ (np.pi * body.emissivity * black + rho * light)
    return black, light / np.pi
