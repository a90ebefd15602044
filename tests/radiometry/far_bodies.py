"""Spheres and boxes of any size in the image, and their light and its centre in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.scenario.scenario import Scenario
from simgl.scene.mesh import sphere
from simgl.simulator import Product, Simulator
from tests.scenes import IN_BANDS, Table, lambert, scene

# 13 mm over 3.75 um.
FOCAL_PX = 13e-3 / 3.75e-6
ALBEDO = 0.5
SPHERE: Table = {"sphere": {"radius_m": 0.5, "material": lambert(ALBEDO)}}
RADIUS = 0.5
BOX: Table = {"box": {"size_m": [1.0, 1.0, 1.0], "material": lambert(ALBEDO)}}
PLATE: Table = {"plate": {"width_m": 1.0, "height_m": 1.0, "material": lambert(ALBEDO)}}


def at(model: Table, x_px: float, y_px: float, distance: float) -> Table:
    """A body in view of a camera at the origin that looks along z, its image at (x, y) [px] from
    the middle."""
    return {"model": model, "position_icrf_m": place(x_px, y_px, distance).tolist()}


def view(bodies: dict[str, Table], phase: float = 0.0, size: int = 64, **camera: Any) -> Scenario:
    """Bodies lit by the Sun at a phase angle [rad] seen from a camera at the origin."""
    return scene(
        bodies,
        {
            "position_icrf_m": [0, 0, 0],
            "boresight": [0, 0, -1],
            "up": [0, 1, 0],
            "focal_length_mm": 13.0,
            "pixel_pitch_um": 3.75,
            "width_px": size,
            "height_px": size,
            **camera,
        },
        sun_direction=(float(np.sin(phase)), 0.0, float(np.cos(phase))),
        sun={"angular_diameter_deg": 0.01},
        render={"inter_reflection": False},
    )


def light(simulator: Simulator, scenario: Scenario, samples: int | None = None) -> Array:
    """(height, width) radiance over all bands [W m-2 sr-1]."""
    simulator.scenario = replace(scenario, samples_per_pixel=samples)
    state = scenario.at(scenario.epoch_tai_ns)
    frame = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
    assert frame is not None
    return frame.radiance.sum(axis=-1, dtype=np.float64)


def centre_of_light(image: Array) -> Array:
    """(2,) mean middle of a square image's pixels by their radiance, from the image's middle."""
    steps = np.arange(len(image)) + 0.5 - 0.5 * len(image)
    return np.array([image.sum(axis=0) @ steps, image.sum(axis=1) @ steps]) / image.sum()


def sun(phase: float) -> Array:
    """Unit vector to the Sun at a phase angle [rad], ICRF; the camera's -z."""
    return np.array([np.sin(phase), 0.0, np.cos(phase)])


def place(x_px: float, y_px: float, distance: float) -> Array:
    """Of what is seen at (x, y) [px] from the middle of the image [m]."""
    return np.array([x_px / FOCAL_PX * distance, -y_px / FOCAL_PX * distance, -distance])


def _summed(seen: Array, weight: Array) -> tuple[float, Array]:
    """Light of places (..., 3), and the mean middle of the pixels that see them."""
    pixels = np.floor(seen[..., :2] / -seen[..., 2:] * FOCAL_PX * [1.0, -1.0]) + 0.5
    total = float(weight.sum())
    middle = np.array([(weight * pixels[..., 0]).sum(), (weight * pixels[..., 1]).sum()])
    return IN_BANDS * ALBEDO / np.pi * total, middle / total


def sphere_light(centre: Array, phase: float) -> tuple[float, Array]:
    """Of a Lambertian sphere: sum of the radiance over pixels [W m-2 sr-1 px^2], and the centre of
    light of the image in pixels from its middle.

    Quadrature over lines of sight within its cone: Gauss-Legendre outwards, even around.
    """
    distance = float(np.linalg.norm(centre))
    axis = centre / distance
    right = np.cross(axis, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    down = np.cross(axis, right)
    nodes, weights = np.polynomial.legendre.leggauss(160)
    # Sines of the angle from the axis are the sphere's radius over the distance at most.
    share = np.sin(0.25 * np.pi * (nodes + 1.0))
    step = 0.25 * np.pi * weights * np.cos(0.25 * np.pi * (nodes + 1.0))
    turn = 2.0 * np.pi * (np.arange(640) + 0.5) / 640
    sine = share * RADIUS / distance
    # From the direction to the camera, at the sphere's centre.
    outward = np.arcsin(share) - np.arcsin(sine)
    around = np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * down
    normal = np.sin(outward)[:, None, None] * around - np.cos(outward)[:, None, None] * axis
    seen = centre + RADIUS * normal
    # Solid angle: d(sine^2) / 2 / cosine of the angle, for each angle around.
    cosine = np.sqrt(1.0 - sine**2)
    solid = (RADIUS / distance) ** 2 * share * step / cosine * (2.0 * np.pi / 640)
    ray = seen / np.linalg.norm(seen, axis=-1, keepdims=True)
    area = solid[:, None] * FOCAL_PX**2 / (-ray[..., 2]) ** 3
    weight = area * np.maximum(normal @ sun(phase), 0.0)
    return _summed(seen, weight)


def facet_light(centre: Array, phase: float, parts: int = 12) -> tuple[float, Array]:
    """The same of the mesh that is drawn for a sphere, with its normals between corners.

    The limb of 192 segments lies up to 1.5e-4 of the radius off: of a crescent of 1000 px at phase
    150 deg that is a thousandth of the light, and 0.017 px of its centre. The mean of
    ``parts`` squared places on each triangle; pixels are small beside what is seen.
    """
    mesh = sphere(RADIUS)
    corners = mesh.positions[mesh.triangles] + centre
    normals = mesh.normals[mesh.triangles].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lit = np.any(normals @ sun(phase) > 0.0, axis=1)
    seen = lit & (np.einsum("ij,ij->i", across, corners[:, 0]) < 0.0)
    corners, normals, across = corners[seen], normals[seen], across[seen]
    total, moment = 0.0, np.zeros(2)
    i, j = np.divmod(np.arange(parts * parts), parts)
    upper = (np.stack([i, j], axis=-1) + 1.0 / 3.0)[i + j < parts]
    lower = (np.stack([i, j], axis=-1) + 2.0 / 3.0)[i + j < parts - 1]
    for u, v in np.concatenate([upper, lower]) / parts:
        weights = np.array([1.0 - u - v, u, v])
        place, normal = (np.einsum("k,nkj->nj", weights, each) for each in (corners, normals))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        area = -np.einsum("ij,ij->i", across, place) * 0.5 / parts**2
        weight = area * FOCAL_PX**2 / (-place[:, 2]) ** 3 * np.maximum(normal @ sun(phase), 0.0)
        total += float(weight.sum())
        moment += weight @ (place[:, :2] / -place[:, 2:] * FOCAL_PX * [1.0, -1.0])
    return IN_BANDS * ALBEDO / np.pi * total, moment / total


def box_light(centre: Array, R_icrf_from_body: Rotation, phase: float) -> tuple[float, Array]:
    """The same of a cube of 1 m: the faces towards the camera, each evenly bright."""
    steps = (np.arange(300) + 0.5) / 300 - 0.5
    a, b = np.meshgrid(steps, steps)
    places, weights = [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            on_face = np.insert(np.stack([a, b], axis=-1), axis, 0.5 * sign, axis=-1)
            normal = R_icrf_from_body.apply(sign * np.eye(3)[axis])
            seen = centre + (on_face.reshape(-1, 3) @ R_icrf_from_body.as_matrix().T)
            # The image area of a piece of the face [px^2].
            facing = -(seen @ normal) / 300**2 * FOCAL_PX**2 / (-seen[:, 2]) ** 3
            places.append(seen)
            weights.append(np.maximum(facing, 0.0) * max(float(normal @ sun(phase)), 0.0))
    return _summed(np.concatenate(places), np.concatenate(weights))
