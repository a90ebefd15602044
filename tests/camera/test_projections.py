"""Projections: against OpenCV, against published formulae, and against their own inverses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.distortion import sight_lines
from simgl.camera.pinhole_fields import pinhole_fields
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.errors import ConfigError
from tests.camera.cameras import camera

Array = np.ndarray[Any, np.dtype[Any]]

TILTED = {"tau_x": 0.05, "tau_y": -0.08}
PRISM = {"s1": 0.01, "s2": -0.02, "s3": 0.005, "s4": 0.003}
RATIONAL = {"k4": 0.01, "k5": 0.02, "k6": -0.03}
BROWN = {"k1": -0.25, "k2": 0.08, "k3": -0.01, "p1": 0.001, "p2": -0.002}
FISHEYE = {"k1": -0.02, "k2": 0.003, "k3": -0.001, "k4": 0.0001}
# Its field is 128.6 deg off the axis, as of the lenses that its paper calibrates.
SPHERES = DoubleSphere(xi=-0.27, alpha=0.57)
PINHOLES = {
    "none": {},
    "brown": BROWN,
    "rational": BROWN | RATIONAL,
    "prism": BROWN | RATIONAL | PRISM,
    "tilted": BROWN | RATIONAL | PRISM | TILTED,
    "tilt alone": TILTED,
}


def lens_camera(lens: Projection | None, width: int = 640, height: int = 480) -> Camera:
    """With other focal lengths along rows and columns, and an off-centre principal point."""
    f = 420.0 * 3.75e-6
    offset = 11.3 * 3.75e-6, -7.6 * 3.75e-6
    return camera(
        width, height, distortion=lens, focal_length=f, aspect=1.02, principal_offset=offset
    )


def opencv_matrix(cam: Camera) -> Array:
    """OpenCV counts from the centre of the first pixel."""
    matrix = cam.intrinsics
    matrix[:2, 2] -= 0.5
    return matrix


@pytest.mark.parametrize("name", PINHOLES)
def test_a_pinholes_points_are_those_of_opencv(name: str) -> None:
    cv2 = pytest.importorskip("cv2")
    cam = lens_camera(Distortion(**PINHOLES[name]))
    # The lines of sight of the pixels themselves: the whole field.
    rays = sight_lines(cam)[::7, ::7].reshape(-1, 3)
    radial = "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"
    order = *radial, "s1", "s2", "s3", "s4", "tau_x", "tau_y"
    coefficients = np.array([PINHOLES[name].get(key, 0.0) for key in order])
    zero = np.zeros(3)
    expected, _ = cv2.projectPoints(3.0 * rays, zero, zero, opencv_matrix(cam), coefficients)
    pixels = cam.project(3.0 * rays)
    # float64 both; the goal is 0.01.
    np.testing.assert_allclose(pixels - 0.5, expected[:, 0], atol=1e-9)
    centres = np.stack(np.meshgrid(np.arange(640.0), np.arange(480.0)), -1)[::7, ::7] + 0.5
    # Lines of sight come from pixels of float32 in an image of a thousand pixels: half an ulp.
    np.testing.assert_allclose(pixels, centres.reshape(-1, 2), atol=1e-4)


def test_a_fisheyes_points_are_those_of_opencv() -> None:
    cv2 = pytest.importorskip("cv2")
    cam = lens_camera(Fisheye(**FISHEYE))
    # OpenCV projects what lies before the camera: here up to 85 deg off the axis.
    rng = np.random.default_rng(4)
    rays = rng.normal(size=(4000, 3))
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    rays = rays[rays[:, 2] > np.cos(np.radians(85.0))]
    zero, coefficients = np.zeros(3), np.array([FISHEYE[f"k{i}"] for i in range(1, 5)])
    expected, _ = cv2.fisheye.projectPoints(
        rays[:, None], zero, zero, opencv_matrix(cam), coefficients
    )
    np.testing.assert_allclose(cam.project(rays) - 0.5, expected[:, 0], atol=1e-9)


def test_an_equidistant_fisheye_goes_on_behind_the_camera() -> None:
    """By definition its radius is the angle, up to a full sphere; OpenCV stops before 90 deg."""
    angle = np.radians([0.0, 30.0, 89.0, 90.0, 100.0, 140.0, 179.0])
    rays = np.stack([np.sin(angle), np.zeros(7), np.cos(angle)], axis=-1)
    found = Fisheye().projected(rays)
    np.testing.assert_allclose(found, np.stack([angle, np.zeros(7)], axis=-1), atol=1e-12)


def test_a_double_sphere_follows_its_paper() -> None:
    """Usenko et al. 2018, equations 40 to 45, in their own order of steps."""
    rng = np.random.default_rng(5)
    rays = rng.normal(size=(3000, 3))
    x, y, z = rays.T
    xi, alpha = SPHERES.xi, SPHERES.alpha
    d1 = np.sqrt(x * x + y * y + z * z)
    d2 = np.sqrt(x * x + y * y + (xi * d1 + z) ** 2)
    depth = alpha * d2 + (1.0 - alpha) * (xi * d1 + z)
    found = SPHERES.projected(rays)
    sees = ~np.isnan(found[:, 0])
    np.testing.assert_allclose(
        found[sees], np.stack([x, y], -1)[sees] / depth[sees, None], rtol=1e-12
    )
    # It sees all that has a place in the plane (equation 50), but for the last few pixels.
    radius = np.hypot(*found[sees].T).max()
    assert radius < 1.0 / np.sqrt(2.0 * alpha - 1.0)
    w1 = (1.0 - alpha) / alpha
    w2 = (w1 + xi) / np.sqrt(2.0 * w1 * xi + xi * xi + 1.0)
    assert sees[z > -w2 * d1].all()


LENSES: dict[str, Projection] = {
    "pinhole": Distortion(**PINHOLES["tilted"]),
    "fisheye": Fisheye(**FISHEYE),
    "double sphere": SPHERES,
    "one sphere": DoubleSphere(xi=0.0, alpha=0.4),
}


@pytest.mark.parametrize("name", LENSES)
def test_every_point_has_the_ray_that_it_came_from(name: str) -> None:
    lens = LENSES[name]
    rng = np.random.default_rng(6)
    rays = rng.normal(size=(5000, 3))
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    widest = 30.0 if isinstance(lens, Distortion) else 118.0
    rays = rays[np.degrees(np.arccos(rays[:, 2])) < widest]
    assert len(rays) > 200
    back = lens.rays(lens.projected(rays))
    back /= np.linalg.norm(back, axis=-1, keepdims=True)
    np.testing.assert_allclose(back, rays, atol=1e-10)
    # Two small steps square to the ray and to each other span the area that it takes.
    side = np.cross(rays, [0.3, 0.5, 0.7])
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    edges = []
    for step in (1e-5 * side, 1e-5 * np.cross(rays, side)):
        edges.append((lens.projected(rays + step) - lens.projected(rays - step)) / 2e-5)
    area = np.abs(edges[0][:, 0] * edges[1][:, 1] - edges[0][:, 1] * edges[1][:, 0])
    # Of central differences: the square of the step times a third derivative, and round-off.
    np.testing.assert_allclose(lens.area_per_steradian(rays), area, rtol=1e-6)


def test_a_lens_that_sees_nothing_somewhere_says_so() -> None:
    narrow = Fisheye(k1=-0.3)  # its radius falls again from 61 deg on
    angle = np.radians([30.0, 59.0, 70.0])
    rays = np.stack([np.sin(angle), np.zeros(3), np.cos(angle)], axis=-1)
    assert np.isnan(narrow.projected(rays)[:, 0]).tolist() == [False, False, True]
    assert np.isnan(narrow.rays(np.array([[0.5, 0.0], [0.9, 0.0]]))[:, 0]).tolist() == [False, True]
    assert np.isnan(Distortion(k1=0.1).projected(np.array([0.1, 0.0, -1.0]))).all()


@pytest.mark.parametrize("name", LENSES)
def test_lines_of_sight_are_those_of_the_inverse_at_each_pixel(name: str) -> None:
    """They are interpolated from a few of them."""
    cam = lens_camera(LENSES[name])
    (found,) = pinhole_fields(cam)
    pixels = np.stack(np.meshgrid(np.arange(640.0), np.arange(480.0)), -1) + 0.5
    places = found.pinhole.project(cam.rays(pixels))
    # Half an ulp of float32 in images of up to 2048 pixels.
    np.testing.assert_allclose(found.places, places, atol=6.2e-5)
    # Solid angle by the corners of each pixel, beside that of one in the middle, 1 / f^2.
    corners = np.stack(np.meshgrid(np.arange(641.0), np.arange(481.0)), -1)
    at = cam.rays(corners)
    at /= np.linalg.norm(at, axis=-1, keepdims=True)
    turned = np.cross(at[1:, 1:] - at[:-1, :-1], at[1:, :-1] - at[:-1, 1:])
    f = found.pinhole.focal_length_px
    solid_angle = 0.5 * np.linalg.norm(turned, axis=-1) * f * f
    # A quadrilateral beside the derivative at its centre: the square of a pixel over the focal
    # length, 420 px, times derivatives of some tens near the edge of a wide field.
    np.testing.assert_allclose(found.solid_angle, solid_angle, rtol=2e-4)


WIDE = {
    "within one pinhole": (Fisheye(k1=-0.02), 420.0),
    "98 deg off the boresight": (Fisheye(), 240.0),
    "circle of 100 deg in the image": (Fisheye(k3=-2e-3), 130.0),
    "double sphere to 125 deg": (SPHERES, 150.0),
}


@pytest.mark.parametrize("name", WIDE)
def test_each_pixel_that_a_wide_lens_fills_is_drawn_through_one_pinhole(name: str) -> None:
    lens, f = WIDE[name]
    cam = lens_camera(lens)
    cam = replace(cam, lens=replace(cam.lens, focal_length=f * 3.75e-6))
    pixels = np.stack(np.meshgrid(np.arange(640.0), np.arange(480.0)), -1) + 0.5
    rays = cam.rays(pixels)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    fields = pinhole_fields(cam)
    drawn = np.sum([one.drawn for one in fields], axis=0)
    assert drawn.max() == 1
    # All but those at the rim, whose neighbour sees nothing.
    seen = np.isfinite(rays[..., 0])
    rim = seen & (drawn == 0)
    assert rim.sum() < 4 * np.pi * 240.0 * (not seen.all()) + 1
    assert not drawn[~seen].any()
    lines = sight_lines(cam)
    np.testing.assert_array_equal(np.isnan(lines[..., 0]), drawn == 0)
    # float32 pixels of pinhole images of up to a thousand pixels, of the focal length f.
    inside = drawn == 1
    assert np.abs(lines - rays)[inside].max() < 6.2e-5 / f
    for one in fields:
        assert one.places[one.drawn].min() >= one.reach
        size = one.pinhole.detector.width, one.pinhole.detector.height
        assert np.all(one.places[one.drawn] <= np.array(size) - one.reach)


def test_solid_angles_of_a_circular_fisheye_sum_to_its_cone() -> None:
    """100 deg to each side: 2 pi (1 - cos 100 deg), but for the rim."""
    f = 600.0 / (2.0 * np.pi)
    cam = lens_camera(Fisheye(), 620, 620)
    cam = replace(
        cam,
        lens=replace(
            cam.lens, focal_length=f * 3.75e-6, aspect=1.0, skew=0.0, principal_offset=(0.0, 0.0)
        ),
    )
    widest = np.radians(100.0)
    seen = pinhole_fields(cam)[0].solid_angle / f**2
    angle = np.arccos(sight_lines(cam)[..., 2])
    # The circle's edge cuts pixels at random: some 2000, each by half of itself, 1e-4 of all.
    assert seen[angle < widest].sum() == pytest.approx(2 * np.pi * (1 - np.cos(widest)), rel=3e-4)


@pytest.mark.parametrize(
    ("lens", "focal_length", "problem"),
    [
        (Distortion(k1=-0.9), 420.0, "folds the image"),
        (Distortion(k1=1e18), 420.0, "folds the image"),
        (Distortion(k1=-0.01), 30.0, "folds the image"),
        (Distortion(k1=1e-4), 30.0, "deg off the boresight, a pinhole below 85 deg; wider lenses"),
    ],
)
def test_a_distortion_that_no_pinhole_sees_is_refused(
    lens: Projection, focal_length: float, problem: str
) -> None:
    cam = lens_camera(lens)
    cam = replace(cam, lens=replace(cam.lens, focal_length=focal_length * 3.75e-6))
    with pytest.raises(ConfigError, match=problem):
        pinhole_fields(cam)


@pytest.mark.parametrize(
    ("lens", "fold"),
    [
        # 1 + 3 k1 r^2 = 0.
        (Distortion(k1=-0.3), np.sqrt(1.0 / 0.9)),
        # The picture goes on outwards again from r = 1.41, where 1 - 2.1 r^2 + 0.8 r^4 = 0 a second
        # time.
        (Distortion(k1=-0.7, k2=0.16), np.sqrt((2.1 - np.sqrt(2.1**2 - 3.2)) / 1.6)),
        # A pole: 1 + k4 r^2 = 0.
        (Distortion(k4=-0.3), np.sqrt(1.0 / 0.3)),
    ],
    ids=["turns back", "turns back and forth", "pole"],
)
def test_a_distortion_images_nothing_from_beyond_its_fold(lens: Distortion, fold: float) -> None:
    """OpenCV's formula brings it back into the image, where others are seen."""
    tangent = np.concatenate([np.linspace(0.0, 0.99 * fold, 50), np.linspace(1.01 * fold, 9, 50)])
    rays = np.stack([0.6 * tangent, 0.8 * tangent, np.ones(100)], axis=-1)
    found = lens.projected(rays)
    assert np.isnan(found[:, 0]).tolist() == [False] * 50 + [True] * 50
    # Each point has the ray that the lens brings there, not one of another branch. Next to a fold
    # the derivative is 0.01: what Newton's method leaves, 1e-10, moves the ray by 1e-8.
    back = lens.rays(found[:50])
    np.testing.assert_allclose(back, rays[:50], atol=1e-8)
