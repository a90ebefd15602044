"""A guard process: whatever the tests started and left running ends with them, even if killed."""

from __future__ import annotations

import os
import subprocess
import sys
from uuid import uuid4

# All descendants inherit it, however they are started.
_VARIABLE = "SIMGL_TEST_RUN"
_GUARD = """
import os, signal, sys
mark = sys.argv[1].encode()
sys.stdin.buffer.read()
for name in filter(str.isdecimal, os.listdir("/proc")):
    try:
        with open(f"/proc/{name}/environ", "rb") as file:
            environment = file.read().split(bytes(1))
        if mark in environment:
            os.kill(int(name), signal.SIGKILL)
    except OSError:
        continue
"""


class Guard:
    """Marks the children of this process, and kills what is left of them when it has ended."""

    def __init__(self) -> None:
        before = dict(os.environ)
        os.environ[_VARIABLE] = uuid4().hex
        mark = f"{_VARIABLE}={os.environ[_VARIABLE]}"
        # Its standard input ends with this process, in whatever way that ends.
        self._process = subprocess.Popen(
            [sys.executable, "-S", "-c", _GUARD, mark],
            stdin=subprocess.PIPE,
            env=before,
            start_new_session=True,
        )

    def end(self) -> None:
        """Kill what is left now."""
        self._process.communicate()
