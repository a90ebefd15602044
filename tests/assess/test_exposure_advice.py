"""The advice on exposure times, on electrons made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.assess.exposure_advice import advice_text, advise
from simgl.assess.target_light import assess_frame
from simgl.errors import ConfigError
from simgl.images import DigitalFrame, ElectronFrame, RadianceFrame
from simgl.scenario.schema import UsabilityCriteria
from simgl.scene.state import SceneState
from simgl.simulator import Capture, Product, Simulator
from tests.scenes import lambert, scene


@pytest.fixture
def plate(gl: moderngl.Context) -> tuple[Capture, SceneState]:
    """A plate over the middle of a dark sky, and its scene."""
    model = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": lambert(0.5)}}
    scenario = scene(
        {"plate": {"model": model, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 100], "look_at": "plate"},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        return simulator.capture(state, "cam", {Product.ELECTRONS, Product.TRUTH}), state


def with_electrons(exposure: Capture, bright: float, dark: float, sky: float) -> Capture:
    """The same with half of the plate bright, half dark, before a sky of some electrons."""
    assert exposure.electrons is not None
    assert exposure.truth is not None
    on = exposure.truth.instance == 1
    upper = np.arange(on.shape[0])[:, None] < on.shape[0] // 2
    made = np.where(on, np.where(upper, bright, dark), sky).astype(np.float32)
    frame = ElectronFrame(info=exposure.info, electrons=made)
    return replace(exposure, electrons=frame)


def test_limits_follow_from_electrons(plate: tuple[Capture, SceneState]) -> None:
    exposure, state = plate
    d = exposure.info.camera.detector
    time = exposure.info.camera.exposure_time
    full = min(d.full_well, (2**d.bits - 1 - d.pedestal) / d.gain_dn_per_e)
    # Three sigma: e = 3 sqrt(e + read noise^2).
    seen = 0.5 * (9.0 + math.sqrt(81.0 + 36.0 * d.read_noise**2))
    found = advise(with_electrons(exposure, 0.45 * full, 0.5 * seen, 0.1 * seen), state, "plate")
    # Twice the time fills the bright half to 0.9 and lifts the dark half.
    assert found.unsaturated == pytest.approx(2.0 * time, rel=1e-6)
    assert found.dark_side_visible == pytest.approx(2.0 * time, rel=1e-6)
    assert found.sky_dark == pytest.approx(10.0 * time, rel=1e-6)
    assert found.time == pytest.approx(2.0 * time, rel=1e-6)
    assert "no saturation up to" in advice_text(found)


def test_a_target_of_too_much_contrast_is_named(plate: tuple[Capture, SceneState]) -> None:
    exposure, state = plate
    found = advise(with_electrons(exposure, 1e5, 1e-3, 0.0), state, "plate")
    assert not found.meets_all
    assert math.isinf(found.sky_dark)
    assert found.time == found.unsaturated
    assert "no time meets all three" in advice_text(found)


def test_without_a_dark_sky_the_longest_that_does_not_saturate_is_advised(
    plate: tuple[Capture, SceneState],
) -> None:
    """Before the Earth no time leaves the sky dark and lifts the target out of the noise."""
    exposure, state = plate
    d, time = exposure.info.camera.detector, exposure.info.camera.exposure_time
    full = min(d.full_well, (2**d.bits - 1 - d.pedestal) / d.gain_dn_per_e)
    found = advise(with_electrons(exposure, 0.3 * full, 0.1 * full, 0.5 * full), state, "plate")
    assert not found.meets_all
    assert found.time == pytest.approx(3.0 * time, rel=1e-6)


def test_glints_may_saturate_as_far_as_the_criteria_let_them(
    plate: tuple[Capture, SceneState],
) -> None:
    exposure, state = plate
    assert exposure.truth is not None
    made = with_electrons(exposure, 100.0, 100.0, 0.0)
    assert made.electrons is not None
    places = np.flatnonzero(exposure.truth.instance == 1)
    # One pixel in fifty of the plate glints: less than half of a twentieth, more than of a tenth
    # of that.
    made.electrons.electrons.flat[places[::50]] = 1e5
    lenient = advise(made, state, "plate", UsabilityCriteria(max_saturated_share=0.05))
    strict = advise(made, state, "plate", UsabilityCriteria(max_saturated_share=0.005))
    assert lenient.unsaturated == pytest.approx(1000.0 * strict.unsaturated, rel=1e-6)


def test_an_assessment_gives_the_same_advice(plate: tuple[Capture, SceneState]) -> None:
    exposure, state = plate
    made = replace(
        with_electrons(exposure, 900.0, 500.0, 0.0),
        digital=DigitalFrame(info=exposure.info, dn=np.zeros((128, 128), dtype=np.uint16)),
        radiance=RadianceFrame(info=exposure.info, radiance=np.zeros((128, 128, 4), np.float32)),
    )
    better = assess_frame(made, state, "plate").better_exposure
    time = advise(made, state, "plate").time
    assert better == pytest.approx(time / exposure.info.camera.exposure_time, rel=1e-12)
    dark = replace(made, electrons=with_electrons(made, 0.0, 0.0, 0.0).electrons)
    assert assess_frame(dark, state, "plate").better_exposure is None


def test_an_unknown_target_is_refused(plate: tuple[Capture, SceneState]) -> None:
    exposure, state = plate
    with pytest.raises(ConfigError, match='did you mean "plate"'):
        advise(exposure, state, "plaet")
