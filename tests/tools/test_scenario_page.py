"""The reference of scenario keys is that of the schema, and each example is allowed."""

from __future__ import annotations

import msgspec
import pytest

from simgl.config.value_types import Table
from tools.scenario_page import PAGE, TABLES, example_of, page


def test_the_page_is_that_of_the_schema() -> None:
    """Otherwise: python -m tools.scenario_page."""
    assert PAGE.read_text(encoding="utf-8") == page()


@pytest.mark.parametrize("table", TABLES.values(), ids=lambda t: t.__name__)
def test_every_key_has_an_example_that_is_allowed(table: type[Table]) -> None:
    for field in msgspec.structs.fields(table):
        example = example_of(table, field)
        assert example is not None, field.name
        msgspec.convert(example, field.type, strict=False)


def test_limits_units_and_needs_are_those_of_the_keys() -> None:
    rows = {line.split("`")[1]: line for line in page().splitlines() if line.startswith("| `")}
    assert "| m/s | number >= 0, <= 40 |" in rows["wind_m_s"]
    assert "| integer >= 8, <= 16 |" in rows["bits"]
    assert "| needed |" in rows["utc"]
    assert "| `4.0` |" in rows["f_number"]
