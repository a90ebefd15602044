"""Fixtures: a small scenario, and a server of it on a thread of this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from simgl_bridge import Client

from simgl import Scenario, load_scenario
from tests.bridge.harness import SCENARIO, RawLink, Running, finish, start


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
    with Client(running.address, timeout_s=20.0) as link:
        yield link


@pytest.fixture
def raw(running: Running) -> Iterator[RawLink]:
    link = RawLink(running.address)
    yield link
    link.close()


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
def connect() -> Iterator[Callable[[Running], RawLink]]:
    """Makes further raw links, which end with the test."""
    made: list[RawLink] = []

    def link(running: Running) -> RawLink:
        made.append(RawLink(running.address))
        return made[-1]

    yield link
    for one in made:
        one.close()
