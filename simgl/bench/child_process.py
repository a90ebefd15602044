"""Child processes of the benchmark: bounded in time, their end told in one line."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from simgl.errors import SimglError

# Of what a child said before it failed.
_LAST_LINES = 3
# Where simgl lies. Results are passed on, and need not tell it.
_FOLDER = f"{Path(__file__).parents[2]}{os.sep}"


class ChildError(SimglError):
    """A child process ended with an error or was too slow."""


def seconds_of(
    command: Sequence[str], limit_s: float, environment: Mapping[str, str] | None = None
) -> float:
    """Run a command to its end; seconds that it took.

    Raises ChildError, with the last lines of its stderr.
    """
    start = time.monotonic()
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            timeout=limit_s,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ChildError(f"did not end within {limit_s:.0f} s") from None
    except OSError as error:
        raise ChildError(f"{command[0]}: {error.strerror}") from None
    if done.returncode:
        raise ChildError(f"{_end(done.returncode)}: {_last_lines(done.stderr)}")
    return time.monotonic() - start


@contextmanager
def empty_caches() -> Iterator[dict[str, str]]:
    """The environment of a process that finds nothing computed before, nor its shaders compiled."""
    with tempfile.TemporaryDirectory(prefix="simgl-bench-") as folder:
        # NVIDIA's driver has a cache of its own.
        caches = ("XDG_CACHE_HOME", "__GL_SHADER_DISK_CACHE_PATH")
        environment = {**os.environ, **dict.fromkeys(caches, folder)}
        environment.pop("MESA_SHADER_CACHE_DIR", None)
        yield environment


def _end(status: int) -> str:
    if status < 0:
        return f"was ended by {signal.Signals(-status).name}"
    return f"ended with status {status}"


def _last_lines(text: str) -> str:
    lines = [line.strip() for line in text.replace(_FOLDER, "").splitlines() if line.strip()]
    return " / ".join(lines[-_LAST_LINES:]) or "without a word"
