"""Requirements against the table of a run: outcome, margin and worst epoch of each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from simgl.arrays import Array, IndexArray, Mask
from simgl.assess.verdict import Verdict
from simgl.scenario.requirements import Requirement, When
from simgl.sequence.journal import Row

# Share of the Sun's light on a target that counts as sunlit.
_SUNLIT = 0.5


class Outcome(StrEnum):
    """What becomes of a requirement; only the first one passes.

    NOT_JUDGED : no epoch counts
    """

    PASS = "pass"
    FAIL = "fail"
    NOT_JUDGED = "not judged"


@dataclass(frozen=True, kw_only=True)
class Check:
    """A requirement against a run, values in the unit of its key.

    value : that the required share of the epochs keeps; of a run, its value. None: not judged
    margin : from the limit to the value, negative where it is broken
    worst : the worst value, and its epoch; None for a share of the run
    epochs, broken : how many epochs count, and how many of them break the limit
    """

    requirement: Requirement
    outcome: Outcome
    value: float | None = None
    margin: float | None = None
    worst: float | None = None
    worst_tai_ns: int | None = None
    epochs: int = 0
    broken: int = 0


def check_requirements(requirements: Sequence[Requirement], rows: Sequence[Row]) -> list[Check]:
    """Each requirement against the rows of a run, in order of time."""
    return [check_requirement(one, rows) for one in requirements]


def check_requirement(requirement: Requirement, rows: Sequence[Row]) -> Check:
    """A requirement against the rows of a run, in order of time."""
    if requirement.of.column is None:
        return _check_run(requirement, rows)
    counted = counting(requirement, rows)
    values = column_values(requirement, rows)[counted]
    if values.size == 0:
        return Check(requirement=requirement, outcome=Outcome.NOT_JUDGED)
    margins = margins_of(requirement, values)
    worst = int(np.argmin(margins))
    margin = margin_of_share(requirement, margins)
    return Check(
        requirement=requirement,
        outcome=Outcome.PASS if margin >= 0.0 else Outcome.FAIL,
        value=requirement.limit + (margin if requirement.is_minimum else -margin),
        margin=margin,
        worst=float(values[worst]),
        worst_tai_ns=int(rows[int(counted[worst])]["tai_ns"] or 0),
        epochs=len(values),
        broken=int((margins < 0.0).sum()),
    )


def counting(requirement: Requirement, rows: Sequence[Row]) -> IndexArray:
    """Indices of the rows at which a requirement counts."""
    column = requirement.of.column
    assert column is not None
    return np.array(
        [i for i, row in enumerate(rows) if row[column] is not None and _counts(requirement, row)],
        dtype=np.int64,
    )


def _counts(requirement: Requirement, row: Row) -> bool:
    if requirement.when is When.ALWAYS:
        return True
    in_view = row["verdict"] != Verdict.NOT_IN_VIEW.value
    lit = requirement.when is When.IN_VIEW or float(row["sunlight"] or 0.0) >= _SUNLIT
    return in_view and lit


def column_values(requirement: Requirement, rows: Sequence[Row]) -> Array:
    """(rows,) values of the quantity that is limited; NaN where there is none."""
    column = requirement.of.column
    assert column is not None
    return np.array([np.nan if (v := row[column]) is None else float(v) for row in rows])


def margins_of(requirement: Requirement, values: Array) -> Array:
    """Distances of values from the limit, positive where it is kept."""
    return values - requirement.limit if requirement.is_minimum else requirement.limit - values


def margin_of_share(requirement: Requirement, margins: Array) -> float:
    """The margin that the required share of the epochs keeps."""
    # 0.95 of 20 epochs are 19, whatever the last bit of the product says.
    needed = math.ceil(requirement.share * margins.size - 1e-9)
    return float(np.sort(margins)[::-1][needed - 1])


def _check_run(requirement: Requirement, rows: Sequence[Row]) -> Check:
    """Of a requirement on the run as a whole."""
    good = np.array([row["verdict"] == Verdict.GOOD.value for row in rows])
    times = np.array([int(row["tai_ns"] or 0) for row in rows], dtype=np.int64)
    start = None
    if requirement.key == "min_good_share":
        value = float(good.mean())
    else:
        value, start = longest_outage(times, good)
    margin = float(margins_of(requirement, np.array(value)))
    return Check(
        requirement=requirement,
        outcome=Outcome.PASS if margin >= 0.0 else Outcome.FAIL,
        value=value,
        margin=margin,
        worst=None if start is None else value,
        worst_tai_ns=start,
        epochs=len(rows),
        broken=int((~good).sum()),
    )


def longest_outage(times: IndexArray, good: Mask) -> tuple[float, int]:
    """The longest time without a good image [s], and when it begins [TAI ns].

    times : [TAI ns]; good : of the image at each of them

    It lasts from the last good image before to the first one after; 0 where all are good.
    """
    longest, begins = 0, int(times[0])
    last_good = int(times[0])
    for index, (now, is_good) in enumerate(zip(times.tolist(), good.tolist(), strict=True)):
        interrupted = index > 0 and not good[index - 1]
        ends = (is_good and interrupted) or (not is_good and index == len(times) - 1)
        if ends and now - last_good > longest:
            longest, begins = now - last_good, last_good
        if is_good:
            last_good = now
    return longest / 1e9, begins


def passed(checks: Sequence[Check]) -> bool:
    """Whether every requirement passes."""
    return all(check.outcome is Outcome.PASS for check in checks)


def in_unit(requirement: Requirement, value: float | None, *, signed: bool = False) -> str:
    """A value with its unit, shares in percent; a dash for none."""
    if value is None:
        return "-"
    if requirement.of.allowed == (0.0, 1.0) and requirement.key.endswith("_share"):
        return f"{100.0 * value:{'+' if signed else ''}.3g} %"
    unit = f" {requirement.of.unit}" if requirement.of.unit else ""
    return f"{value:{'+' if signed else ''}.4g}{unit}"


def requirement_text(requirement: Requirement) -> str:
    """The limit in words, such as "at least 10, at 95 % of the sunlit epochs in view"."""
    text = f"at {'least' if requirement.is_minimum else 'most'} "
    text += in_unit(requirement, requirement.limit)
    if requirement.of.column is None:
        return text
    epochs = {
        When.ALWAYS: "epochs",
        When.IN_VIEW: "epochs with the target in view",
        When.SUNLIT: "epochs with the target in view and in sunlight",
    }[requirement.when]
    share = "all" if requirement.share == 1.0 else f"{100.0 * requirement.share:g} % of the"
    return f"{text}, at {share} {epochs}"


def check_row(check: Check) -> dict[str, object]:
    """A check as a row of requirements.csv, and of the JSON document."""
    one = check.requirement
    return {
        "requirement": one.key,
        "quantity": one.of.quantity,
        "unit": one.of.unit,
        "limit": one.limit,
        "share": one.share,
        "when": one.when.value,
        "outcome": check.outcome.value,
        "value": check.value,
        "margin": check.margin,
        "worst": check.worst,
        "worst_tai_ns": check.worst_tai_ns,
        "epochs": check.epochs,
        "broken": check.broken,
    }


def checks_document(checks: Sequence[Check]) -> Mapping[str, object]:
    """The checks as ``simgl assess --json`` prints them; nothing without requirements."""
    if not checks:
        return {}
    return {"passed": passed(checks), "requirements": [check_row(check) for check in checks]}


def checks_text(checks: Sequence[Check]) -> list[str]:
    """A line for each requirement, for a terminal."""
    lines = []
    for check in checks:
        one = check.requirement
        line = f"{check.outcome.value:<10} {one.key} {in_unit(one, one.limit)}"
        if check.value is not None:
            line += f": {in_unit(one, check.value)}, "
            line += f"margin {in_unit(one, check.margin, signed=True)}"
        lines.append(line)
    return lines
