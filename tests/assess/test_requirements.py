"""Requirements: limits as data, margins of what the required share of the epochs keeps."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simgl.assess.requirement_check import (
    Outcome,
    check_requirement,
    check_requirements,
    longest_outage,
    passed,
)
from simgl.assess.trajectory_assessment import COLUMNS
from simgl.cli import main
from simgl.errors import ConfigError
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.requirements import KEYS, Requirement, RequirementsTable, When
from simgl.sequence.journal import Row
from tests.assess.test_trajectory import SCENE

MINUTE = 60_000_000_000


def rows_of(name: str, values: list[float | None], **others: object) -> list[Row]:
    usual: dict[str, Any] = {"verdict": "good", "sunlight": 1.0, **others}
    return [{**usual, "tai_ns": i * MINUTE, name: value} for i, value in enumerate(values)]


def required(key: str, limit: float, share: float = 1.0, when: When = When.IN_VIEW) -> Requirement:
    return Requirement(key=key, limit=limit, share=share, when=when)


def test_every_key_names_a_column_of_the_table_of_epochs() -> None:
    names = {key.partition("_")[2] for key in RequirementsTable.__struct_fields__}
    assert names == set(KEYS)
    columns = {key.column for key in KEYS.values()} - {None}
    assert columns <= set(COLUMNS)


def test_a_smallest_value_is_judged_by_the_worst_epoch() -> None:
    check = check_requirement(required("min_snr", 10.0), rows_of("median_snr", [30.0, 8.0, 12.0]))
    assert check.outcome is Outcome.FAIL
    assert (check.value, check.margin, check.worst) == (8.0, -2.0, 8.0)
    assert (check.worst_tai_ns, check.broken, check.epochs) == (MINUTE, 1, 3)


def test_a_largest_value_is_judged_from_the_other_side() -> None:
    check = check_requirement(required("max_range_m", 50.0), rows_of("range_m", [30.0, 48.0]))
    assert check.outcome is Outcome.PASS
    assert (check.value, check.margin) == (48.0, 2.0)


def test_a_share_of_the_epochs_may_break_the_limit() -> None:
    rows = rows_of("median_snr", [float(value) for value in range(1, 21)])
    # 19 of 20 epochs keep 2 or more, 20 of 20 keep 1.
    assert check_requirement(required("min_snr", 2.0, 0.95), rows).margin == 0.0
    assert check_requirement(required("min_snr", 2.0, 0.951), rows).margin == -1.0


def test_epochs_without_a_value_out_of_view_or_in_shadow_do_not_count() -> None:
    rows = rows_of("contrast", [0.5, None, 0.1, 0.0])
    rows[2]["sunlight"] = 0.4
    rows[3]["verdict"] = "not in view"
    sunlit = check_requirement(required("min_contrast", 0.2, when=When.SUNLIT), rows)
    assert (sunlit.outcome, sunlit.epochs) == (Outcome.PASS, 1)
    assert check_requirement(required("min_contrast", 0.2), rows).worst == 0.1
    assert check_requirement(required("min_contrast", 0.2, when=When.ALWAYS), rows).worst == 0.0


def test_what_no_epoch_can_judge_is_not_passed() -> None:
    checks = check_requirements([required("min_contrast", 0.2)], rows_of("contrast", [None]))
    assert checks[0].outcome is Outcome.NOT_JUDGED
    assert not passed(checks)
    assert passed([])


@pytest.mark.parametrize(
    ("good", "seconds", "begins"),
    [
        ([1, 1, 1, 1], 0, 0),
        ([1, 0, 1, 1], 120, 0),
        ([0, 0, 1, 0], 120, 0),
        ([1, 1, 0, 0], 120, 1),
        ([0, 0, 0, 0], 180, 0),
    ],
)
def test_an_outage_lasts_from_good_to_good(good: list[int], seconds: int, begins: int) -> None:
    times = MINUTE * np.arange(4)
    assert longest_outage(times, np.array(good, dtype=bool)) == (seconds, begins * MINUTE)


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        ({"min_snrs": 1.0}, 'min_snrs is not a key here; did you mean "min_snr"?'),
        ({"min_snr": "much"}, 'min_snr must be a number or a table of limit, share, when, got "m'),
        ({"min_snr": -1.0}, "min_snr must be 0 or more, got -1"),
        ({"max_dark_share": 2.0}, "max_dark_share must be 0..1, got 2"),
        ({"min_sun_exclusion_deg": 200}, "min_sun_exclusion_deg must be 0..180 deg, got 200"),
        ({"min_snr": {"limit": -3.0}}, "min_snr.limit must be 0 or more, got -3"),
        ({"min_snr": {"limit": 3.0, "share": 0.0}}, "min_snr.share must be"),
        ({"min_snr": {"limit": 3.0, "when": "noon"}}, 'min_snr.when must be one of "always", "in'),
        ({"min_snr": {"share": 0.5}}, "min_snr.limit is missing"),
        ({"max_outage_s": {"limit": 9, "share": 0.5}}, "max_outage_s is of the run as a whole"),
        ({"min_range_m": 9, "max_range_m": 8}, "min_range_m must not exceed max_range_m = 8, got"),
    ],
)
def test_an_impossible_requirement_is_one_clear_line(
    table: dict[str, object], complaint: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        scenario_from_dict({"epoch": {"utc": "2026-03-20T12:00:00"}, "requirements": table})
    assert str(caught.value).startswith(f"scenario [requirements]: {complaint}")


def test_a_run_that_breaks_a_requirement_says_so_and_ends_with_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario, out = tmp_path / "scene.toml", tmp_path / "out"
    text = "[requirements]\nmax_range_m = 31.0\nmin_sun_exclusion_deg = 179.0\n"
    text += "[uncertainty]\ndraws = 3\nweathers = 0\n"
    scenario.write_text(SCENE + text)
    options = ["--duration", "60", "--count", "2", "--out", str(out), "--by", "T. Tester", "--json"]
    monkeypatch.setattr(sys, "argv", ["simgl", "assess", str(scenario), *options])
    with pytest.raises(SystemExit) as done:
        main()
    assert done.value.code == 1
    document = json.loads(capsys.readouterr().out)
    assert not document["passed"]
    reach, exclusion = document["requirements"]
    assert (reach["outcome"], exclusion["outcome"]) == ("pass", "fail")
    # 30 m between the origins of camera and target.
    assert reach["margin"] == pytest.approx(1.0, abs=1e-6)
    kept = [one["passing"] for one in document["uncertainty"]["requirements"]]
    assert kept == [3, 0]
    page = (out / "report.html").read_text()
    assert "3 of 3</td>" in page
    assert "T. Tester" in page
    assert 'class="verdict fail">FAIL<' in page
    with (out / "requirements.csv").open() as file:
        assert [row["outcome"] for row in csv.DictReader(file)] == ["pass", "fail"]
    for table in ("stretches", "provenance", "not_modelled", "uncertainty", "uncertainty/frames"):
        assert len((out / f"{table}.csv").read_text().splitlines()) > 1
    assert len(list((out / "images").glob("*.dn.png"))) >= 1
