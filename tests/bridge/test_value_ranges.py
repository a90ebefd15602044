"""What the page says of a value is what the server takes and refuses."""

from __future__ import annotations

import math
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import msgspec
import pytest
from simgl_bridge.framing import BadMessageError, unpack_reply
from simgl_bridge.message_parts import SentPose, SentSun, Shot
from simgl_bridge.messages import (
    Configure,
    Message,
    Next,
    Ping,
    Render,
    State,
    Stats,
)
from simgl_bridge.validate_request import check_ranges
from simgl_bridge.value_ranges import Components, Positive, Range, UnitQuaternion

from tests.bridge.harness import RawLink
from tests.bridge.test_bad_messages import RENDER

ROOT = Path(__file__).parents[2]
NOW = 1_774_008_037_000_000_000
POSE = SentPose(
    position_m=(0.0, 0.0, 60.0),
    velocity_m_s=(0.0, 0.0, 0.0),
    q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
)
_SHOT = Shot(camera="nav", exposure_time_s=0.001, gain_dn_per_e=0.5)
_STATE: dict[str, Any] = {
    "id": 1,
    "tai_ns": NOW,
    "cameras": (_SHOT,),
    "bodies": {"chaser": POSE},
    "sun": SentSun(position_m=(1.5e11, 0.0, 0.0)),
    "lamps": {"flood": 0.5},
}
# Every optional value is there.
WHOLE: tuple[Message, ...] = (
    Render(deadline_ms=1000, **_STATE),
    State(**_STATE),
    Next(id=3, after=299, deadline_ms=500),
    Configure(id=4, scenario="approach", seed=8),
    Ping(id=5),
    Stats(id=6),
)


def limits_of(kind: Any) -> Any:
    """The limits in an annotation, also below an optional, a map or a list; None without any."""
    if typing.get_origin(kind) is Annotated:
        return typing.get_args(kind)[1]
    return next((x for a in typing.get_args(kind) if (x := limits_of(a)) is not None), None)


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Path and limits of every limited value in a message."""
    if isinstance(value, msgspec.Struct):
        for field in msgspec.structs.fields(type(value)):
            inner = getattr(value, field.name)
            here = (*path, field.name)
            if (limits := limits_of(field.type)) is None:
                yield from places(inner, here)
            else:
                yield ((*here, "flood") if isinstance(inner, dict) else here), limits
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from places(inner, (*path, key))
    elif isinstance(value, tuple):
        for index, inner in enumerate(value):
            yield from places(inner, (*path, index))


def replaced(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    """A message with one value replaced."""
    if not path:
        return new
    step, *rest = path
    if isinstance(value, msgspec.Struct):
        inner = replaced(getattr(value, step), tuple(rest), new)
        return msgspec.structs.replace(value, **{step: inner})
    if isinstance(value, dict):
        return {**value, step: replaced(value[step], tuple(rest), new)}
    return (*value[:step], replaced(value[step], tuple(rest), new), *value[step + 1 :])


def shown(path: tuple[Any, ...]) -> str:
    text = "".join(f"[{s}]" if isinstance(s, int) else f".{s}" for s in path)
    return text.removeprefix(".")


def extremes(limits: Any) -> tuple[list[Any], list[Any]]:
    """Values just within limits, and just beyond."""
    within: list[Any]
    beyond: list[Any]
    if isinstance(limits, Range) and isinstance(limits.high, int) and limits.high > 1:
        return [limits.low, limits.high], [limits.low - 1, limits.high + 1]
    if isinstance(limits, Range):
        beyond = [math.nextafter(limits.low, -1), math.nextafter(limits.high, 2), math.nan]
        return [float(limits.low), float(limits.high)], [*beyond, math.inf]
    if isinstance(limits, Positive):
        beyond = [0.0, -1.0, math.nextafter(limits.high, math.inf), math.nan, math.inf]
        return [5e-324, limits.high], beyond
    if isinstance(limits, Components):
        high, near = limits.high, limits.nearest
        within = [(high, -high, high), (0.0, near, 0.0)]
        beyond = [(0.0, 0.0, math.nextafter(s * high, s * math.inf)) for s in (1, -1)]
        beyond += [(0.0, bad, high) for bad in (math.nan, math.inf, -math.inf)]
        return within, beyond + ([(0.0, 0.99 * near, 0.0)] if near else [])
    assert isinstance(limits, UnitQuaternion)
    within = [(0.0, 0.0, 0.0, 1.00009), (0.5, -0.5, 0.5, -0.5)]
    return within, [(0.0, 0.0, 0.0, 1.00011), (0.0,) * 4, (math.nan, 0.0, 0.0, 1.0)]


def test_every_limited_value_of_a_request_is_checked_at_its_very_bounds() -> None:
    count = 0
    for message in WHOLE:
        check_ranges(message)
        for path, limits in places(message):
            within, beyond = extremes(limits)
            for value in within:
                check_ranges(replaced(message, path, value))
            for value in beyond:
                with pytest.raises(BadMessageError) as caught:
                    check_ranges(replaced(message, path, value))
                assert (caught.value.code, caught.value.field) == ("BAD_VALUE", shown(path)), value
                assert caught.value.id == (None if path == ("id",) else message.id)  # type: ignore[attr-defined]
                count += 1
    # Render and State have at least nine limited values each, with two bounds or more.
    assert count >= 2 * 2 * 9


def test_every_number_of_a_request_has_limits() -> None:
    unlimited = set()
    for message in WHOLE:
        limited = {path for path, _ in places(message)}

        def walk(value: Any, path: tuple[Any, ...], limited: set[tuple[Any, ...]]) -> None:
            if path in limited or isinstance(value, bool):
                return
            if isinstance(value, (int, float)):
                unlimited.add(path)
            elif isinstance(value, msgspec.Struct):
                for field in msgspec.structs.fields(type(value)):
                    walk(getattr(value, field.name), (*path, field.name), limited)
            elif isinstance(value, dict):
                for key, inner in value.items():
                    walk(inner, (*path, key), limited)
            elif isinstance(value, tuple):
                for index, inner in enumerate(value):
                    walk(inner, (*path, index), limited)

        walk(message, (), limited)
    # Joints have the limits of their model.
    assert not unlimited


def test_the_page_states_each_range() -> None:
    page = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in page.splitlines() if line.startswith("| `")]
    for message in WHOLE:
        for path, limits in places(message):
            name = next(
                step for step in reversed(path) if isinstance(step, str) and step != "flood"
            )
            assert any(r[0] == f"| `{name}`" and str(limits) in r[1] for r in rows), (name, limits)
    for fact in ("1972 to 2099", "up to 3600 s", "at most 1e+12 m", "uint 64", "1.0 is refused"):
        assert fact in page


def test_a_name_in_a_field_stays_one_short_line(raw: RawLink) -> None:
    bad = {"position_m": [1e300, 0, 0], "velocity_m_s": [0, 0, 0]}
    body = {**bad, "q_icrf_from_body_xyzw": [0, 0, 0, 1]}
    reply = raw.ask_map({**RENDER, "bodies": {"a\nb" + "x" * 30_000: body}})
    assert reply["code"] == "BAD_VALUE"
    assert reply["field"].startswith("bodies.a\\nbxxx")
    assert len(reply["field"]) < 130
    assert len(reply["detail"]) < 300


def test_numbers_are_sent_as_the_page_says(raw: RawLink) -> None:
    """A float as float 64, an int as an integer, in every reply."""
    replies = [raw.ask_map({"type": "hello", "client": "raw", "versions": ["simgl/1"]})]
    whole = {
        "position_m": [0, 0, 60],
        "velocity_m_s": [0, 0, 0],
        "q_icrf_from_body_xyzw": [0, 0, 0, 1],
    }
    products = ["dn", "radiance", "electrons", "depth", "part_id"]
    shot = {"camera": "nav", "exposure_time_s": 1, "gain_dn_per_e": 1, "products": products}
    sun = {"position_m": [150_000_000_000, 0, 0]}
    request = {**RENDER, "id": 4711, "bodies": {"chaser": whole}, "cameras": [shot], "sun": sun}
    replies.append(raw.ask_map(request))
    replies.append(raw.ask_map({"type": "stats", "id": 1}))
    for reply in replies:
        assert reply["type"] in ("welcome", "images", "statistics"), reply
        built = unpack_reply([b"simgl/1", msgspec.msgpack.encode(reply)])
        assert not list(wrong_numbers(reply, built))


def wrong_numbers(sent: Any, built: Any, path: str = "") -> Iterator[str]:
    """Where a number was sent as another type than its field has."""
    if isinstance(built, msgspec.Struct):
        for field in msgspec.structs.fields(type(built)):
            inner = getattr(built, field.name)
            if field.name in sent:
                yield from wrong_numbers(sent[field.name], inner, f"{path}.{field.name}")
    elif isinstance(built, dict):
        for key, inner in built.items():
            yield from wrong_numbers(sent[key], inner, f"{path}.{key}")
    elif isinstance(built, tuple):
        for index, inner in enumerate(built):
            yield from wrong_numbers(sent[index], inner, f"{path}[{index}]")
    elif type(sent) is not type(built):
        yield f"{path} is sent as {type(sent).__name__}"
