"""The asyncio client: several requests under way, and the same errors in time."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simgl_bridge import AsyncClient, Client, Image, NoAnswerError, RemoteError, Shot

from simgl import Scenario, load_scenario
from simgl.errors import BridgeError
from tests.bridge.harness import LIT_SCENARIO, TURNING, Gate, Running
from tests.patience import limit

Starter = Callable[..., Running]


def test_it_gets_what_the_synchronous_client_gets(
    running: Running, client: Client, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns

    async def ask() -> tuple[np.ndarray, np.ndarray]:
        async with AsyncClient(running.address, timeout_s=limit(20.0)) as link:
            assert link.welcome.seed == 7
            assert await link.ping() < limit(5.0)
            image = await link.render(now, "nav")
            tick = await link.render_all(now, [Shot(camera="side"), Shot(camera="nav")])
            return image.dn, tick["nav"].dn

    for dn in asyncio.run(ask()):
        np.testing.assert_array_equal(dn, client.render(now, "nav").dn)


def test_it_says_of_a_scene_what_the_synchronous_client_says(
    start_server: Starter, tmp_path: Path
) -> None:
    path = tmp_path / "lit.toml"
    path.write_text(LIT_SCENARIO)
    scenario = load_scenario(path)
    running, now = start_server(scenario), scenario.epoch_tai_ns
    said: list[dict[str, Any]] = [
        {"moving": True},
        {"lamps": {"flood": 0.5}},
        {"sun_position_m": (1e11, -5e10, 9e10), "gain_dn_per_e": 0.125},
        {"draw": 3},
        {"seek": True},
    ]
    times = [now + 1, now + 1, now + 1, now + 1, now]
    bodies = {"chaser": TURNING}

    async def ask() -> list[Image]:
        async with AsyncClient(running.address, timeout_s=limit(20.0)) as link:
            images = []
            for when, words in zip(times, said, strict=True):
                images.append(await link.render(when, "nav", bodies, 0.1, **words))
            return images

    images = asyncio.run(ask())
    with Client(running.address, timeout_s=limit(20.0)) as client:
        for when, words, image in zip(times, said, images, strict=True):
            same = client.render(when, "nav", bodies, 0.1, **words)
            assert image.state_hash == same.state_hash
            np.testing.assert_array_equal(image.dn, same.dn)
    assert len({image.dn.tobytes() for image in images}) == 5


def test_more_requests_than_the_window_wait_here_and_none_is_busy(
    running: Running, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns

    async def ask() -> list[int]:
        async with AsyncClient(running.address, timeout_s=limit(60.0)) as link:
            images = await asyncio.gather(*(link.render(now + i, "nav") for i in range(8)))
            return [image.tai_ns - now for image in images]

    assert asyncio.run(ask()) == list(range(8))


def test_a_refusal_reaches_the_request_that_it_is_for(running: Running, scenario: Scenario) -> None:
    now = scenario.epoch_tai_ns

    async def ask() -> None:
        async with AsyncClient(running.address, timeout_s=limit(20.0)) as link:
            good, bad = await asyncio.gather(
                link.render(now, "nav"), link.render(now, "nva"), return_exceptions=True
            )
            assert not isinstance(good, BaseException)
            assert isinstance(bad, RemoteError)
            assert bad.code == "NO_CAMERA"

    asyncio.run(ask())


def test_its_waits_end(start_server: Starter, scenario: Scenario) -> None:
    running = start_server(scenario)
    now = scenario.epoch_tai_ns

    async def ask() -> None:
        async with AsyncClient(running.address, timeout_s=limit(20.0)) as link:
            await link.render(now, "nav")
            link.timeout_s = 0.3
            running.simulator.hook = gate = Gate()
            with pytest.raises(RemoteError, match=r"DEADLINE: deadline_ms is over: too late"):
                await link.render(now + 1, "nav")
            gate.open(0.0)
            running.simulator.hook = None
            link.timeout_s = limit(20.0)
            assert (await link.render(now + 2, "nav")).tai_ns == now + 2
            running.simulator.hook = second = Gate()
            waiting = asyncio.create_task(link.render(now + 3, "nav"))
            await asyncio.to_thread(second.wait)
            other = asyncio.create_task(link.render(now + 4, "nav"))
            await asyncio.sleep(0.2)
            running.stop.set()
            second.open(0.0)
            start = time.monotonic()
            assert (await waiting).tai_ns == now + 3
            with pytest.raises(NoAnswerError, match="the server said goodbye"):
                await other
            assert time.monotonic() - start < limit(10.0)

    asyncio.run(ask())


def test_what_was_given_up_makes_none_of_the_next_busy(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    now = scenario.epoch_tai_ns

    async def ask() -> list[int]:
        async with AsyncClient(running.address, timeout_s=limit(20.0)) as link:
            running.simulator.hook = gate = Gate()
            given_up = [asyncio.create_task(link.render(now + i, "nav")) for i in range(2)]
            await asyncio.to_thread(gate.wait)
            for _ in range(2):
                for task in given_up:
                    task.cancel()
                await asyncio.gather(*given_up, return_exceptions=True)
                given_up = [asyncio.create_task(link.render(now + 2, "nav")) for _ in range(2)]
                await asyncio.sleep(0.1)
            asyncio.get_running_loop().call_later(0.2, gate.open, 0.0)
            return [image.tai_ns - now for image in await asyncio.gather(*given_up)]

    assert asyncio.run(ask()) == [2, 2]


def test_an_error_that_names_no_request_ends_the_wait_at_once(running: Running) -> None:
    async def ask() -> None:
        async with AsyncClient(running.address, timeout_s=limit(60.0)) as link:
            crowd = {f"{number:06}{'x' * 60}": TURNING for number in range(400)}
            start = time.monotonic()
            # Of a header too large to be read the server cannot say whose it is.
            with pytest.raises(RemoteError, match="TOO_LARGE: header must be at most 65536 bytes"):
                await link.render(0, "nav", crowd)
            assert time.monotonic() - start < limit(10.0)
            assert await link.ping() < limit(10.0)

    asyncio.run(ask())


def test_a_client_that_is_not_open_says_so(running: Running) -> None:
    link = AsyncClient(running.address)

    async def ask() -> None:
        with pytest.raises(BridgeError, match="this client is not open; it opens with async with"):
            await link.ping()
        async with link:
            assert await link.ping() < limit(10.0)
        with pytest.raises(BridgeError, match="this client is not open"):
            await link.render(0, "nav")

    asyncio.run(ask())


def test_without_a_server_it_gives_up() -> None:
    async def ask() -> None:
        async with AsyncClient("tcp://127.0.0.1:1", timeout_s=0.3):
            raise AssertionError("nobody is there")

    with pytest.raises(NoAnswerError, match=r"no connection within 0\.3 s, waiting for hello"):
        asyncio.run(ask())
