"""Fixtures of every test: one OpenGL context, watched so that each test leaves it as it was."""

from __future__ import annotations

import ctypes
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import moderngl
import pytest

from simgl.disk_cache import cache_folder
from simgl.gpu.context import current
from tests.orphans import Guard
from tests.patience import limit
from tests.reference_compiler import check_programs, reference_compiler, version
from tests.shared_programs import SharedPrograms
from tests.watched_context import WatchedContext, hide_draws

# Of one test, with the fixtures that it is the first to need [s].
_LONGEST_TEST = 300.0
_GUARD = pytest.StashKey[Guard]()
# Files that take longer than 20 s of processor time, longest first. With one process a file, those
# that begin last end last.
_SLOWEST = (
    "examples/test_lighting_study.py",
    "examples/closed_loop/test_flight.py",
    "passes/test_earth_from_space.py",
    "passes/test_earth_light.py",
    "passes/test_air.py",
    "docs/test_tutorial.py",
    "viewer/test_window_events.py",
    "thermal/test_earth_heat.py",
    "passes/test_ground.py",
    "examples/test_bands.py",
    "bridge/test_fmu.py",
    "campaign/test_run_campaign.py",
    "radiometry/test_small_targets.py",
    "passes/test_air_tables.py",
    "passes/test_air_truth.py",
    "examples/test_short.py",
    "passes/test_calibrated_cameras.py",
    "radiometry/test_crescents.py",
    "simulator/test_failing_opengl.py",
    "simulator/test_moving.py",
)


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """A test that hangs is ended, later on a slow machine; signals reach what tests start.

    A shell ignores SIGINT for what it starts in the background and nohup SIGHUP; children inherit
    that.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    if config.option.timeout is None:
        config.option.timeout = limit(_LONGEST_TEST)
    config.stash[_GUARD] = Guard()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The slowest files come first."""
    rank = {Path(__file__).parent / name: place for place, name in enumerate(_SLOWEST)}
    assert all(path.exists() for path in rank)
    items.sort(key=lambda item: rank.get(item.path, len(rank)))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Nothing that the tests started outlives them."""
    config.stash[_GUARD].end()


@pytest.fixture(autouse=True)
def _signals_of_pytest(monkeypatch: pytest.MonkeyPatch) -> None:
    """A command that runs in this process leaves the handling of signals and faults to pytest."""
    monkeypatch.setattr("simgl.interruption.end_by_signals", lambda: None)


@pytest.fixture(scope="module", autouse=True)
def _free_memory_goes_back() -> Iterator[None]:
    """Of all that a module freed, the C library holds up to 2 GB back: too much for each of several
    processes."""
    yield
    if sys.platform == "linux" and (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)):
        trim(0)


@pytest.fixture(scope="session", autouse=True)
def _programs_pass_the_reference_compiler() -> Iterator[None]:
    """A test fails that compiles a program of which only this driver approves."""
    compiler = reference_compiler()
    if compiler is None:
        yield
        return
    with pytest.MonkeyPatch.context() as patch:
        passed = cache_folder("reference_compiler")
        check_programs(patch, compiler, passed, version(compiler))
        yield


@pytest.fixture(scope="session")
def _watched_context() -> Iterator[WatchedContext]:
    watched = WatchedContext()
    yield watched
    watched.release()


@pytest.fixture(scope="session")
def _shared_programs(
    _watched_context: WatchedContext, _programs_pass_the_reference_compiler: None
) -> Iterator[SharedPrograms]:
    """Programs of the context that all tests draw in are compiled once in a session."""
    shared = SharedPrograms(_watched_context)
    with pytest.MonkeyPatch.context() as patch:
        shared.share(patch)
        yield shared
    with current(_watched_context.ctx):
        shared.release()


@pytest.fixture(scope="module")
def module_gl(
    _watched_context: WatchedContext, _shared_programs: SharedPrograms
) -> Iterator[moderngl.Context]:
    """The context of ``gl`` for what the tests of a module share, such as a simulator.

    A context of its own would compile all programs again. Fails a module that leaves objects
    behind.
    """
    before = _shared_programs.living
    yield _watched_context.ctx
    _watched_context.check()
    left = dict(_shared_programs.living - before)
    assert not left, f"OpenGL objects left in the context: {left}"


@pytest.fixture
def gl(
    _watched_context: WatchedContext, _shared_programs: SharedPrograms
) -> Iterator[moderngl.Context]:
    """A headless context; fails a test that leaves an OpenGL error or object behind.

    Whoever draws states with what: what a test before this one left is no state to draw with.
    """
    _watched_context.check()
    before = _shared_programs.living
    with current(_watched_context.ctx) as ctx:
        hide_draws(ctx)
        yield ctx
    # Entered again: the test may have left another context current, or none.
    _watched_context.check()
    left = dict(_shared_programs.living - before)
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
