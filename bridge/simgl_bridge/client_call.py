"""A request of a client until its reply: timeouts, pings, retries. It knows no socket.

Times are those of ``time.monotonic`` [s].
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from simgl.errors import BridgeError, ConfigError
from simgl_bridge.client_errors import NoAnswerError, RemoteError
from simgl_bridge.messages import (
    ErrorCode,
    Hello,
    Message,
    Next,
)

# A server's deadline ends this much before the client's own [s].
_MARGIN = 0.2
# The longest deadline that a server accepts [s].
LONGEST_DEADLINE = 3600.0
# A server that says nothing for so long is given up, unless a client sets another time [s]. It
# answers pings while it starts and while it draws.
SILENCE = 10.0
# A server that starts is given up after this [s]: light of a large model is traced for minutes.
READY_TIMEOUT = 600.0
# Pings while a client waits for a server that is starting or drawing [s].
_PING_INTERVAL = 1.0
# What drew the request is gone, and the server starts another one.
_LOST = (ErrorCode.RENDERER_LOST, ErrorCode.GPU_LOST)
# Before a request that was BUSY is sent again [s].
BUSY_PAUSE = 0.02

Payload = Sequence[memoryview]
Reply = TypeVar("Reply", bound=Message)


def check_timeouts(timeout_s: float | None, ready_timeout_s: float) -> None:
    """Raises ConfigError for a timeout that would never end."""
    for key, seconds in {"timeout_s": timeout_s, "ready_timeout_s": ready_timeout_s}.items():
        if seconds is not None and not 0.0 < seconds < math.inf:
            raise ConfigError("Client", key, f"must be finite, above 0 s, got {seconds}")


def server_deadline_ms(timeout_s: float | None, attempts: int = 1) -> int | None:
    """Time for the server to answer that it cannot [ms], before the client gives up.

    None without a timeout: the client waits as long as the server gives signs of life.
    """
    if timeout_s is None:
        return None
    seconds = attempts * timeout_s
    return max(1, round(1000.0 * min(max(0.5 * seconds, seconds - _MARGIN), LONGEST_DEADLINE)))


@dataclass(eq=False)
class Call(Generic[Reply]):
    """A request that waits for its reply.

    timeout_s : until it is given up
    patience_s : given, the server is pinged meanwhile, and the request is given up after this;
        after ``timeout_s`` only where nothing was heard for so long
    attempts : times that it is sent, each with ``timeout_s``, where no answer comes or the server
        lost its renderer
    retry_busy : send it again where the server is BUSY, until ``timeout_s`` is over
    on_change : called when the call is done or to be sent again
    sent : whether it waits for a reply
    wake_at : when it is to be sent or, once it is sent, given up
    """

    request: Message
    reply_type: type[Reply]
    timeout_s: float
    attempts: int = 1
    patience_s: float | None = None
    retry_busy: bool = False
    on_change: Callable[[], object] = lambda: None
    sent: bool = False
    error: BridgeError | None = None
    reply: tuple[Reply, Payload] | None = None

    def __post_init__(self) -> None:
        self.id: int | None = getattr(self.request, "id", None)
        self.start_over(time.monotonic())

    def start_over(self, now: float) -> None:
        """Be due to be sent at a time."""
        self.sent, self.wake_at, self.heard = False, now, now
        self.deadline = now + (self.timeout_s if self.patience_s is None else self.patience_s)

    def next_wake(self, now: float) -> float:
        """When it is given up, or the server is to be pinged."""
        if self.patience_s is None:
            return self.deadline
        return min(self.deadline, now + min(_PING_INTERVAL, 0.25 * self.timeout_s))

    @property
    def done(self) -> bool:
        """Whether there is a result."""
        return self.reply is not None or self.error is not None

    def result(self) -> tuple[Reply, Payload]:
        """The reply with its payload frames; raises the error of a call that failed."""
        if self.reply is None:
            assert self.error is not None
            raise self.error
        return self.reply

    def fail(self, error: BridgeError) -> None:
        """End with an error, or send the request again where it may be."""
        now = time.monotonic()
        code = error.code if isinstance(error, RemoteError) else None
        busy = code == ErrorCode.BUSY
        if (isinstance(error, NoAnswerError) or code in _LOST) and self.attempts > 1:
            self.attempts -= 1
            self.start_over(now)
        elif busy and self.retry_busy and now + BUSY_PAUSE < self.deadline:
            self.sent, self.wake_at = False, now + BUSY_PAUSE
        else:
            self.error = error
        self.on_change()


def open_call(
    request: Message,
    reply_type: type[Reply],
    timeout_s: float | None,
    ready_timeout_s: float,
    attempts: int = 1,
    **options: Any,
) -> Call[Reply]:
    """The call of a client with its timeouts; options are those of Call."""
    patience_s = None
    if isinstance(request, Hello):
        patience_s = ready_timeout_s
    elif timeout_s is None and not isinstance(request, Next):
        patience_s = LONGEST_DEADLINE
    seconds = SILENCE if timeout_s is None else timeout_s
    return Call(request, reply_type, seconds, attempts, patience_s, **options)
