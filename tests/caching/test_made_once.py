"""Files of the cache that several processes lack at the same time."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest

from simgl import disk_cache
from simgl.disk_cache import computed_once, made_once

# Leaves a letter for each time it computes, and takes its time.
_COMPUTE = """
import sys, time
import numpy as np
from simgl.disk_cache import computed_once

def compute():
    with open(sys.argv[1], "a") as log:
        log.write("c")
    time.sleep(float(sys.argv[2]))
    return {"codes": np.arange(6)}

print(computed_once("some", ["numpy"], "table", compute)["codes"].sum())
"""
_TIME_LIMIT_S = 60.0


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "simgl" / "some"


def _start(log: Path, seconds: float) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", _COMPUTE, str(log), str(seconds)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def _wait_until_computing(log: Path) -> None:
    end = monotonic() + _TIME_LIMIT_S
    while not log.is_file() or not log.read_text():
        assert monotonic() < end
        sleep(0.02)


def test_processes_that_start_together_compute_once(tmp_path: Path, cache: Path) -> None:
    log = tmp_path / "log"
    processes = [_start(log, 2.0) for _ in range(3)]
    outputs = [process.communicate(timeout=_TIME_LIMIT_S)[0] for process in processes]
    assert outputs == ["15\n"] * 3
    assert log.read_text() == "c"
    assert [path.suffix for path in cache.iterdir()] == [".npz"]


def test_a_process_that_dies_while_it_computes_leaves_the_work_to_the_next(tmp_path: Path) -> None:
    log = tmp_path / "log"
    first = _start(log, _TIME_LIMIT_S)
    _wait_until_computing(log)
    second = _start(log, 0.0)
    first.send_signal(signal.SIGKILL)
    assert second.communicate(timeout=_TIME_LIMIT_S)[0] == "15\n"
    first.communicate(timeout=_TIME_LIMIT_S)
    assert log.read_text() == "cc"


def test_threads_of_one_process_compute_once() -> None:
    calls = []

    def compute() -> dict[str, np.ndarray]:
        calls.append(1)
        sleep(0.3)
        return {"codes": np.arange(6)}

    with ThreadPoolExecutor(4) as pool:
        tables = pool.map(lambda _: computed_once("some", ["numpy"], 1, compute), range(4))
        assert [int(arrays["codes"].sum()) for arrays in tables] == [15] * 4
    assert len(calls) == 1


def test_nobody_waits_for_ever_for_a_process_that_stands_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk_cache, "LONGEST_WAIT_S", 0.2)
    path = tmp_path / "file.npz"
    held = os.open(path.with_suffix(".lock"), os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert made_once(path, lambda: None, lambda: 3) == 3
        # The lock is still that of whom it belongs to.
        assert path.with_suffix(".lock").is_file()
    finally:
        os.close(held)


def test_an_error_while_a_file_is_made_frees_its_lock(tmp_path: Path) -> None:
    path = tmp_path / "file.npz"

    def fail() -> int:
        raise ValueError("no table")

    with pytest.raises(ValueError, match="no table"):
        made_once(path, lambda: None, fail)
    assert made_once(path, lambda: None, lambda: 3) == 3
    assert not list(tmp_path.iterdir())
