"""Errors of a client; all of them are BridgeErrors."""

from __future__ import annotations

from simgl.errors import BridgeError
from simgl_bridge.messages import Error


class RemoteError(BridgeError):
    """The server refused a request.

    address : of the server
    error : its reply, whose fields are attributes:

    code : see ``messages.ErrorCode``
    field : such as ``bodies.chaser.position_m``
    detail : one line that names field, value and what is allowed
    retryable : whether the same request may succeed later
    """

    def __init__(self, address: str, error: Error) -> None:
        self.code = error.code
        self.field = error.field
        self.detail = error.detail
        self.retryable = error.retryable
        super().__init__(f"{address}: {error.code}: {error.detail}")


class NoAnswerError(BridgeError):
    """No reply arrived: the server is not running, blocked, or slower than the deadline.

    address : of the server
    reason : such as "no answer within 10 s", "the connection broke" or "the server said goodbye"
    asked : type of the request
    age_s : time since the last message of the server; None before the first
    last_sequence : sequence of the last images received; None before the first
    """

    def __init__(
        self,
        address: str,
        reason: str,
        asked: str,
        age_s: float | None,
        last_sequence: int | None,
    ) -> None:
        self.address = address
        self.reason = reason
        self.asked = asked
        self.age_s = age_s
        self.last_sequence = last_sequence
        heard = "never heard of it" if age_s is None else f"last heard {age_s:.3g} s ago"
        seen = "no image before" if last_sequence is None else f"last image {last_sequence}"
        super().__init__(f"{address}: {reason}, waiting for {asked}; {heard}, {seen}")


class AccessError(BridgeError):
    """Client and server do not agree on keys: wrong, missing, or not on the server's list."""
