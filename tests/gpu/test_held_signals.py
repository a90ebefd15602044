"""Ctrl-C while a shader is compiled ends the program as at any other time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

from simgl.gpu.held_signals import signals_held

# moderngl calls this function for each block of uniforms, and does not look at whether it raised.
_INTERRUPTED = """
import signal
import _moderngl
from simgl.gpu.context import temporary_context
from simgl.passes.background.sun import SunPass

describe = _moderngl.make_uniform_block

def interrupted(*arguments):
    signal.raise_signal(signal.SIGINT)
    return describe(*arguments)

_moderngl.make_uniform_block = interrupted
with temporary_context() as ctx:
    try:
        SunPass(ctx)
    except KeyboardInterrupt:
        print("interrupted")
"""


def test_an_interrupt_while_a_shader_is_compiled_comes_after_it() -> None:
    command = [sys.executable, "-c", _INTERRUPTED]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)
    assert (done.returncode, done.stdout) == (0, "interrupted\n"), done.stderr


def test_a_held_signal_comes_at_the_end_to_who_had_it_before() -> None:
    came: list[int] = []
    before = signal.signal(signal.SIGUSR1, lambda number, _: came.append(number))
    try:
        with signals_held():
            os.kill(os.getpid(), signal.SIGUSR1)
            assert came == []
        assert came == [signal.SIGUSR1]
        assert signal.getsignal(signal.SIGUSR1) != before
    finally:
        signal.signal(signal.SIGUSR1, before)
