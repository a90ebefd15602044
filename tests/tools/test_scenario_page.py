"""The reference of scenario keys is that of the schema, and each example is allowed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

import msgspec
import pytest

from simgl.config.value_types import Table
from tools.scenario_page import PAGE, TABLES, example_of, meanings_of, page


def test_the_page_is_that_of_the_schema() -> None:
    """Otherwise: python -m tools.scenario_page."""
    assert PAGE.read_text(encoding="utf-8") == page()


@pytest.mark.parametrize("table", TABLES.values(), ids=lambda t: t.__name__)
def test_every_key_has_an_example_that_is_allowed(table: type[Table]) -> None:
    for field in msgspec.structs.fields(table):
        example = example_of(table, field)
        assert example is not None, field.name
        msgspec.convert(example, field.type, strict=False)


@pytest.mark.parametrize("table", TABLES.values(), ids=lambda t: t.__name__)
def test_every_key_says_what_it_is(table: type[Table]) -> None:
    keys = {field.encode_name for field in msgspec.structs.fields(table)}
    assert keys == keys & meanings_of(table).keys()


def test_the_page_has_every_table_within_another() -> None:
    assert all(table in TABLES.values() for one in TABLES.values() for table in tables_in(one))


def tables_in(node: Any) -> Iterator[type]:
    """The tables that the keys of a table, or a type, may hold."""
    is_table = isinstance(node, type) and issubclass(node, Table)
    fields = msgspec.structs.fields(node) if is_table else ()
    for inner in (*(field.type for field in fields), *get_args(node)):
        if isinstance(inner, type) and issubclass(inner, Table):
            yield inner
        else:
            yield from tables_in(inner)


def test_limits_units_and_needs_are_those_of_the_keys() -> None:
    rows = {line.split("`")[1]: line for line in page().splitlines() if line.startswith("| `")}
    assert "| m/s | number >= 0, <= 40 |" in rows["wind_m_s"]
    assert "| integer >= 8, <= 16 |" in rows["bits"]
    assert "| needed |" in rows["utc"]
    assert "| `4.0` |" in rows["f_number"]
