"""Messages to and from the frames of a multipart message: ``simgl/1``, header, raw planes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import reduce
from operator import or_
from typing import Any

import msgspec

from simgl.errors import BridgeError, did_you_mean
from simgl_bridge.message_parts import SentPose
from simgl_bridge.messages import (
    REPLIES,
    REQUESTS,
    Error,
    ErrorCode,
    Message,
)
from simgl_bridge.public_text import public_text

VERSION = "simgl/1"
# A request with 100 spacecraft takes 15 kB.
LARGEST_HEADER = 64 * 1024

_PATH = re.compile(r"^(.*?)(?: - at `(key` in `)?\$(.*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")
_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "array": "a list",
    "object": "a map",
    "null": "nil",
    "bool": "true or false",
}
_ENCODER = msgspec.msgpack.Encoder()
# Straight from bytes to a message, for well-formed ones.
_REQUEST: msgspec.msgpack.Decoder[Message] = msgspec.msgpack.Decoder(reduce(or_, REQUESTS))
_REPLY: msgspec.msgpack.Decoder[Message] = msgspec.msgpack.Decoder(reduce(or_, REPLIES))


class BadMessageError(BridgeError):
    """A message that cannot be accepted; attributes are the fields of an Error reply."""

    def __init__(
        self,
        code: ErrorCode,
        field: str,
        problem: str,
        id: int | None = None,
        retryable: bool = False,
    ) -> None:
        self.code = code
        self.field = field
        self.problem = problem
        self.id = id
        self.retryable = retryable
        super().__init__(f"{field} {problem}" if field else problem)


def error_of(error: BadMessageError) -> Error:
    """The reply that says why a message was not accepted; it has no path of the server's disk."""
    return Error(
        id=error.id,
        code=error.code,
        field=public_text(error.field),
        detail=public_text(str(error)),
        retryable=error.retryable,
    )


def pack(message: Message) -> list[bytes]:
    """The first two frames of a message; the planes follow as raw frames."""
    return [VERSION.encode(), _ENCODER.encode(message)]


def unpack_request(frames: Sequence[bytes]) -> Message:
    """The request in a multipart message; raises BadMessageError."""
    if len(frames) != 2:
        problem = f"must be 2 frames, version and header, got {len(frames)}"
        raise BadMessageError(ErrorCode.BAD_FRAMING, "message", problem)
    _check_version(frames[0])
    if len(frames[1]) > LARGEST_HEADER:
        problem = f"must be at most {LARGEST_HEADER} bytes, got {len(frames[1])}"
        raise BadMessageError(ErrorCode.TOO_LARGE, "header", problem)
    try:
        return _REQUEST.decode(frames[1])
    except (ValueError, RecursionError):
        return _explained_request(frames[1])


def _explained_request(header: bytes) -> Message:
    """A request decoded step by step, to raise an error that names the field."""
    data, kind = _decoded(header, REQUESTS)
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        field, problem = _explain(str(error), data)
        id = _readable_id(data)
        raise BadMessageError(ErrorCode.BAD_VALUE, field, problem, id) from None


def unpack_reply(frames: Sequence[bytes | memoryview]) -> Message:
    """The reply at the head of a multipart message; raises BadMessageError."""
    if len(frames) < 2:
        problem = f"must be 2 frames or more, got {len(frames)}"
        raise BadMessageError(ErrorCode.BAD_FRAMING, "reply", problem)
    _check_version(bytes(frames[0][:16]))
    try:
        return _REPLY.decode(frames[1])
    except (ValueError, RecursionError):
        return _explained_reply(frames[1])


def _explained_reply(header: bytes | memoryview) -> Message:
    data, kind = _decoded(header, REPLIES)
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        problem = f"is malformed ({error})"
        raise BadMessageError(ErrorCode.BAD_VALUE, "reply", problem) from None


def _check_version(frame: bytes) -> None:
    if frame != VERSION.encode():
        problem = f'must be "{VERSION}", got {quoted(frame[:16].decode("latin-1"))}'
        raise BadMessageError(ErrorCode.VERSION, "version", problem)


def _decoded(
    header: bytes | memoryview, kinds: tuple[type[Message], ...]
) -> tuple[dict[Any, Any], type[Message]]:
    """The content of a header and its message type."""
    try:
        data = msgspec.msgpack.decode(header)
    # Broken UTF-8 is a ValueError like DecodeError; nesting without end is a RecursionError.
    except (ValueError, RecursionError) as error:
        problem = f"is not MessagePack ({error})"
        raise BadMessageError(ErrorCode.BAD_HEADER, "header", problem) from None
    if not isinstance(data, dict) or not isinstance(data.get("type"), str):
        problem = f'must be a map with a text "type", got {quoted(data)}'
        raise BadMessageError(ErrorCode.BAD_HEADER, "header", problem)
    kind = next((k for k in kinds if k.__struct_config__.tag == data["type"]), None)
    if kind is None:
        names = [str(k.__struct_config__.tag) for k in kinds]
        hint = did_you_mean(data["type"][:60], names)
        problem = f"{quoted(data['type'])} is not known here; {hint}"
        raise BadMessageError(ErrorCode.UNKNOWN_TYPE, "type", problem, _readable_id(data))
    return data, kind


def _readable_id(data: dict[Any, Any]) -> int | None:
    """The id of a message whose other fields may be invalid."""
    id = data.get("id")
    return id if type(id) is int and 0 <= id < 2**63 else None


def _explain(error: str, data: dict[Any, Any]) -> tuple[str, str]:
    """Field and problem of a message that msgspec rejects."""
    match = _PATH.match(error)
    assert match is not None
    message, in_key, path = match[1], match[2], match[3] or ""
    if in_key:
        return path.lstrip(".") or "header", "must have texts as names"
    value: Any = data
    field = ""
    for key, index in _STEP.findall(path):
        # msgspec does not name the invalid entry of a map; maps hold poses, joints or lamps.
        kind = float if field.endswith(".joints") or field == "lamps" else SentPose
        step = key or (_invalid_entry(value, kind) if index == "..." else int(index))
        value = value[step]
        label = one_line(str(step))
        field += f"[{label}]" if isinstance(step, int) else f".{label}" if field else label
    if missing := re.fullmatch(r"Object missing required field `(.*)`", message):
        return f"{field}.{missing[1]}" if field else missing[1], "is missing"
    expected = re.sub(r"^Expected ", "", message)
    expected = re.sub(r", got (`[^`]*`|\d+)$", "", expected)
    expected = re.sub(r"`([\w |]+)`", lambda m: _alternatives(m[1]), expected)
    return field, f"must be {expected}, got {quoted(value)}"


def _invalid_entry(entries: dict[str, Any], kind: type) -> str:
    for name, entry in entries.items():
        try:
            msgspec.convert(entry, kind)
        except msgspec.ValidationError:
            return name
    raise AssertionError("msgspec rejected a map of valid entries")


def _alternatives(types: str) -> str:
    return " or ".join(_WORDS.get(t, t) for t in types.split(" | "))


def one_line(text: str, longest: int = 60) -> str:
    """A string cut to ``longest`` characters, on one line of printable ones."""
    cut = text if len(text) <= longest else f"{text[: longest - 3]}..."
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in cut)


def quoted(value: Any) -> str:
    """A value for an error message, cut to 60 characters; strings in double quotes."""
    if isinstance(value, str):
        return f'"{one_line(value)}"'
    return one_line(repr(value) if value is not None else "nil")
