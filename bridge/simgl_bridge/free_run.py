"""Free-run: the newest state, its owner, its images, and the clients that wait for them."""

from __future__ import annotations

import time
from dataclasses import dataclass

import msgspec

from simgl_bridge.client_sessions import OWNER_SILENCE, Frames
from simgl_bridge.framing import BadMessageError, error_of, pack
from simgl_bridge.image_replies import ImageReplies, planes_of
from simgl_bridge.messages import Error, ErrorCode, Images, Next, State
from simgl_bridge.render_queue import RenderQueue
from simgl_bridge.renderer_link import Payload
from simgl_bridge.renderer_messages import Answer, Drawn, Task
from simgl_bridge.router_socket import RouterSocket
from simgl_bridge.server import Work
from simgl_bridge.validate_request import check_request

# A client that waits for images sends its request again after this [s].
LONGEST_WAIT = 10.0
# Clients that may wait at once.
MAX_WAITING_CLIENTS = 256
# Identity in the queue of the free-run stream; no client can have it.
_STREAM = b""


@dataclass(frozen=True)
class StreamedImages:
    """The last images of the stream: their reply except for its id, and the payload frames."""

    images: Images
    pixels: Frames


class StateStream:
    """The newest state, and how many were replaced unrendered.

    interval : shortest time between two replies with images [s]
    """

    def __init__(self, interval: float) -> None:
        self._interval = interval
        self._due = 0.0
        self.owner: bytes | None = None
        self._owner_heard = 0.0
        self._newest: State | None = None
        self._dropped = 0
        self._waiting: dict[bytes, tuple[Next, float]] = {}
        self.owner_name = ""
        self.last: StreamedImages | None = None

    def accept(self, client: bytes, name: str, state: State, now: float) -> bool:
        """Take a client's state as the newest; False where another client owns the stream."""
        if self.owner != client:
            if self.owner is not None and now - self._owner_heard < OWNER_SILENCE:
                return False
            # Images of another simulation mean nothing to this one.
            self.forget(self.owner)
        self.owner, self.owner_name, self._owner_heard = client, name, now
        if self._newest is not None:
            self._dropped += 1
        self._newest = state
        return True

    def forget(self, client: bytes | None) -> None:
        """Free the stream of a client that left, as its owner or as one that waits."""
        if client is None:
            return
        self._waiting.pop(client, None)
        if client == self.owner:
            self.owner, self._newest, self._dropped, self.last = None, None, 0, None

    def due(self, now: float) -> bool:
        """Whether a state is to be rendered now."""
        return self._newest is not None and now >= self._due

    def take(self, now: float) -> tuple[bytes, State, int] | None:
        """Owner, newest state, and how many it replaced; None where the owner has left."""
        if self._newest is None or self.owner is None:
            return None
        state, dropped = self._newest, self._dropped
        self._newest, self._dropped = None, 0
        self._due = now + self._interval
        return self.owner, state, dropped

    def wait(self, client: bytes, request: Next, now: float) -> bool:
        """Let a client wait for the next images; False where too many do."""
        if len(self._waiting) >= MAX_WAITING_CLIENTS and client not in self._waiting:
            return False
        asked = request.deadline_ms
        seconds = LONGEST_WAIT if asked is None else min(asked * 1e-3, LONGEST_WAIT)
        self._waiting[client] = (request, now + seconds)
        return True

    def take_answered(self) -> list[tuple[bytes, Next]]:
        """Remove and return the requests that the last images answer."""
        if self.last is None:
            return []
        sequence = self.last.images.sequence
        return self._remove([c for c, (r, _) in self._waiting.items() if sequence > r.after])

    def take_overdue(self, now: float) -> list[tuple[bytes, Next]]:
        """Remove and return the requests whose deadline is over."""
        return self._remove([c for c, (_, deadline) in self._waiting.items() if now >= deadline])

    def _remove(self, clients: list[bytes]) -> list[tuple[bytes, Next]]:
        return [(client, self._waiting.pop(client)[0]) for client in clients]

    def next_event(self) -> float:
        """When something is due at the latest [s, monotonic]."""
        times = [deadline for _, deadline in self._waiting.values()]
        if self._newest is not None:
            times.append(self._due)
        return min(times, default=float("inf"))


class FreeRun:
    """Draws the newest state of the stream and answers the clients that wait for its images.

    interval : shortest time between two replies with images [s]
    """

    def __init__(
        self, queue: RenderQueue, router: RouterSocket, replies: ImageReplies, interval: float
    ) -> None:
        self._queue, self._router, self._replies = queue, router, replies
        self._stream = StateStream(interval)

    def accept_state(self, client: bytes, name: str, state: State) -> None:
        """Take the state of a client as the newest; raises BadMessageError where it is refused."""
        scene = self._queue.scene
        if scene is None:
            problem = f"the server is {self._queue.status.state}, and cannot check a state yet"
            raise BadMessageError(ErrorCode.NOT_READY, "", problem, state.id, retryable=True)
        check_request(scene, state)
        if not self._stream.accept(client, name, state, time.monotonic()):
            problem = f'"{self._stream.owner_name}" streams states here; it has not left'
            code = ErrorCode.NOT_OWNER
            raise BadMessageError(code, "", problem, state.id, retryable=True)

    def wait_for_images(self, client: bytes, request: Next) -> None:
        """Answer a client with the next images; raises BadMessageError where too many wait."""
        if not self._stream.wait(client, request, time.monotonic()):
            problem = "too many clients wait for the next image"
            raise BadMessageError(ErrorCode.BUSY, "", problem, request.id, retryable=True)
        self._answer_waiting()

    def forget(self, client: bytes) -> None:
        """Free the stream of a client that left."""
        self._stream.forget(client)

    def update(self, now: float) -> float:
        """Queue the newest state and refuse what is overdue at a time [s, monotonic].

        Returns when something is due at the latest.
        """
        if self._stream.due(now) and not self._queue.has(_STREAM, _STREAM):
            self._queue.offer(_STREAM, self._work())
        for client, request in self._stream.take_overdue(now):
            problem = f"no image after sequence {request.after} came in time"
            code = ErrorCode.DEADLINE
            self._router.refuse(
                client, error_of(BadMessageError(code, "", problem, request.id, retryable=True))
            )
        return self._stream.next_event()

    def _work(self) -> Work:
        """Draws the state that is the newest at its turn."""
        taken: list[tuple[bytes, State, int]] = []

        def begin() -> Task | None:
            if (newest := self._stream.take(time.monotonic())) is None:
                return None
            taken.append(newest)
            owner, state, _ = newest
            return self._router.answer_or_refuse(owner, lambda: self._begin(state), state.id)

        def finish(answer: Answer, payload: Payload, late: bool) -> None:
            del late
            owner, state, dropped = taken[0]
            self._router.answer_or_refuse(
                owner, lambda: self._finish(owner, state, dropped, answer, payload), state.id
            )

        return Work(key=_STREAM, begin=begin, finish=finish)

    def _begin(self, state: State) -> Task:
        # The scene may be another one since it came.
        assert self._queue.scene is not None
        check_request(self._queue.scene, state)
        return self._replies.task(state)

    def _finish(
        self, owner: bytes, state: State, dropped: int, answer: Answer, payload: Payload
    ) -> None:
        if isinstance(answer, Error):
            self._router.refuse(owner, msgspec.structs.replace(answer, id=state.id))
            return
        assert isinstance(answer, Drawn)
        images = msgspec.structs.replace(
            self._replies.reply(state, answer), state_id=state.id, dropped=dropped
        )
        if self._stream.owner == owner:
            self._stream.last = StreamedImages(images, planes_of(answer, payload))
            self._answer_waiting()
        self._replies.publish(images, answer, payload)

    def _answer_waiting(self) -> None:
        last = self._stream.last
        for client, request in self._stream.take_answered():
            assert last is not None
            images = msgspec.structs.replace(last.images, id=request.id)
            self._router.send(client, [*pack(images), *last.pixels])
