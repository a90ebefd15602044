"""Places and light through wide and strongly distorting lenses, against OpenCV's formulae."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.distortion import relative_illumination
from simgl.camera.projections import DoubleSphere
from tests.passes.calibrated_targets import projection, spheres
from tests.scenes import radiance

_SIZE = 640, 480
# The rational factor that is the arc of a tangent over it, to 1e-4 up to 69 deg.
_RATIONAL = {
    "k1": 0.87665475,
    "k2": 0.14557415,
    "k3": 0.00232087,
    "k4": 1.20995887,
    "k5": 0.34917968,
    "k6": 0.01859485,
}
_PRISM = {"p1": 8e-4, "p2": -6e-4, "s1": 5e-4, "s2": -2e-4, "s3": 3e-4, "s4": 1e-4}
_TILT = {"tau_x": 0.02, "tau_y": -0.015}


def _lens(fx: float, fy: float, centre: tuple[float, float], **keys: float | str) -> dict[str, Any]:
    camera: dict[str, Any] = {"focal_length_px": [fx, fy], "principal_point_px": list(centre)}
    if "skew" in keys:
        camera["skew_px"] = keys.pop("skew")
    if keys:
        camera["optics"] = {"distortion": keys}
    return camera


LENSES = {
    # 129 deg from corner to corner.
    "rational, prism and tilt": _lens(362.0, 365.0, (331.3, 230.7), **_RATIONAL, **_PRISM, **_TILT),
    "barrel": _lens(400.0, 400.0, (320.0, 240.0), k1=-0.28, k2=0.09, k3=-0.012),
    "mustache": _lens(340.0, 338.0, (300.0, 260.0), k1=-0.22, k2=0.20, k3=-0.02),
    "pincushion": _lens(420.0, 425.0, (320.0, 240.0), k1=0.25, k2=0.05, p1=0.002, p2=0.003),
    "unequal": _lens(300.0, 520.0, (150.0, 400.0), skew=40.0, k1=-0.12, k2=0.02),
    "no distortion": _lens(280.0, 500.0, (500.0, 100.0), skew=60.0),
    # To 175 and 167 deg off the boresight.
    "fisheye": _lens(
        118.0, 118.5, (315.3, 243.7), model="fisheye", k1=0.02, k2=-0.006, k3=8e-4, k4=-5e-5
    ),
    "skewed fisheye": _lens(
        160.0, 150.0, (300.3, 250.7), skew=3.0, model="fisheye", k1=-0.05, k2=0.008, k3=-6e-4
    ),
    "unequal fisheye": _lens(
        260.0, 420.0, (420.0, 120.0), skew=-15.0, model="fisheye", k1=0.01, k2=-0.003
    ),
    # To 120 and 86 deg.
    "double sphere": _lens(
        150.0, 151.0, (325.0, 235.0), model="double_sphere", xi=-0.25, alpha=0.6
    ),
    "near sphere": _lens(330.0, 300.0, (280.0, 200.0), model="double_sphere", xi=0.3, alpha=0.5),
}
# W m-2 sr-1 in each band, the same in all directions.
_GLOW = 3.0


def _area(project: Callable[[Array], Array], rays: Array) -> Array:
    """(...,) pixels per steradian at unit rays (..., 3), by differences."""
    step, side = 1e-5, np.cross(rays, [0.3, 0.5, 0.7])
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    along, across = (
        (project(rays + step * way) - project(rays - step * way)) / (2.0 * step)
        for way in (side, np.cross(rays, side))
    )
    return np.abs(along[..., 0] * across[..., 1] - along[..., 1] * across[..., 0])


def _disc(project: Callable[[Array], Array], sphere: Array) -> tuple[Array, float]:
    """Of an evenly bright sphere, its centre in the image and the image's area [px^2]."""
    distance = float(np.linalg.norm(sphere[:3]))
    view = sphere[:3] / distance
    right = np.cross(view, [0.2, 0.7, 0.4])
    right /= np.linalg.norm(right)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    turn = 2.0 * np.pi * (np.arange(96) + 0.5) / 96
    # Even in the cosine: that is solid angle.
    depth = 1.0 - np.sqrt(1.0 - (sphere[3] / distance) ** 2)
    cosine = 1.0 - depth * 0.5 * (nodes + 1.0)
    around = np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * np.cross(view, right)
    rays = cosine[:, None, None] * view + np.sqrt(1.0 - cosine**2)[:, None, None] * around
    area = _area(project, rays) * (depth * 0.5 * weights)[:, None] * (2.0 * np.pi / 96)
    return np.tensordot(area, project(rays), 2) / area.sum(), float(area.sum())


def _places(camera: Camera) -> Array:
    """(n, 2) pixels over the whole field around which the lens sees a target."""
    columns, rows = np.linspace(0.06, 0.94, 6) * _SIZE[0], np.linspace(0.07, 0.93, 5) * _SIZE[1]
    places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2) + 0.37
    around = places[:, None] + [[0, 0], [14, 0], [-14, 0], [0, 14], [0, -14]]
    return places[np.isfinite(camera.rays(around)).all(axis=(1, 2))]


@pytest.mark.parametrize("name", LENSES)
def test_targets_have_their_place_and_their_light(gl: moderngl.Context, name: str) -> None:
    keys = LENSES[name]
    camera = spheres(keys, np.array([[320.0, 240.0]]))[0].cameras["cam"]
    project, places = projection(camera), _places(camera)
    assert len(places) >= 26
    glowing = {"reflectance": 0.0, "emission_w_m2_sr": _GLOW}
    scenario, targets = spheres(keys, places, glowing)
    rays = camera.rays(places)
    np.testing.assert_allclose(project(rays), places, atol=1e-9)
    light = radiance(gl, scenario)[..., 1].astype(np.float64)
    y, x = np.mgrid[: _SIZE[1], : _SIZE[0]] + 0.5
    off, missing = [], []
    for place, target in zip(places, targets, strict=True):
        near = np.where(np.hypot(x - place[0], y - place[1]) < 24.0, light, 0.0)
        centre, area = _disc(project, target)
        found = np.array([np.sum(near * x), np.sum(near * y)]) / near.sum()
        off.append(float(np.hypot(*(found - centre))))
        missing.append(float(near.sum() / (_GLOW * area)) - 1.0)
    # Some 100 samples a pixel, 0.1 px apart: each of the 220 on the limb may miss 0.3 of that.
    # 0.1 x 0.3 x sqrt(220) x 0.1 x 3.5 / 38 = 0.004 px; of the area 1e-3.
    assert np.sqrt(np.mean(np.square(off))) < 0.005
    assert max(off) < 0.0125
    assert np.abs(missing).max() < 1e-3


@pytest.mark.parametrize("name", LENSES)
def test_a_pixel_gets_the_light_of_its_solid_angle(name: str) -> None:
    """Before a pinhole's flat pupil times the cosine: cos^4 without distortion."""
    camera = spheres(LENSES[name], np.array([[320.0, 240.0]]))[0].cameras["cam"]
    found = relative_illumination(camera)
    rows, columns = np.mgrid[3 : _SIZE[1] : 31, 5 : _SIZE[0] : 37]
    rays = camera.rays(np.stack([columns, rows], axis=-1) + 0.5)
    sees = np.isfinite(rays[..., 0]) & (found[rows, columns] > 0.0)
    rays = rays[sees] / np.linalg.norm(rays[sees], axis=-1, keepdims=True)
    project, lens = projection(camera), camera.lens.distortion
    # Of a pixel as high as it is wide, on the boresight of the same lens.
    scale = 1.0 / (1.0 + lens.xi) if isinstance(lens, DoubleSphere) else 1.0
    expected = (scale * camera.focal_length_px) ** 2 / _area(project, rays)
    if lens is None or not lens.pupil_turns:
        expected *= rays[:, 2]
    # Differences over 1e-5 of three derivatives of up to 1e3, and float32.
    np.testing.assert_allclose(found[rows, columns][sees], expected, rtol=1e-4)
