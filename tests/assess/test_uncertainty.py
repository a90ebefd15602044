"""Draws of ``[uncertainty]``: bands that follow from what is varied, and from nothing else."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from simgl.assess.assessment_tables import write_uncertainty_tables
from simgl.assess.requirement_check import check_requirements
from simgl.assess.trajectory_assessment import PRODUCTS, Assignment, assignment
from simgl.assess.uncertainty_bands import (
    _PROPORTIONAL,
    _SHIFTED,
    PERCENTILES,
    requirement_spread,
    rows_of_draw,
    uncertainty_bands,
)
from simgl.assess.uncertainty_draws import (
    UncertaintyRun,
    capture_of_draw,
    chosen_epochs,
    draws_of,
    run_draws,
    state_of_draw,
    uncertainty_draw,
)
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.scenario.uncertainty import Uncertainty
from simgl.sequence.journal import Row
from simgl.simulator import Simulator
from simgl.workers.executors import run_serial
from tests.assess.test_trajectory import SCENE

NOTHING = Uncertainty(
    draws=5,
    epochs=2,
    albedo_sigma=0.0,
    exposure_sigma=0.0,
    attitude_sigma_deg=0.0,
    pointing_sigma_deg=0.0,
    weathers=0,
)
REQUIRED = "[requirements]\nmin_snr = 5\nmax_saturated_share = 0.5\n"
MINUTE = 60_000_000_000
# float32 electrons and radiance.
ROUNDING = 1e-5


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    path = tmp_path_factory.mktemp("uncertainty") / "scene.toml"
    path.write_text(SCENE.replace("0.0002", "0.0001") + REQUIRED)
    return load_scenario(path)


@pytest.fixture(scope="module")
def simulator(module_gl: moderngl.Context, scenario: Scenario) -> Iterator[Simulator]:
    with Simulator(scenario, module_gl) as opened:
        yield opened


def work_of(scenario: Scenario, table: Uncertainty | None) -> Assignment:
    """Four epochs by day."""
    epochs = [scenario.epoch_tai_ns + i * 3 * MINUTE for i in range(4)]
    return assignment(replace(scenario, uncertainty=table), None, None, epochs)


def nominal(work: Assignment, simulator: Simulator) -> list[Row]:
    return [work.render(simulator, frame) for frame in range(len(work.epochs))]


def drawn(run: UncertaintyRun, simulator: Simulator) -> list[Row]:
    count = run.table.draws * len(run.chosen)
    return [run.render(simulator, frame) for frame in range(count)]


def run_of(work: Assignment, rows: list[Row]) -> UncertaintyRun:
    run = draws_of(work, rows, check_requirements(work.scenario.requirements, rows))
    assert run is not None
    return run


def test_exposure_alone_gives_the_analytic_band(scenario: Scenario, simulator: Simulator) -> None:
    """Electrons of an unsaturated detector are proportional to the exposure."""
    work = work_of(scenario, replace(NOTHING, exposure_sigma=0.05))
    rows = nominal(work, simulator)
    assert max(float(row["saturated"] or 0.0) for row in rows) == 0.0
    run = run_of(work, rows)
    factors = [draw.exposure for draw in run.draws()]
    assert np.std(factors) > 0.02
    bands = uncertainty_bands(run, rows, drawn(run, simulator)).bands
    usual = np.array([row["median_electrons"] for row in rows], dtype=float)
    expected = np.percentile(factors, PERCENTILES)[:, None] * usual
    # Also at the epochs between those that were drawn.
    assert len(run.chosen) < len(rows)
    np.testing.assert_allclose(bands["median_electrons"], expected, rtol=ROUNDING)
    np.testing.assert_array_equal(bands["target_pixels"][0], bands["target_pixels"][2])
    # Light does not depend on the exposure.
    np.testing.assert_array_equal(bands["exitance_w_m2"][0], bands["exitance_w_m2"][2])


def test_without_deviations_the_bands_have_no_width(
    scenario: Scenario, simulator: Simulator
) -> None:
    work = work_of(scenario, NOTHING)
    rows = nominal(work, simulator)
    run = run_of(work, rows)
    found = uncertainty_bands(run, rows, drawn(run, simulator))
    for name, band in found.bands.items():
        usual = [math.nan if row[name] is None else float(row[name] or 0.0) for row in rows]
        for percentile in band:
            np.testing.assert_array_equal(percentile, usual)
    checks = check_requirements(scenario.requirements, rows)
    for spread, check in zip(found.spreads, checks, strict=True):
        assert spread.margins == (check.margin,) * 3
        assert spread.worst is None


def test_albedo_scales_the_target_and_nothing_else(
    scenario: Scenario, simulator: Simulator
) -> None:
    work = work_of(scenario, NOTHING)
    state = scenario.at(work.epochs[0])
    usual = simulator.capture(state, work.camera, PRODUCTS)
    draw = replace(uncertainty_draw(NOTHING, 0), albedo=1.25)
    found = capture_of_draw(simulator, work, state, draw)
    assert usual.truth is not None
    assert usual.electrons is not None
    assert usual.radiance is not None
    assert found.electrons is not None
    assert found.radiance is not None
    scale = np.where(usual.truth.instance == 1, 1.25, 1.0)
    np.testing.assert_allclose(
        found.electrons.electrons, scale * usual.electrons.electrons, rtol=ROUNDING
    )
    np.testing.assert_allclose(
        found.radiance.radiance, scale[..., None] * usual.radiance.radiance, rtol=ROUNDING
    )


def test_factors_are_log_normal_and_angles_normal() -> None:
    table = replace(NOTHING, exposure_sigma=0.05, albedo_sigma=0.2, attitude_sigma_deg=2.0)
    count = 4000
    draws = [uncertainty_draw(table, number) for number in range(count)]
    # Standard errors of a percentile of a normal sample: 2.1 sigma / sqrt(n) at 5 %.
    low, high = np.percentile(np.log([d.exposure for d in draws]), [5.0, 95.0]) / 0.05
    assert low == pytest.approx(-1.6449, abs=3.0 * 2.1 / math.sqrt(count))
    assert high == pytest.approx(1.6449, abs=3.0 * 2.1 / math.sqrt(count))
    logs = np.log([[d.exposure, d.albedo] for d in draws])
    assert abs(np.corrcoef(logs.T)[0, 1]) < 3.0 / math.sqrt(count)
    spread = np.std([d.attitude for d in draws], axis=0)
    np.testing.assert_allclose(np.degrees(spread), 2.0, rtol=3.0 / math.sqrt(2.0 * count))


def test_a_draw_turns_target_and_camera_by_its_angles(scenario: Scenario) -> None:
    work = work_of(scenario, NOTHING)
    usual = scenario.at(work.epochs[0])
    draw = replace(
        uncertainty_draw(NOTHING, 0), attitude=(0.02, -0.01, 0.02), pointing=(0.0, 0.004, 0.003)
    )
    turned = state_of_draw(work, work.epochs[0], draw)

    def angle(one: np.ndarray, other: np.ndarray) -> float:
        return math.acos((np.trace(one.T @ other) - 1.0) / 2.0)

    body, other = usual.bodies["target"].pose, turned.bodies["target"].pose
    assert angle(body.R_icrf_from_body, other.R_icrf_from_body) == pytest.approx(0.03, rel=1e-9)
    np.testing.assert_array_equal(body.position, other.position)
    seen, away = usual.cameras["near"], turned.cameras["near"]
    assert angle(seen.R_camera_from_icrf, away.R_camera_from_icrf) == pytest.approx(0.005, rel=1e-6)


def test_what_a_draw_changes_goes_over_to_the_epochs_between(scenario: Scenario) -> None:
    usual: Row = dict.fromkeys([*_PROPORTIONAL, *_SHIFTED], 0.5)
    usual |= {"target_pixels": 100, "target_size_px": 10, "edge_distance_px": 5}
    rows = [
        usual | {"tai_ns": i * MINUTE, "median_electrons": 100.0 * (i + 1), "median_snr": 20.0}
        for i in range(3)
    ]
    rows[1]["edge_distance_px"] = None
    first = rows[0] | {"median_electrons": 200.0, "saturated": 0.7}
    last = rows[2] | {"median_electrons": 900.0, "saturated": 0.5, "target_pixels": 0}
    found = rows_of_draw(rows, [0, 2], [first, last], scenario.criteria)
    # Factors 2 and 3, 2.5 between; differences 0.2 and 0, 0.1 between; 100 pixels and none.
    assert [row["median_electrons"] for row in found] == pytest.approx([200.0, 500.0, 900.0])
    assert [row["saturated"] for row in found] == pytest.approx([0.7, 0.6, 0.5])
    assert [row["target_pixels"] for row in found] == pytest.approx([100.0, 50.0, 0.0])
    assert found[1]["edge_distance_px"] is None
    assert [row["verdict"] for row in found] == ["too bright", "too bright", "not in view"]


def test_a_spread_counts_draws_and_finds_the_worst(scenario: Scenario) -> None:
    rows: list[list[Row]] = [
        [{"tai_ns": 0, "verdict": "good", "sunlight": 1.0, "median_snr": snr, "saturated": 0.0}]
        for snr in (4.0, 6.0, 9.0, 3.0)
    ]
    checks = [check_requirements(scenario.requirements, world)[-1] for world in rows]
    (key,) = {check.requirement.key for check in checks}
    assert key == "min_snr"
    spread = requirement_spread([uncertainty_draw(NOTHING, n) for n in range(4)], checks)
    assert (spread.passing, spread.draws, spread.worst_margin) == (2, 4, -2.0)
    assert spread.worst is not None
    assert spread.worst.number == 3
    # Wilson's bounds for 2 of 4: centre 1/2, z sqrt(1/4 n + z^2 / 4 n^2) / (1 + z^2 / n).
    z = 1.959964
    half = z * math.sqrt(0.25 / 4 + z * z / 64) / (1.0 + z * z / 4)
    assert spread.probability == pytest.approx((0.5 - half, 0.5 + half), abs=1e-6)


def test_epochs_are_spread_evenly_with_the_worst_ones() -> None:
    assert chosen_epochs(101, 5, [3, 50]) == [0, 3, 25, 50, 75, 100]
    assert chosen_epochs(3, 24, []) == [0, 1, 2]


def tables(work: Assignment, rows: list[Row], simulator: Simulator, out: Path) -> list[bytes]:
    """What a run writes about its draws."""
    run = run_of(work, rows)
    (out / "uncertainty").mkdir(parents=True)
    drawn = run_draws(run, run_serial(run, simulator), out / "uncertainty")
    write_uncertainty_tables(out, uncertainty_bands(run, rows, drawn), rows)
    return [path.read_bytes() for path in sorted(out.rglob("*.csv"))]


def test_the_same_seed_writes_the_same_bytes(
    scenario: Scenario, simulator: Simulator, tmp_path: Path
) -> None:
    table = Uncertainty(draws=3, epochs=2, seed=7, weathers=0)
    rows = nominal(work_of(scenario, table), simulator)
    seeds = {"one": 7, "other": 7, "third": 8}
    one, other, third = (
        tables(work_of(scenario, replace(table, seed=seed)), rows, simulator, tmp_path / name)
        for name, seed in seeds.items()
    )
    assert len(one) == 4
    assert one == other
    assert all(a != b for a, b in zip(one, third, strict=True))


def test_without_the_table_nothing_is_drawn(scenario: Scenario) -> None:
    assert draws_of(work_of(scenario, None), [], []) is None
