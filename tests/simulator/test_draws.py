"""Several images of one epoch: equal draws are equal to the bit, others have independent noise."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.scenario.scenario import Scenario
from simgl.simulator import Capture, Product, Simulator
from tests.scenes import lambert, scene

PLATE = {"plate": {"width_m": 4.0, "height_m": 4.0, "material": lambert(0.5)}}
LARGEST = 2**32 - 1


def scenario(**camera: object) -> Scenario:
    """A plate that fills the view and faces the Sun: 128 x 128 pixels of some 1,000 electrons."""
    return scene(
        {"plate": {"model": PLATE, "position_icrf_m": [0, 0, 0]}},
        {
            "position_icrf_m": [0, 0, 10],
            "look_at": "plate",
            "up": [0, 1, 0],
            "exposure_time_s": 1e-4,
            "prnu": 0.0,
            **camera,
        },
    )


def residual(capture: Capture) -> Array:
    """The noise of a capture [DN], less that of rows and columns, which is not of one pixel."""
    assert capture.digital is not None
    assert capture.electrons is not None
    camera = capture.digital.info.camera
    noise = capture.digital.dn - capture.electrons.electrons * camera.detector.gain_dn_per_e
    return np.asarray(noise - noise.mean(), dtype=np.float64).ravel()


def assert_uncorrelated(a: Array, b: Array) -> None:
    # Of independent samples the coefficient has a standard deviation of 1 / sqrt(N).
    assert abs(np.corrcoef(a, b)[0, 1]) < 4.0 / np.sqrt(a.size)


def test_the_images_of_a_bracket_have_independent_noise(gl: moderngl.Context) -> None:
    one = scenario()
    state, camera = one.at(one.epoch_tai_ns), one.cameras["cam"]
    times = [camera.exposure_time * factor for factor in (1.0, 1.0, 1.001, 1.2)]
    settings = [replace(camera, exposure_time=time) for time in times]
    products = {Product.DN, Product.ELECTRONS}
    with Simulator(one, gl) as simulator:
        images = simulator.bracket(state, "cam", settings, products)
        again = simulator.bracket(state, "cam", settings, products)
        later = simulator.bracket(state, "cam", settings[1:], products, first_draw=1)
    noise = [residual(image) for image in images]
    assert min(n.std() for n in noise) > 1.0
    for index in range(1, len(noise)):
        for other in range(index):
            assert_uncorrelated(noise[index], noise[other])
    for first, second in [*zip(images, again, strict=True), *zip(images[1:], later, strict=True)]:
        assert first.digital is not None
        assert second.digital is not None
        assert first.digital.dn.tobytes() == second.digital.dn.tobytes()


@pytest.mark.parametrize(
    "noise",
    [
        {},
        {"row_noise_e": 30.0},
        {"blooming": 0.5, "full_well_e": 500.0},
        {"particles": {"flux_cm2_s": 1e8}},
    ],
    ids=["plain", "rows", "blooming", "particles"],
)
def test_a_draw_is_repeated_by_its_number(gl: moderngl.Context, noise: dict[str, object]) -> None:
    one = scenario(**noise)
    state = one.at(one.epoch_tai_ns)
    with Simulator(one, gl) as simulator:

        def dn(draw: int) -> bytes:
            digital = simulator.capture(state, "cam", draw=draw).digital
            assert digital is not None
            return digital.dn.tobytes()

        first = [dn(draw) for draw in (0, 1, LARGEST)]
        assert [dn(draw) for draw in (0, 1, LARGEST)] == first
        plain = simulator.capture(state, "cam").digital
        assert plain is not None
        assert plain.dn.tobytes() == first[0]
    assert len(set(first)) == 3


def test_a_flash_lidar_draws_too(gl: moderngl.Context) -> None:
    one = scenario(lidar={"pulse_energy_mj": 0.01})
    state = one.at(one.epoch_tai_ns)
    with Simulator(one, gl) as simulator:
        frames = [
            simulator.capture(state, "cam", {Product.LIDAR}, draw=draw).lidar for draw in (0, 1, 1)
        ]
    zero, one_, again = (frame.electrons for frame in frames if frame is not None)
    assert one_.tobytes() == again.tobytes()
    # The same light: what differs is noise. The mean of both stands for the light.
    assert_uncorrelated(zero.ravel() - zero.mean(), one_.ravel() - one_.mean())


@pytest.mark.parametrize("draw", [-1, 2**32])
def test_a_draw_out_of_range_is_refused(gl: moderngl.Context, draw: int) -> None:
    one = scenario()
    state = one.at(one.epoch_tai_ns)
    with (
        Simulator(one, gl) as simulator,
        pytest.raises(ValueError, match=rf"^draw must lie in 0\.\.4294967295, got {draw}$"),
    ):
        simulator.capture(state, "cam", draw=draw)
