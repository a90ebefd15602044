"""The advice on exposure times, on electrons made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.assess.exposure import advice_text, advise
from simgl.errors import ConfigError
from simgl.images import ElectronFrame
from simgl.scene.state import SceneState
from simgl.simulator import Exposure, Product, Simulator
from tests.scenes import lambert, scene


@pytest.fixture
def plate(gl: moderngl.Context) -> tuple[Exposure, SceneState]:
    """A plate over the middle of a dark sky, and its scene."""
    model = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": lambert(0.5)}}
    scenario = scene(
        {"plate": {"model": model, "position_icrf_m": [0, 0, 0]}},
        {"position_icrf_m": [0, 0, 100], "look_at": "plate"},
    )
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        return simulator.capture(state, "cam", {Product.ELECTRONS, Product.TRUTH}), state


def with_electrons(exposure: Exposure, bright: float, dark: float, sky: float) -> Exposure:
    """The same with half of the plate bright, half dark, before a sky of some electrons."""
    assert exposure.electrons is not None
    assert exposure.truth is not None
    on = exposure.truth.instance == 1
    upper = np.arange(on.shape[0])[:, None] < on.shape[0] // 2
    made = np.where(on, np.where(upper, bright, dark), sky).astype(np.float32)
    frame = ElectronFrame(info=exposure.info, electrons=made)
    return replace(exposure, electrons=frame)


def test_limits_follow_from_electrons(plate: tuple[Exposure, SceneState]) -> None:
    exposure, state = plate
    d = exposure.info.camera.detector
    time = exposure.info.camera.exposure_time
    full = min(d.full_well, (2**d.bits - 1 - d.pedestal) / d.gain_dn_per_e)
    # Three sigma: e = 3 sqrt(e + read noise^2).
    seen = 0.5 * (9.0 + math.sqrt(81.0 + 36.0 * d.read_noise**2))
    found = advise(with_electrons(exposure, 0.45 * full, 0.5 * seen, 0.1 * seen), state, "plate")
    # Twice the time fills the bright half to 0.9 and lifts the dark half.
    assert found.unsaturated == pytest.approx(2.0 * time, rel=1e-6)
    assert found.back_visible == pytest.approx(2.0 * time, rel=1e-6)
    assert found.sky_dark == pytest.approx(10.0 * time, rel=1e-6)
    assert found.time == pytest.approx(2.0 * time, rel=1e-6)
    assert "no saturation up to" in advice_text(found)


def test_a_target_of_too_much_contrast_is_named(plate: tuple[Exposure, SceneState]) -> None:
    exposure, state = plate
    found = advise(with_electrons(exposure, 1e5, 1e-3, 0.0), state, "plate")
    assert not found.meets_all
    assert math.isinf(found.sky_dark)
    assert found.time == found.unsaturated
    assert "no time meets all three" in advice_text(found)


def test_an_unknown_target_is_refused(plate: tuple[Exposure, SceneState]) -> None:
    exposure, state = plate
    with pytest.raises(ConfigError, match='did you mean "plate"'):
        advise(exposure, state, "plaet")
