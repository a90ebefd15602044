"""Fixtures: a small scenario, and a server of it on a thread of this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from simgl_bridge import Client

from simgl import Scenario, load_scenario
from tests.bridge.compiled import cpp_program, what_is_missing
from tests.bridge.harness import SCENARIO, Proxy, RawLink, Running, finish, newer, start
from tests.patience import limit


@pytest.fixture(scope="session")
def scenario_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bridge") / "small.toml"
    path.write_text(SCENARIO)
    return path


@pytest.fixture(scope="session")
def scenario(scenario_path: Path) -> Scenario:
    return load_scenario(scenario_path)


@pytest.fixture(scope="session")
def running(scenario: Scenario) -> Iterator[Running]:
    server = start(scenario)
    yield server
    finish(server)


@pytest.fixture
def client(running: Running) -> Iterator[Client]:
    with Client(running.address, timeout_s=limit(20.0)) as link:
        yield link


@pytest.fixture(autouse=True)
def no_link_stays_open() -> Iterator[None]:
    yield
    while RawLink.made:
        RawLink.made.pop().close()


@pytest.fixture
def raw(running: Running) -> RawLink:
    return RawLink(running.address)


@pytest.fixture
def start_server() -> Iterator[Callable[..., Running]]:
    """Starts further servers, which end with the test."""
    started: list[Running] = []

    def begin(scenario: Scenario, address: str = "tcp://127.0.0.1:*", **options: Any) -> Running:
        started.append(start(scenario, address, **options))
        return started[-1]

    yield begin
    for server in started:
        finish(server)


@pytest.fixture
def connect() -> Callable[[Running], RawLink]:
    """Makes further raw links, which end with the test."""
    return lambda running: RawLink(running.address)


@pytest.fixture
def newer_address(running: Running) -> Iterator[str]:
    """Where the running server answers as a newer one."""
    proxy = Proxy(running.address, change=newer)
    yield proxy.address
    proxy.close()


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Compiles sources and links them with libzmq: ``build(name, *sources)``."""
    folder = tmp_path_factory.mktemp("cpp")
    if missing := what_is_missing(folder):
        pytest.skip(missing)
    return partial(cpp_program, folder)
