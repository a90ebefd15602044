"""Damaged files of every kind are read or refused by one line; the long run is a benchmark."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from benchmarks.damaged_files.damages import damage_one
from benchmarks.damaged_files.valid_files import READERS, check_valid, write_all
from simgl.errors import SimglError
from tests.input_files.special_files import no_waiting

SEED, ROUNDS = 20261122, 4


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a valid file of every kind."""
    folder = tmp_path_factory.mktemp("valid")
    write_all(folder)
    check_valid(folder)
    return folder


@pytest.mark.parametrize("number", range(len(READERS)))
def test_damaged_files_are_read_or_refused_in_one_line(
    number: int, valid: Path, tmp_path: Path
) -> None:
    """``python -m benchmarks.damaged_files`` also draws what is read."""
    for turn in range(ROUNDS):
        folder = tmp_path / str(turn)
        shutil.copytree(valid, folder)
        name, what = damage_one(number + turn * len(READERS), SEED, folder)
        refusal = ""
        try:
            with no_waiting():
                READERS[name](folder)
        except SimglError as error:
            refusal = str(error)
        assert "\n" not in refusal, what
        assert len(refusal) < 5000, what
