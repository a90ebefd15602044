"""Fixtures of every test: one OpenGL context, watched so that each test leaves it as it was."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import shutil
import subprocess
from collections.abc import Iterator
from typing import Any

import moderngl
import pytest

from simgl.gpu.context import open_context

# Object names grow from 1; far more than any test makes.
_NAMES = 600
_KINDS = ("Texture", "Buffer", "Framebuffer", "Renderbuffer", "Program", "VertexArray", "Query")


@pytest.fixture(scope="session")
def _session_context() -> Iterator[moderngl.Context]:
    ctx = open_context()
    yield ctx
    ctx.release()


def _living_objects() -> dict[str, set[int]]:
    """Names of every object in the current context, by kind."""
    library = ctypes.CDLL(ctypes.util.find_library("GL") or "libGL.so.1")
    # A released program lives on while it is the current one.
    library.glUseProgram(0)
    return {
        kind: {name for name in range(1, _NAMES) if getattr(library, f"glIs{kind}")(name)}
        for kind in _KINDS
    }


@pytest.fixture
def gl(_session_context: moderngl.Context) -> Iterator[moderngl.Context]:
    """A headless context; fails a test that leaves an OpenGL error or object behind."""
    # Current for this test, whatever contexts other tests opened and closed.
    with _session_context as ctx:
        assert ctx.error == "GL_NO_ERROR"
        before = _living_objects()
        yield ctx
        assert ctx.error == "GL_NO_ERROR"
        after = _living_objects()
    left: dict[str, Any] = {k: sorted(after[k] - before[k]) for k in _KINDS if after[k] - before[k]}
    assert not left, f"OpenGL objects left in the context: {left}"


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """An X server of our own, on a number that it finds free."""
    server = shutil.which("Xvfb")
    if server is None:
        pytest.skip("Xvfb is not installed (apt-get install xvfb)")
    reading, writing = os.pipe()
    screen = ["-screen", "0", "1280x1024x24", "-nolisten", "tcp", "-displayfd", str(writing)]
    with subprocess.Popen(
        [server, *screen], pass_fds=[writing], stderr=subprocess.DEVNULL
    ) as process:
        os.close(writing)
        with os.fdopen(reading) as pipe:
            number = pipe.readline().strip()
        if not number:
            process.wait()
            pytest.skip(f"Xvfb does not start (exit status {process.returncode})")
        yield f":{number}"
        process.terminate()
