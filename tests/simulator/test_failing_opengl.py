"""An error of OpenGL costs the frame that it meets: nothing after it, and no memory."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np
import pytest
from PIL import Image

from simgl.errors import ShaderError
from simgl.gpu.context import open_context
from simgl.gpu.window_systems import current_binding
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.scenes import Table, lambert
from tests.simulator.failing_opengl import Calls, counted_calls

PRODUCTS = frozenset({Product.DN, Product.RADIANCE, Product.TRUTH})
FAILURES = (moderngl.Error, ShaderError)


def busy_scene(clouds: Path, azimuth_deg: float) -> Scenario:
    """A scene that needs nearly every pass: Earth, two bodies, a lamp, a lens with faults."""
    relative: Table = {"relative_to": "box", "position_lvlh_m": [0.0, 0.9, 0.9]}
    plate: Table = {"plate": {"width_m": 2.0, "height_m": 2.0, "material": lambert(0.6)}}
    box: Table = {"box": {"size_m": [1.0, 1.0, 1.0], "material": "mli_gold"}}
    camera: Table = {
        "preset": "cmv4000",
        "width_px": 128,
        "height_px": 96,
        "focal_length_mm": 4.0,
        "about": {"target": "box", "azimuth_deg": azimuth_deg, "range_m": 4.0},
        "optics": {"distortion": {"k1": -0.05}, "aberration_um": 5.0},
        "blooming": 0.5,
    }
    lamp: Table = {
        "on": "box",
        "position_body_m": [0.0, 0.0, 1.0],
        "boresight": [0, 0, -1],
        "half_angle_deg": 40.0,
        "power_w": [30.0] * 4,
    }
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"clouds": {"picture": str(clouds)}},
            "spacecraft": {
                "box": {"model": box, "orbit": {"altitude_km": 400.0}},
                "plate": {"model": plate, **relative},
            },
            "camera": {"cam": camera},
            "lamp": {"spot": lamp},
        }
    )


def digest(simulator: Simulator, scenario: Scenario) -> str:
    capture = simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", PRODUCTS)
    assert capture.digital is not None
    assert capture.radiance is not None
    assert capture.truth is not None
    h = hashlib.sha256()
    for array in (capture.digital.dn, capture.radiance.radiance, capture.truth.depth):
        h.update(np.ascontiguousarray(array).tobytes())
    return h.hexdigest()


@dataclass(frozen=True)
class Scenes:
    """Two scenes that share little, what their images are, and how many calls draw them.

    opening : calls of a new simulator
    first : calls of its first image
    change : calls of an image after one of the other scene, both drawn before, at least: what is
        cached of it differs
    """

    scenarios: tuple[Scenario, Scenario]
    digests: tuple[str, str]
    opening: int
    first: int
    change: int


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Scenes:
    folder = tmp_path_factory.mktemp("clouds")
    scenarios = []
    for seed, azimuth_deg in enumerate((30.0, 75.0)):
        cover = np.random.default_rng(seed).integers(0, 256, (8, 16), dtype=np.uint8)
        Image.fromarray(cover).save(folder / f"{seed}.png")
        scenarios.append(busy_scene(folder / f"{seed}.png", azimuth_deg))
    first, second = scenarios
    # With empty caches an opening makes more calls than those after it.
    Simulator(first).close()
    with counted_calls() as calls, Simulator(first) as simulator:
        counts, digests = [calls.count], []
        for scenario in (first, second, first, second, first, second):
            digests.append(digest(simulator, scenario))
            counts.append(calls.count)
    assert digests[:2] == digests[2:4] == digests[4:]
    assert digests[0] != digests[1]
    opening, drawn, _, *changes = np.diff([0, *counts]).tolist()
    return Scenes(
        scenarios=(first, second),
        digests=(digests[0], digests[1]),
        opening=opening,
        first=drawn,
        change=min(changes),
    )


@pytest.fixture
def calls() -> Iterator[Calls]:
    with counted_calls() as counted:
        yield counted


@pytest.mark.parametrize("place", [0.3, 0.6, 1.0])
def test_a_simulator_that_cannot_be_opened_leaves_nothing(
    gl: moderngl.Context, scenes: Scenes, calls: Calls, place: float
) -> None:
    """The fixture of the context counts what is left in it."""
    calls.failing = 1 + round(place * (scenes.opening - 1))
    with pytest.raises(FAILURES):
        Simulator(scenes.scenarios[0], gl)


def test_a_context_that_was_opened_for_a_simulator_goes_with_it(
    scenes: Scenes, calls: Calls, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[moderngl.Context] = []

    def noted() -> moderngl.Context:
        opened.append(open_context())
        return opened[-1]

    monkeypatch.setattr("simgl.simulator.open_context", noted)
    before = current_binding()
    calls.failing = scenes.opening // 2
    with pytest.raises(FAILURES):
        Simulator(scenes.scenarios[0])
    assert len(opened) == 1
    assert isinstance(opened[0].mglo, moderngl.InvalidObject)
    assert current_binding() == before


@pytest.mark.parametrize("place", [0.2, 0.7])
def test_the_first_image_may_fail_and_the_next_one_is_as_ever(
    gl: moderngl.Context, scenes: Scenes, calls: Calls, place: float
) -> None:
    with Simulator(scenes.scenarios[0], gl) as simulator:
        calls.failing = calls.count + round(place * scenes.first)
        with pytest.raises(FAILURES):
            digest(simulator, scenes.scenarios[0])
        assert digest(simulator, scenes.scenarios[0]) == scenes.digests[0]


def test_what_a_failed_image_left_half_made_is_used_by_no_other(
    gl: moderngl.Context, scenes: Scenes, calls: Calls
) -> None:
    """Each scene in turn fails on its way; the one before, and then it, come out right."""
    shown, next_one = 0, 1
    with Simulator(scenes.scenarios[0], gl) as simulator:
        assert digest(simulator, scenes.scenarios[shown]) == scenes.digests[shown]
        for place in (0.05, 0.3, 0.55, 0.8):
            calls.failing = calls.count + round(place * scenes.change)
            with pytest.raises(FAILURES):
                digest(simulator, scenes.scenarios[next_one])
            for index in (shown, next_one):
                assert digest(simulator, scenes.scenarios[index]) == scenes.digests[index]
            shown, next_one = next_one, shown
