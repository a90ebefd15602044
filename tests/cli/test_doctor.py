"""What ``simgl doctor`` says before long runs."""

from __future__ import annotations

import dataclasses
import os

import pytest

from simgl.doctor import advice
from simgl.gpu.context import GlReport

LLVMPIPE = GlReport(
    backend="egl",
    vendor="Mesa",
    renderer="llvmpipe (LLVM 15.0.6, 256 bits)",
    version="4.5 (Core Profile) Mesa 22.3.6",
    software=True,
)


@pytest.fixture(autouse=True)
def _two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.delenv("LP_NUM_THREADS", raising=False)


@pytest.mark.parametrize("threads", [None, "1", "2"])
def test_llvmpipe_with_threads_is_told_in_one_line(
    threads: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    if threads is not None:
        monkeypatch.setenv("LP_NUM_THREADS", threads)
    line = advice(LLVMPIPE)
    assert line is not None
    assert "LP_NUM_THREADS=0" in line
    assert "\n" not in line


def test_nothing_is_told_where_there_are_no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    gpu = dataclasses.replace(LLVMPIPE, renderer="NVIDIA H100/PCIe/SSE2", software=False)
    assert advice(gpu) is None
    monkeypatch.setenv("LP_NUM_THREADS", "0")
    assert advice(LLVMPIPE) is None
    # As Mesa does by itself on a single core.
    monkeypatch.delenv("LP_NUM_THREADS")
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    assert advice(LLVMPIPE) is None
