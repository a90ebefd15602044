"""Two live sockets of one identity: both are told, and no image reaches the wrong one."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from simgl_bridge import Client, NoAnswerError, RemoteError

from simgl import Scenario
from tests.bridge.harness import Gate, RawLink, Running, header_of
from tests.patience import limit, wait_until

Starter = Callable[..., Running]
PROBLEM = 'another client uses the identity "twin", too; every client needs its own'


@pytest.mark.parametrize("transport", ["tcp", "ipc"])
def test_two_sockets_of_one_identity_are_both_told(
    start_server: Starter, scenario: Scenario, tmp_path: Path, transport: str
) -> None:
    address = "tcp://127.0.0.1:*" if transport == "tcp" else f"ipc://{tmp_path / 's'}"
    running = start_server(scenario, address)
    running.simulator.hook = gate = Gate()
    older = RawLink(running.address, identity=b"twin")
    shot = {"camera": "nav"}
    request = {"type": "render", "id": 1, "tai_ns": scenario.epoch_tai_ns, "cameras": [shot]}
    older.send([b"simgl/1", msgspec.msgpack.encode(request)])
    gate.wait()
    newer = RawLink(running.address, identity=b"twin")
    told = newer.ask_map({"type": "ping", "id": 1})
    assert (told["code"], told["id"], told["detail"]) == ("SHARED_IDENTITY", None, PROBLEM)
    # The older one has a request under way, and sends nothing more.
    told = header_of(older.receive())
    assert (told["code"], told["id"], told["detail"]) == ("SHARED_IDENTITY", None, PROBLEM)
    gate.open(0.0)
    older.close()
    # The image of the older one never reaches the newer one, which is served once it is alone.
    pongs = []

    def is_served() -> bool:
        newer.send([b"simgl/1", msgspec.msgpack.encode({"type": "ping", "id": 2})])
        while newer.has_reply():
            reply = header_of(newer.receive())
            assert reply["type"] in ("error", "pong")
            pongs.extend([reply] if reply["type"] == "pong" else [])
        return bool(pongs)

    wait_until(is_served, "an answer", 10.0)
    newer.close()
    running.stop.set()


def test_two_python_clients_of_one_identity_are_both_told(
    start_server: Starter, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    running = start_server(scenario)
    twin = uuid.uuid4()
    monkeypatch.setattr(uuid, "uuid4", lambda: twin)
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(5.0)) as older:
        older.render(now, "nav")
        with pytest.raises(RemoteError, match=r"SHARED_IDENTITY: another client uses the identity"):
            Client(running.address, timeout_s=limit(5.0))
        codes, reasons = [], set()

        def is_told() -> bool:
            try:
                older.render(now + 1, "nav")
            except RemoteError as error:
                codes.append(error.code)
            except NoAnswerError as error:
                # Its connection was ended, which it may notice first.
                reasons.add(error.reason)
            return bool(codes)

        wait_until(is_told, "the error", 10.0)
        assert codes == ["SHARED_IDENTITY"]
        assert reasons <= {"the connection broke"}
