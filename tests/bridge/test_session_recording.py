"""A recorded session holds all that was answered, and renders to the same bytes again."""

from __future__ import annotations

import os
import re
import resource
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest
import typer
from simgl_bridge import Client, Shot
from simgl_bridge.commands import replay_recording, serve
from simgl_bridge.messages import Render
from simgl_bridge.renderer_messages import ServedScene
from simgl_bridge.session_recording import (
    MAGIC,
    Answered,
    Configured,
    Opened,
    SessionFile,
    SessionRecorder,
)
from simgl_bridge.session_replay import replay_session, session_files

from benchmarks.bridge.scene import server_process
from simgl import Scenario
from simgl.errors import AssetError, BridgeError, ConfigError
from tests.bridge.harness import TURNING, RawLink, Running, free_address
from tests.bridge.test_bad_messages import RENDER
from tests.patience import limit

Starter = Callable[..., Running]
NOW = 1_774_008_037_000_000_000
ALL = ("dn", "radiance", "electrons", "depth", "part_id")


@pytest.fixture
def recorded(start_server: Starter, scenario: Scenario, tmp_path: Path) -> Any:
    """Starts servers that record into a folder."""

    def begin(*, with_images: bool = False, **options: Any) -> tuple[Running, SessionRecorder]:
        recorder = SessionRecorder(tmp_path / "records", with_images=with_images)
        return start_server(scenario, recorder=recorder, **options), recorder

    return begin


def answered(path: Path) -> list[Answered]:
    return [record for record, _ in SessionFile(path).records() if isinstance(record, Answered)]


def three_frames(running: Running, now: int) -> list[str]:
    """State hashes of three replies of different kinds."""
    with Client(running.address, timeout_s=limit(20.0)) as client:
        first = client.render(now, "nav", {"chaser": TURNING}, products=ALL)
        shots = [Shot(camera="side"), Shot(camera="nav", exposure_time_s=0.001, gain_dn_per_e=0.5)]
        second = client.render_all(now + 1000, shots)
        client.configure(seed=99)
        third = client.render(now + 2000, "nav", {"chaser": TURNING}, moving=True)
    return [first.state_hash, second.state_hash, third.state_hash]


@pytest.mark.parametrize("with_images", [False, True])
def test_a_session_renders_to_the_same_bytes(
    recorded: Any, scenario: Scenario, *, with_images: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    running, recorder = recorded(with_images=with_images)
    hashes = three_frames(running, scenario.epoch_tai_ns)
    session = SessionFile(recorder.path)
    assert session.opened.with_images == with_images
    assert session.opened.scenario_file == str(scenario.source)
    kinds = [type(record) for record, _ in session.records()]
    assert kinds == [Opened, Answered, Answered, Configured, Answered]
    replies = answered(recorder.path)
    assert [reply.state_hash for reply in replies] == hashes
    assert [len(reply.plane_hashes) for reply in replies] == [5, 2, 1]
    sizes = [len(planes) for record, planes in session.records() if isinstance(record, Answered)]
    # Bytes per pixel of all products: 2 + 16 + 4 + 4 + 4.
    nav, side = 64 * 48, 48 * 40
    assert sizes == ([30 * nav, 2 * side + 2 * nav, 2 * nav] if with_images else [0, 0, 0])
    replay_recording(recorder.path.parent, out=recorder.path.parent)
    assert capsys.readouterr().out == "3 frames replayed, 0 differ\n"


def test_free_run_is_recorded_as_it_was_shown(recorded: Any, scenario: Scenario) -> None:
    running, recorder = recorded()
    with Client(running.address, timeout_s=limit(20.0)) as client:
        client.send_state(scenario.epoch_tai_ns, [Shot(camera="nav")], {"chaser": TURNING})
        shown = client.next_images()
    (reply,) = answered(recorder.path)
    assert reply.state_hash == shown.state_hash
    assert replay_session(recorder.path).different == 0


def test_a_chosen_scenario_is_replayed(
    recorded: Any, scenario: Scenario, scenario_path: Path, tmp_path: Path
) -> None:
    root = tmp_path / "root"
    root.mkdir()
    text = scenario_path.read_text()
    (root / "wide.toml").write_text(text.replace("width_px = 64", "width_px = 80"))
    running, recorder = recorded(root=root)
    with Client(running.address, timeout_s=limit(20.0)) as client:
        client.configure("wide", seed=3)
        client.configure(seed=4)
        assert client.render(scenario.epoch_tai_ns, "nav").dn.shape == (48, 80)
    assert replay_session(recorder.path).different == 0
    (root / "wide.toml").write_text(text.replace("width_px = 64", "width_px = 96"))
    with pytest.raises(ConfigError, match="wide: has changed since: its content had the hash"):
        replay_session(recorder.path)
    moved = root.rename(tmp_path / "moved")
    (moved / "wide.toml").write_text(text.replace("width_px = 64", "width_px = 80"))
    assert replay_session(recorder.path, root=moved).frames == 1


def test_another_content_is_refused_or_its_differences_told(
    recorded: Any, scenario: Scenario, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    running, recorder = recorded(with_images=True)
    hashes = three_frames(running, scenario.epoch_tai_ns)
    other = tmp_path / "other.toml"
    assert scenario.source is not None
    text = scenario.source.read_text()
    other.write_text(text.replace("reflectance = 0.5", "reflectance = 0.4"))
    with pytest.raises(ConfigError, match=r"other\.toml: has changed since.*--changed replays"):
        replay_recording(recorder.path, other)
    with pytest.raises(typer.Exit) as ended:
        replay_recording(recorder.path, other, changed=True)
    assert ended.value.exit_code == 1
    *lines, last = capsys.readouterr().out.splitlines()
    assert last == "3 frames replayed, 3 differ"
    pattern = r'frame (\d), state (\w{32}): camera "\w+" dn has the hash \w{32}, recorded \w{32} '
    pattern += r"\(\d+ of \d+ values, by up to \d+\)"
    found = [match for line in lines if (match := re.fullmatch(pattern, line))]
    assert {(int(match[1]), match[2]) for match in found} == set(enumerate(hashes, 1))
    # The same content in another folder is no other content.
    (tmp_path / "elsewhere").mkdir()
    same = tmp_path / "elsewhere" / scenario.source.name
    same.write_text(text)
    assert replay_session(recorder.path, scenario=same).different == 0
    assert replay_session(recorder.path, scenario=same, every=2).frames == 2


def small_session(folder: Path, count: int) -> tuple[Path, list[int]]:
    """A session of replies without images; also the size of the file after each record."""
    recorder = SessionRecorder(folder, with_images=True)
    scene = ServedScene(
        renderer="r",
        name="s",
        scene_hash="h",
        epoch_tai_ns=NOW,
        seed=1,
        cameras={},
        models={},
        lamps=(),
    )
    recorder.opened(scene, scenario_file=None, root=None)
    sizes = [recorder.path.stat().st_size]
    for id in range(count):
        record(recorder, id)
        sizes.append(recorder.path.stat().st_size)
    recorder.close()
    return recorder.path, sizes


def record(recorder: SessionRecorder, id: int, plane: bytes = b"plane") -> None:
    request = msgspec.convert({**RENDER, "id": id}, Render)
    recorder.answered(request, "hash", {}, (), [memoryview(plane)])


def test_a_record_that_is_cut_off_is_ignored_and_counted(tmp_path: Path) -> None:
    path, sizes = small_session(tmp_path, 3)
    content = path.read_bytes()
    assert sizes[-1] == len(content)
    for cut in (*range(sizes[-2], sizes[-1], 7), sizes[-1] - 1):
        path.write_bytes(content[:cut])
        assert len(answered(path)) == 2
        session = SessionFile(path)
        list(session.records())
        assert session.ignored == cut - sizes[-2]
    # As long as it should be, but never written: the checksum tells.
    path.write_bytes(content[: sizes[-2]] + bytes(sizes[-1] - sizes[-2]))
    assert len(answered(path)) == 2


def test_a_record_that_is_damaged_is_named(tmp_path: Path) -> None:
    path, sizes = small_session(tmp_path, 3)
    content = path.read_bytes()
    for at in range(sizes[1] + 16, sizes[2], 7):
        path.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        with pytest.raises(AssetError, match=f"the record at byte {sizes[1]} is damaged"):
            list(SessionFile(path).records())
    # No byte of the file changes what is read without a word.
    for at in range(0, len(content), 3):
        path.write_bytes(content[:at] + bytes([content[at] ^ 0x80]) + content[at + 1 :])
        try:
            session = SessionFile(path)
            complete = len(list(session.records())) == 4
        except AssetError:
            continue
        assert session.ignored
        assert not complete


def test_what_is_no_session_is_said(tmp_path: Path) -> None:
    path = tmp_path / "x.simgl-session"
    for content, problem in (
        (b"", "is not a recorded session"),
        (b"nonsense" * 9, "is not a recorded session"),
        (b"simgl session 2\n", "has another version, or is damaged"),
        (MAGIC, "does not say what was served; nothing was recorded"),
    ):
        path.write_bytes(content)
        with pytest.raises(AssetError, match=problem):
            SessionFile(path)
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(AssetError, match="holds no recorded session"):
        session_files(empty)
    with pytest.raises(AssetError, match="there is no such file"):
        replay_recording(tmp_path / "gone")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(AssetError, match="there is no such file"):
        replay_recording(tmp_path / "pipe")


@contextmanager
def full_disk(size: int) -> Iterator[None]:
    """No file of this process grows beyond ``size`` bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_on_a_full_disk_the_client_is_told_and_gets_no_image(
    recorded: Any,
    connect: Callable[[Running], RawLink],
    capfd: pytest.CaptureFixture[str],
) -> None:
    running, recorder = recorded(with_images=True)
    link = connect(running)
    assert link.ask_map({**RENDER, "id": 1})["type"] == "images"
    size = recorder.path.stat().st_size
    # Within the head, the header and the planes of the next record.
    for id, room in enumerate((0, 10, 300, 2000, 5000), 2):
        with full_disk(size + room):
            reply = link.ask_map({**RENDER, "id": id})
        assert (reply["type"], reply["code"], reply["id"]) == ("error", "NOT_RECORDED", id)
        assert reply["retryable"] is True
        assert reply["detail"] == (
            f"the images are not recorded: {recorder.path.name}: cannot be written (File too large)"
        )
        assert recorder.path.stat().st_size == size
    with full_disk(size):
        # A choice is recorded with the next reply.
        assert link.ask_map({"type": "configure", "id": 50, "seed": 5})["type"] == "welcome"
        assert link.ask_map({**RENDER, "id": 51})["code"] == "NOT_RECORDED"
    # Once there is room again, the same request is answered.
    assert link.ask_map({**RENDER, "id": 51})["type"] == "images"
    assert [reply.request.id for reply in answered(recorder.path)] == [1, 51]
    assert replay_session(recorder.path).different == 0
    assert capfd.readouterr().err.count("cannot be written (File too large)") == 1


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path, scenario_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(BridgeError, match=r"taken: cannot be written \(File exists\)$"):
        serve(scenario_path, record=tmp_path / "taken")
    with pytest.raises(ConfigError, match="--record-images requires --record"):
        serve(scenario_path, record_images=True)
    with pytest.raises(ConfigError, match="--record requires --address"):
        serve(None, basilisk="tcp://127.0.0.1:*", record=tmp_path)


def test_what_a_killed_server_answered_is_on_record(
    scenario_path: Path, scenario: Scenario, tmp_path: Path
) -> None:
    records = tmp_path / "records"
    address = free_address()
    command = ("simgl_bridge.commands", str(scenario_path), "--record", str(records))
    with (
        server_process(*command, address=address) as pid,
        Client(address, timeout_s=limit(20.0)) as client,
    ):
        now = scenario.epoch_tai_ns
        sent = [client.render(now + k, "nav").state_hash for k in range(20)]
        os.kill(pid, signal.SIGKILL)
    (path,) = session_files(records)
    assert [reply.state_hash for reply in answered(path)] == sent
    assert replay_session(path, every=5).different == 0
