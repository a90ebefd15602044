"""Flux of spacecraft of any size in the image, at any sampling, by closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.sample_grid import ANGLE
from simgl.simulator import Product, Simulator
from tests.radiometry.far_bodies import (
    ALBEDO,
    BOX,
    FOCAL_PX,
    PLATE,
    SPHERE,
    at,
    box_light,
    centre_of_light,
    light,
    place,
    sphere_light,
    view,
)
from tests.scenes import IN_BANDS, Table, lambert

GRID_DEG = float(np.degrees(ANGLE))

# A place between the pixels, in pixels from the corner in the middle of the image.
X, Y = 0.29, -0.27
SAMPLINGS = (5, None)


def sphere_flux(distance: float) -> float:
    """Sum of the radiance over pixels [W m-2 sr-1 px^2], at full phase on the axis."""
    return sphere_light(place(0.0, 0.0, distance), 0.0)[0]


@pytest.mark.parametrize("samples", SAMPLINGS)
@pytest.mark.parametrize("phase_deg", [0.0, 60.0, 120.0, 150.0])
def test_light_and_its_centre_are_right_at_any_size_phase_and_sampling(
    gl: moderngl.Context, phase_deg: float, samples: int | None
) -> None:
    """One per cent and 0.02 pixels are promised.

    At 150 deg 7 % of a sphere's outline are lit, and its polygons of 192 edges lose 0.2 % of that.
    """
    phase = np.radians(phase_deg)
    turn = Rotation.from_euler("yx", [25.0, -20.0], degrees=True)
    with Simulator(view({"body": at(SPHERE, 0.0, 0.0, 100.0)}), gl) as simulator:
        for size_px in (1e-4, 0.9, 3.6, 10.0, 36.0):
            distance = FOCAL_PX / size_px
            centre = place(X, Y, distance)
            cases: list[tuple[Table, tuple[float, Array], Table]] = [
                (SPHERE, sphere_light(centre, phase), {})
            ]
            quaternion = {"quaternion_icrf_from_body_xyzw": turn.as_quat().tolist()}
            if phase_deg < 90.0:
                cases.append((BOX, box_light(centre, turn, phase), quaternion))
            for body, (flux, middle), attitude in cases:
                scenario = view({"body": at(body, X, Y, distance) | attitude}, phase)
                image = light(simulator, scenario, samples)
                assert image.sum() == pytest.approx(flux, rel=0.01), size_px
                if size_px > 3.0:
                    assert np.hypot(*(centre_of_light(image) - middle)) < 0.02


@pytest.mark.parametrize("turn_deg", [0.0, GRID_DEG, 90.0 + GRID_DEG, 45.0])
def test_a_thin_target_keeps_its_light_however_it_lies(
    gl: moderngl.Context, turn_deg: float
) -> None:
    """A boom of 1 m and 2 mm, also along the rows of the turned sample grid."""
    boom = {"box": {"size_m": [1.0, 0.002, 0.002], "material": lambert(ALBEDO)}}
    turn = Rotation.from_euler("z", turn_deg, degrees=True).as_quat().tolist()
    with Simulator(view({"body": at(boom, 0.0, 0.0, 100.0)}), gl) as simulator:
        for size_px in (1e-3, 0.3, 0.9, 3.0):
            distance = FOCAL_PX / size_px
            body = at(boom, X, Y, distance) | {"quaternion_icrf_from_body_xyzw": turn}
            expected = IN_BANDS * ALBEDO / np.pi * 0.002 * (FOCAL_PX / (distance - 0.001)) ** 2
            assert light(simulator, view({"body": body})).sum() == pytest.approx(expected, rel=0.01)


def test_a_small_target_lies_in_its_pixels(gl: moderngl.Context) -> None:
    """Its centre of light is where it stands, also far off the axis and 1e7 radii away."""
    with Simulator(view({"body": at(SPHERE, 0.0, 0.0, 100.0)}, size=256), gl) as simulator:
        for size_px in (1e-4, 0.01, 0.3):
            for x, y in ((0.25, 0.7), (100.5, -90.4), (-126.6, 127.7)):
                scenario = view({"body": at(SPHERE, x, y, FOCAL_PX / size_px)}, size=256)
                found = light(simulator, scenario)
                rows, columns = np.nonzero(found)
                inside = max(abs(x % 1.0 - 0.5), abs(y % 1.0 - 0.5)) + 0.5 * size_px < 0.5
                if inside:
                    assert list(rows) == [128 + int(np.floor(y))]
                    assert list(columns) == [128 + int(np.floor(x))]
                assert found.sum() == pytest.approx(sphere_flux(FOCAL_PX / size_px), rel=0.01)


def test_on_the_border_of_two_pixels_each_has_half(gl: moderngl.Context) -> None:
    scenario = view({"body": at(SPHERE, 5.0, 7.5, FOCAL_PX / 0.1)})
    with Simulator(scenario, gl) as simulator:
        found = light(simulator, scenario)
    left, right = found[39, 36], found[39, 37]
    assert left + right == pytest.approx(found.sum())
    # A column of the raster, of some 64 across, is on one side or the other.
    assert left / right == pytest.approx(1.0, abs=0.04)


def test_a_distorting_lens_keeps_a_small_target(gl: moderngl.Context) -> None:
    """As bright, per solid angle, as the same body of five pixels, which is no small target."""
    lens: dict[str, Any] = {"optics": {"distortion": {"k1": -0.5}}}
    sums = []
    with Simulator(view({"body": at(SPHERE, 0.0, 0.0, 100.0)}, size=512, **lens), gl) as simulator:
        for size_px in (5.0, 0.3, 0.001):
            scenario = view(
                {"body": at(SPHERE, 200.2, 150.3, FOCAL_PX / size_px)}, size=512, **lens
            )
            sums.append(light(simulator, scenario).sum() / size_px**2)
    assert sums[1:] == pytest.approx([sums[0]] * 2, rel=0.005)


@pytest.mark.parametrize("samples", SAMPLINGS)
def test_a_small_target_hides_the_part_that_it_covers_and_shades(
    gl: moderngl.Context, samples: int | None
) -> None:
    """A black plate of 1.5 px, 3 m before a white one of 3 px, in front of one of its edges.

    The Sun is behind the camera: what is in the shadow is hidden as well, and counts once.
    """
    size_px, away = 3.0, FOCAL_PX / 3.0
    black = {"plate": {"width_m": 0.5, "height_m": 0.5, "material": lambert(0.0)}}
    bodies = {"white": at(PLATE, X, Y, away), "black": at(black, X + 1.5, Y, away - 3.0)}
    covered = 0.5 * (0.5 * FOCAL_PX / (away - 3.0)) ** 2
    expected = IN_BANDS * ALBEDO / np.pi * (size_px**2 - covered)
    with Simulator(view(bodies), gl) as simulator:
        assert light(simulator, view(bodies), samples).sum() == pytest.approx(expected, rel=0.01)


def test_what_stands_before_a_small_target_hides_it(gl: moderngl.Context) -> None:
    """A plate of 340 px, a ball of 0.05 px: behind it, beside it and before it."""
    plate = {"plate": at(PLATE, 0.0, 0.0, 10.0)}
    far = FOCAL_PX / 0.05
    ball = {"sphere": {"radius_m": 5e-6, "material": lambert(1.0)}}
    near = 1e-5 * FOCAL_PX / 0.05
    with Simulator(view({**plate, "ball": at(SPHERE, 0, 0, far)}, size=512), gl) as simulator:
        alone = light(simulator, view(plate, size=512))
        hidden = light(simulator, view({**plate, "ball": at(SPHERE, 0.2, 0.3, far)}, size=512))
        beside = light(simulator, view({**plate, "ball": at(SPHERE, 200.2, 0.3, far)}, size=512))
    np.testing.assert_array_equal(hidden, alone)
    assert (beside - alone).sum() == pytest.approx(sphere_flux(far), rel=0.01)
    with Simulator(view({**plate, "ball": at(ball, 0, 0, near)}, size=512), gl) as simulator:
        before = light(simulator, view({**plate, "ball": at(ball, 0.2, 0.3, near)}, size=512))
    # The plate's share of the pixel, and the ball's own light of twice the albedo.
    row, column = np.argwhere(before != alone)[0]
    radiance = alone[row, column]
    disc = np.pi / 4.0 * 0.05**2
    expected = radiance * disc * (2.0 * 2.0 / 3.0 - 1.0)
    assert before[row, column] - radiance == pytest.approx(expected, rel=0.03)
    assert np.count_nonzero(before != alone) == 1


def test_two_small_targets_in_one_pixel_add_up(gl: moderngl.Context) -> None:
    far = FOCAL_PX / 0.02
    places: Sequence[tuple[float, float]] = ((0.2, 0.3), (0.7, 0.6), (0.71, 0.605))
    bodies = {
        f"b{index}": at(SPHERE, x, y, far * (1.0 + 0.001 * index))
        for index, (x, y) in enumerate(places)
    }
    scenario = view(bodies)
    with Simulator(scenario, gl) as simulator:
        found = light(simulator, scenario)
        truth = simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", {Product.TRUTH}).truth
    assert np.count_nonzero(found) == 1
    # The third hides a part of the second: 1 of 6.3 of a disc's area or so at a distance of 0.56
    # diameters, by the formula of two circles.
    half = 0.5 * np.hypot(0.01, 0.005) / 0.01
    overlap = 2.0 / np.pi * (np.arccos(half) - half * np.sqrt(1.0 - half**2))
    shares = sum(1.0 / (1.0 + 0.001 * index) ** 2 for index in range(3))
    low, high = (sphere_flux(far) * (shares - k * overlap) for k in (1.5, 0.3))
    assert low < found.sum() < high
    assert truth is not None
    assert truth.depth.max() == 0.0
