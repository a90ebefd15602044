"""Processes of simgl never wake a second thread of numpy's linear algebra.

At real-time priority on two cores such a thread, which waits in a loop, kept the thread that it
waited for from running: a first image took 15 minutes instead of seconds.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

# Runs the command line up to its command; prints how many threads a large product then uses.
THREADS_OF_COMMAND = """
import os, sys
from simgl import cli
def run():
    import numpy as np
    square = np.ones((1000, 1000))
    square @ square
    print(len(os.listdir("/proc/self/task")))
import simgl.commands
class application:
    run = staticmethod(run)
sys.modules["simgl.commands.application"] = application
cli.main()
"""


def threads_of_command(**variables: str) -> int:
    environment = {name: value for name, value in os.environ.items() if "_NUM_THREADS" not in name}
    done = subprocess.run(
        [sys.executable, "-c", THREADS_OF_COMMAND],
        env={**environment, **variables},
        capture_output=True,
        text=True,
        check=True,
    )
    return int(done.stdout)


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="counts threads as Linux does")
def test_a_product_in_a_command_stays_in_its_thread() -> None:
    assert threads_of_command() == 1


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="needs two cores")
def test_a_number_of_threads_that_the_user_sets_stays() -> None:
    assert threads_of_command(OPENBLAS_NUM_THREADS="2") == 2
