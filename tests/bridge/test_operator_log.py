"""What a server prints is bounded, whatever its clients send."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from simgl_bridge.operator_log import LINES_PER_KIND, LONGEST_LINE, OperatorLog

from simgl import load_scenario
from tests.bridge import basilisk_wire as wire
from tests.bridge.basilisk_wire import PLACE, scene
from tests.bridge.harness import RawLink, Running, basilisk_source
from tests.bridge.test_bad_messages import RENDER


def test_a_line_is_printed_once_and_its_kind_is_counted(capsys: pytest.CaptureFixture[str]) -> None:
    log = OperatorLog("simgl: test")
    for number in range(100_000):
        log(f"garbage {number}", "bad frames")
        log("always the same")
    log.close()
    log.close()
    lines = capsys.readouterr().err.splitlines()
    garbage = [f"simgl: test: garbage {n}" for n in range(LINES_PER_KIND)]
    same = ["simgl: test: always the same"]
    # At 1000, 10,000, ... lines, and the rest at the end.
    counts = [
        f"simgl: test: bad frames: {n} more, like those above" for n in (1000, 10_000, 99_990)
    ]
    counts += [f"simgl: test: warnings: {n} more, like those above" for n in (1000, 10_000, 99_999)]
    assert sorted(lines) == sorted(garbage + same + counts)


def test_a_line_is_short_and_holds_no_control_characters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    OperatorLog()("a\nb\x1b[31m" + "x" * 1_000_000)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("simgl: a\\nb\\x1b[31mx")
    # Of the characters kept, three were escaped to two, four and four.
    assert len(line) <= len("simgl: ") + LONGEST_LINE + 3 * 4


def test_warnings_of_the_library_are_lines_like_others(capsys: pytest.CaptureFixture[str]) -> None:
    log = OperatorLog("simgl: test")
    with log.library_warnings():
        for _ in range(5):
            logging.getLogger("simgl.disk_cache").warning("%s: no space", "/cache")
    log.close()
    printed = capsys.readouterr().err.splitlines()
    # Other servers of this process print it too.
    assert [line for line in printed if line.startswith("simgl: test: ")] == [
        "simgl: test: /cache: no space",
        "simgl: test: simgl.disk_cache: 4 more, like those above",
    ]


def test_garbage_for_basilisk_leaves_few_lines(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "base.toml"
    path.write_text(wire.SCENARIO)
    count = 200
    with basilisk_source(load_scenario(path)) as (endpoint, _):
        peer = wire.Peer(endpoint.address)
        for number in range(count):
            name = f"{number}\n\x1b[2J{'long' * 5000}"
            peer.ask(f"NONSENSE_{number}".encode())
            peer.ask(f"REQUEST_IMAGE_{number}x".encode())
            peer.ask(b"SIM_UPDATE", *[b""] * (number % 2))
            peer.image(number)
            peer.update(b"\xff" + bytes([number]))
            # A camera on a spacecraft that is not there.
            peer.update(scene(parent=name))
            assert peer.image() == b""
            if number < 2 * LINES_PER_KIND:
                peer.update(scene(more=wire.craft(name, PLACE, [0.0, 0.0, 0.0])))
                assert peer.image() != b""
        peer.close()
    printed = capfd.readouterr().err
    # Six kinds of lines, each with its count at the end.
    assert len(printed) < 6 * (LINES_PER_KIND * (LONGEST_LINE + 40) + 100)
    assert "\x1b" not in printed
    assert f"unknown requests: {2 * count - LINES_PER_KIND} more" in printed
    assert f"states without an image: {count - LINES_PER_KIND} more" in printed


def test_a_failure_is_printed_once_however_often_it_happens(
    raw: RawLink, running: Running, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise RuntimeError("so it goes\n" + "x" * 10_000)

    running.simulator.hook = fail
    try:
        for id in range(50):
            assert raw.ask_map({**RENDER, "id": 10_000 + id})["code"] == "INTERNAL"
    finally:
        running.simulator.hook = None
    printed = capfd.readouterr().err
    assert printed.count("a request failed") == 1
    assert len(printed) < 5000
