"""Small targets before calibrated cameras, and where OpenCV puts their light."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable
from typing import Any

import moderngl
import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.scenario.scenario import Scenario
from tests.camera.test_projections import BROWN, FISHEYE, PRISM, TILTED
from tests.scenes import lambert, radiance, scene

Array = np.ndarray[Any, np.dtype[Any]]

DISTANCE = 10.0
OFF_CENTRE = {"principal_point_px": [331.3, 230.7]}
OPENCV_ORDER = "k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y".split()  # noqa: SIM905
CAMERAS: dict[str, dict[str, Any]] = {
    "skew": {"focal_length_px": [600.0, 630.0], "skew_px": 20.0, **OFF_CENTRE},
    "tilted": {
        "focal_length_px": [500.0, 510.0],
        **OFF_CENTRE,
        "optics": {"distortion": BROWN | PRISM | TILTED},
    },
    # These see up to 61 and 65 deg off the axis.
    "fisheye": {
        "focal_length_px": [350.0, 352.0],
        **OFF_CENTRE,
        "optics": {"distortion": {"model": "fisheye", **FISHEYE}},
    },
    # To 117 deg off the axis; OpenCV's own formula ends at 90.
    "wide fisheye": {
        "focal_length_px": [190.0, 191.0],
        **OFF_CENTRE,
        "optics": {"distortion": {"model": "fisheye", "k1": 0.01, "k2": -0.002}},
    },
    "double sphere": {
        "focal_length_px": [270.0, 271.0],
        **OFF_CENTRE,
        "optics": {"distortion": {"model": "double_sphere", "xi": -0.2, "alpha": 0.55}},
    },
}


def spheres(
    keys: dict[str, Any], places: Array, material: dict[str, Any] | None = None
) -> tuple[Scenario, Array]:
    """Spheres 7 pixels wide around given pixels, and (n, 4) their centres and radii [m].

    material : grey paint where None; the Sun is behind the camera at the origin
    """
    camera = {
        "position_icrf_m": [0, 0, 0],
        "boresight": [0, 0, 1],
        "up": [0, -1, 0],
        "width_px": 640,
        "height_px": 480,
        **keys,
    }
    optics = scene({}, camera).cameras["cam"]
    rays = _unit(optics.rays(places))
    aside = _unit(np.cross(rays, [0.3, 0.9, 0.1]))
    step = optics.project(rays + 1e-4 * aside) - optics.project(rays)
    # One size for all: one mesh.
    radius = float(np.mean(DISTANCE * 3.5 * 1e-4 / np.linalg.norm(step, axis=1)))
    made = {
        f"ball{i}": {
            "model": {"sphere": {"radius_m": radius, "material": material or lambert(0.8)}},
            "position_icrf_m": (DISTANCE * ray).tolist(),
        }
        for i, ray in enumerate(rays)
    }
    scenario = scene(
        made, camera, sun_direction=(0.0, 0.0, -1.0), render={"inter_reflection": False}
    )
    return scenario, np.column_stack([DISTANCE * rays, np.full(len(rays), radius)])


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def projection(camera: Camera) -> Callable[[Array], Array]:
    """Rays (..., 3) to pixels, by OpenCV where it has the model."""
    lens, matrix = camera.lens.distortion, camera.intrinsics
    plane = _in_plane(lens)
    # Here, for of skew OpenCV knows nothing.
    return lambda rays: plane(rays) @ matrix[:2, :2].T + matrix[:2, 2]


def _in_plane(lens: Projection | None) -> Callable[[Array], Array]:
    """Rays (..., 3) to points (..., 2) of the normalised image plane."""
    if lens is None:
        return lambda rays: rays[..., :2] / rays[..., 2:]
    if isinstance(lens, DoubleSphere):
        return lambda rays: _double_sphere(rays, lens.xi, lens.alpha)
    assert isinstance(lens, Distortion | Fisheye)
    its, unit, zero = dataclasses.asdict(lens), np.eye(3), np.zeros(3)
    cv2 = importlib.import_module("cv2")
    fisheye = isinstance(lens, Fisheye)
    order = [f"k{i}" for i in range(1, 5)] if fisheye else OPENCV_ORDER
    values = np.array([its[key] for key in order])
    of = cv2.fisheye if fisheye else cv2

    def project(rays: Array) -> Array:
        points = np.ascontiguousarray(rays.reshape(-1, 1, 3))
        found, _ = of.projectPoints(points, zero, zero, unit, values)
        points = found.reshape(*rays.shape[:-1], 2)
        return np.where(rays[..., 2:] > 0.0, points, behind(rays)) if fisheye else points

    def behind(rays: Array) -> Array:
        """OpenCV's formula with the angle itself in place of the arc of its tangent."""
        across = np.hypot(rays[..., 0], rays[..., 1])
        angle = np.arctan2(across, rays[..., 2])
        radius = angle * (1.0 + sum(k * angle ** (2 * i) for i, k in enumerate(values, 1)))
        return rays[..., :2] * (radius / across)[..., None]

    return project


def _double_sphere(rays: Array, xi: float, alpha: float) -> Array:
    """Usenko et al. 2018, equations 40 to 45."""
    x, y, z = np.moveaxis(rays, -1, 0)
    d1 = np.sqrt(x * x + y * y + z * z)
    d2 = np.sqrt(x * x + y * y + (xi * d1 + z) ** 2)
    return rays[..., :2] / (alpha * d2 + (1.0 - alpha) * (xi * d1 + z))[..., None]


def centre_of_light(camera: Camera, project: Callable[[Array], Array], sphere: Array) -> Array:
    """Of a Lambertian sphere that the Sun lights from behind the camera, in pixels, by quadrature.

    Each line of sight within its cone weighs as the radiance it meets and the image area it takes.
    """
    middle, radius = sphere[:3], sphere[3]
    view = _unit(middle)
    right = _unit(np.cross(view, [0.2, 0.7, 0.4]))
    down = np.cross(view, right)
    n = 120
    share = (np.arange(n) + 0.5) / n
    angle, turn = np.meshgrid(np.arcsin(radius / DISTANCE) * np.sqrt(share), 2.0 * np.pi * share)
    across = np.cos(turn)[..., None] * right + np.sin(turn)[..., None] * down
    rays = np.cos(angle)[..., None] * view + np.sin(angle)[..., None] * across
    along = rays @ middle
    depth = along - np.sqrt(along**2 - middle @ middle + radius**2)
    normal = (rays * depth[..., None] - middle) / radius
    weight = np.maximum(-normal[..., 2], 0.0)
    if camera.lens.distortion is None:
        weight = weight / rays[..., 2] ** 3
    else:
        weight = weight * camera.lens.distortion.area_per_steradian(rays)
    return np.tensordot(weight, project(rays), 2) / weight.sum()


def place_errors(gl: moderngl.Context, name: str) -> Array:
    """(12, 2) of the centres of light of targets over the whole field [px]."""
    columns, rows = np.linspace(0.06, 0.94, 4) * 640, np.linspace(0.07, 0.93, 3) * 480
    places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2) + 0.37
    scenario, targets = spheres(CAMERAS[name], places)
    camera = scenario.cameras["cam"]
    project = projection(camera)
    light = radiance(gl, scenario)[..., 1].astype(np.float64)
    y, x = np.mgrid[0:480, 0:640] + 0.5
    errors = []
    for place, target in zip(places, targets, strict=True):
        near = np.where(np.hypot(x - place[0], y - place[1]) < 12.0, light, 0.0)
        found = np.array([np.sum(near * x), np.sum(near * y)]) / near.sum()
        errors.append(found - centre_of_light(camera, project, target))
    return np.array(errors)
