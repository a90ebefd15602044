"""The client's protocol without a socket: retries, breaks and deadlines are data."""

from __future__ import annotations

import time

import pytest
import zmq
from simgl_bridge import NoAnswerError, RemoteError
from simgl_bridge.client_call import Call
from simgl_bridge.client_protocol import ClientProtocol
from simgl_bridge.framing import pack
from simgl_bridge.message_parts import Shot
from simgl_bridge.messages import (
    Bye,
    Error,
    Message,
    Next,
    Ping,
    Pong,
)


@pytest.fixture
def protocol() -> ClientProtocol:
    """A protocol whose connection is up."""
    protocol = ClientProtocol("tcp://127.0.0.1:1")
    protocol.handle_event(zmq.EVENT_HANDSHAKE_SUCCEEDED)
    return protocol


def arrive(protocol: ClientProtocol, message: Message) -> None:
    """A message comes in."""
    protocol.handle_frames([memoryview(frame) for frame in pack(message)])


def error(id: int | None, code: str = "BUSY") -> Error:
    return Error(id=id, code=code, field="", detail="full", retryable=True)


def test_a_request_is_due_once_and_its_reply_ends_the_call(protocol: ClientProtocol) -> None:
    call = Call(Ping(id=1), Pong, 10.0)
    protocol.open(call)
    assert protocol.due(call) == pack(Ping(id=1))
    assert protocol.due(call) is None
    arrive(protocol, Pong(id=2, boot="another"))
    assert not call.done
    arrive(protocol, Pong(id=1, boot="b"))
    assert call.result()[0] == Pong(id=1, boot="b")


def test_a_break_fails_what_was_sent_and_nothing_else(protocol: ClientProtocol) -> None:
    sent, waiting = Call(Ping(id=1), Pong, 10.0), Call(Ping(id=2), Pong, 10.0)
    for call in (sent, waiting):
        protocol.open(call)
    protocol.due(sent)
    assert protocol.handle_event(zmq.EVENT_DISCONNECTED)
    protocol.handle_break()
    with pytest.raises(NoAnswerError, match="the connection broke, waiting for ping"):
        sent.result()
    assert protocol.due(waiting) == pack(Ping(id=2))


def test_a_retry_is_due_at_once_and_only_once(protocol: ClientProtocol) -> None:
    call = Call(Ping(id=1), Pong, 10.0, attempts=2)
    protocol.open(call)
    for _ in range(2):
        assert not call.done
        assert protocol.due(call) == pack(Ping(id=1))
        arrive(protocol, Bye(boot="b"))
    with pytest.raises(NoAnswerError, match="the server said goodbye"):
        call.result()


@pytest.mark.parametrize("code", ["RENDERER_LOST", "GPU_LOST"])
def test_a_retry_is_for_a_lost_renderer_too(protocol: ClientProtocol, code: str) -> None:
    call = Call(Ping(id=1), Pong, 10.0, attempts=2)
    protocol.open(call)
    for _ in range(2):
        assert not call.done
        assert protocol.due(call) == pack(Ping(id=1))
        arrive(protocol, error(1, code))
    with pytest.raises(RemoteError, match=code):
        call.result()


@pytest.mark.parametrize("retry_busy", [False, True])
def test_a_busy_server_is_asked_again_after_a_pause(
    protocol: ClientProtocol, retry_busy: bool
) -> None:
    changes: list[bool] = []
    call = Call(
        Ping(id=1), Pong, 10.0, retry_busy=retry_busy, on_change=lambda: changes.append(call.done)
    )
    protocol.open(call)
    protocol.due(call)
    arrive(protocol, error(1))
    assert changes == [not retry_busy]
    if not retry_busy:
        with pytest.raises(RemoteError, match="BUSY: full"):
            call.result()
        return
    assert time.monotonic() < call.wake_at < call.deadline
    assert protocol.due(call) is None
    # Nothing that happens in the pause concerns it.
    protocol.handle_break()
    time.sleep(max(call.wake_at - time.monotonic(), 0.0))
    assert protocol.due(call) == pack(Ping(id=1))


def test_a_deadline_is_no_later_for_what_never_left(protocol: ClientProtocol) -> None:
    call = Call(Ping(id=1), Pong, 0.05)
    protocol.open(call)
    protocol.due(call)
    assert call.wake_at == call.deadline
    time.sleep(0.06)
    assert protocol.due(call) is None
    with pytest.raises(NoAnswerError, match=r"no answer within 0\.05 s, waiting for ping"):
        call.result()


def test_a_refused_state_fails_the_next_call_that_waits(protocol: ClientProtocol) -> None:
    state = protocol.state(0, [Shot(camera="nav")], None)
    protocol.remember(state)
    pending, images = Call(Ping(id=11), Pong, 10.0), Call(Next(id=12), Pong, 10.0)
    for call in (pending, images):
        protocol.open(call)
        protocol.due(call)
    arrive(protocol, error(99, "NO_CAMERA"))
    assert not images.done
    arrive(protocol, error(state.id, "NO_CAMERA"))
    # A call that is under way gets its own reply.
    assert not pending.done
    with pytest.raises(RemoteError, match="NO_CAMERA"):
        images.result()


def test_a_state_refused_while_nobody_waited_fails_the_next_call(protocol: ClientProtocol) -> None:
    state = protocol.state(0, [Shot(camera="nav")], None)
    protocol.remember(state)
    arrive(protocol, error(state.id, "NOT_OWNER"))
    first, second = Call(Next(id=11), Pong, 10.0), Call(Next(id=12), Pong, 10.0)
    protocol.open(first)
    with pytest.raises(RemoteError, match="NOT_OWNER"):
        first.result()
    # It is told once.
    protocol.open(second)
    assert not second.done


def test_a_shared_identity_is_told_to_the_next_call(protocol: ClientProtocol) -> None:
    # A client that is between two calls whenever it is told would never learn of it.
    arrive(protocol, error(None, "SHARED_IDENTITY"))
    next_call = Call(Ping(id=1), Pong, 5.0)
    protocol.open(next_call)
    with pytest.raises(RemoteError, match="SHARED_IDENTITY"):
        next_call.result()
    protocol.close(next_call)
    later = Call(Ping(id=2), Pong, 5.0)
    protocol.open(later)
    assert not later.done
