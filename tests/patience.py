"""How long tests wait: limits as they suit the reference machine, longer on a slower or busy one.

Every wait of a test for a process, a socket or a thread takes its limit from here. A limit is ten
times what is expected; it only ends a test that would never end.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Sequence
from typing import Any

# What the fixed piece of work takes on the reference machine (README) with nothing beside it [s].
_REFERENCE = 0.12


def _slowness() -> float:
    """How many times slower than the reference machine this one is just now; at least 1."""
    start = time.perf_counter()
    sum(number * number % 7 for number in range(1_000_000))
    elapsed = time.perf_counter() - start
    # What waits for a processor now may all wait for it at once later.
    waiting = os.getloadavg()[0] / (os.cpu_count() or 1)
    return max(1.0, elapsed / _REFERENCE, waiting)


FACTOR = _slowness()


def limit(seconds: float) -> float:
    """A limit for the reference machine, stretched for this one [s]."""
    return seconds * FACTOR


def wait_until(
    condition: Callable[[], bool],
    what: str,
    seconds: float = 60.0,
    process: subprocess.Popen[bytes] | None = None,
) -> None:
    """Look again and again until a condition holds; fail where it never does.

    what : is waited for, in the message
    seconds : on the reference machine
    process : that has to live meanwhile; its end fails at once, with its stderr if that is a pipe
    """
    end = time.monotonic() + limit(seconds)
    while not condition():
        if process is not None and process.poll() is not None:
            said = process.stderr.read().decode() if process.stderr is not None else ""
            raise AssertionError(f"ended with {process.returncode} before {what}: {said}")
        assert time.monotonic() < end, f"{what}: not within {limit(seconds):.0f} s"
        time.sleep(0.005)


def run_to_end(
    command: Sequence[str], seconds: float = 240.0, *, check: bool = True, **options: Any
) -> subprocess.CompletedProcess[str]:
    """A command's output as text; fails with its stderr where it ends with another code than 0.

    seconds : on the reference machine; a command that hangs fails
    check : False accepts any code
    """
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=limit(seconds), check=False, **options
    )
    assert not check or done.returncode == 0, (
        f"{command} ends with {done.returncode}: {done.stderr}"
    )
    return done
