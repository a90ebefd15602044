"""Basilisk gets the picture of its own state, or an empty one, and never a reply that stops it."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from simgl_bridge.basilisk.camera_overrides import (
    CameraOverrides,
    load_camera_file,
    load_camera_files,
)
from simgl_bridge.basilisk.endpoint import BasiliskEndpoint, varint
from simgl_bridge.basilisk.planets import SPHEROIDS
from simgl_bridge.basilisk.recording_replay import replay
from simgl_bridge.basilisk.viz_messages import read_update
from simgl_bridge.basilisk.viz_scene import camera_from_body, check_base, matrix_from_mrp, scene_of
from simgl_bridge.render_session import RenderSession

from simgl import Scenario, load_scenario
from simgl.errors import AssetError, ConfigError, OutputError, SimglError
from simgl.physics.regolith import MARS, reflectance
from simgl.scenario.schema import CameraTable
from tests.bridge import basilisk_wire as wire
from tests.bridge.basilisk_wire import PLACE, SIGMA_CB, pixels, scene
from tests.bridge.harness import WatchedSimulator, basilisk_source


@dataclass
class Source:
    """A running image source and what it took."""

    front: BasiliskEndpoint
    simulator: WatchedSimulator


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("basilisk")
    (path / "base.toml").write_text(wire.SCENARIO)
    (path / "navcam.toml").write_text(wire.SHEET)
    return path


@pytest.fixture(scope="module")
def base(folder: Path) -> Scenario:
    return load_scenario(folder / "base.toml")


@pytest.fixture(scope="module")
def overrides(folder: Path) -> CameraOverrides:
    return load_camera_file(folder / "navcam.toml")


@pytest.fixture(scope="module")
def source(base: Scenario, overrides: CameraOverrides) -> Iterator[Source]:
    with basilisk_source(base, {1: overrides}) as (front, simulator):
        yield Source(front, simulator)


@pytest.fixture
def peer(source: Source) -> Iterator[wire.Peer]:
    link = wire.Peer(source.front.address)
    yield link
    link.close()


def test_modified_rodrigues_parameters_are_tan_of_a_quarter_of_the_angle() -> None:
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    # Axes b turned about z by the angle: components in b of a fixed vector turn back.
    expected = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    sigma = np.array([0.0, 0.0, np.tan(angle / 4)])
    np.testing.assert_allclose(matrix_from_mrp(sigma), expected, atol=1e-15)
    shadow = -sigma / (sigma @ sigma)
    np.testing.assert_allclose(matrix_from_mrp(shadow), expected, atol=1e-14)


def test_the_direction_of_a_camera_is_its_attitude_turned_into_the_viewer() -> None:
    for sigma in (SIGMA_CB, (0.0, 0.0, 0.0), (-0.6, 0.5, 0.4), (1.2, -0.7, 0.1)):
        direction = wire.direction_from_sigma(sigma)
        np.testing.assert_allclose(camera_from_body(direction), matrix_from_mrp(sigma), atol=1e-13)


def test_a_camera_sits_on_its_craft_and_looks_along_z(
    base: Scenario, overrides: CameraOverrides
) -> None:
    at = (0.3, -1.0, 2.0)
    state = scene_of(read_update(scene(position_B=at)), 1, base, overrides, print)
    camera = state.cameras["camera 1"]
    np.testing.assert_allclose(camera.R_camera_from_icrf[2], [-1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(camera.R_camera_from_icrf[0], [0.0, 1.0, 0.0], atol=1e-12)
    body_from_icrf = matrix_from_mrp(SIGMA_CB).T @ camera.R_camera_from_icrf
    # 1e-9 of 9000 km in float64.
    expected = np.array(PLACE) + body_from_icrf.T @ np.array(at)
    np.testing.assert_allclose(camera.position, expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.0), (0.5, 0.0), (-0.4, 0.5), (0.2, -0.6)])
@pytest.mark.parametrize("resolution", [(96, 64), (64, 96)])
def test_a_ball_is_seen_at_its_place_to_a_twentieth_of_a_pixel(
    peer: wire.Peer, dx: float, dy: float, resolution: tuple[int, int]
) -> None:
    # The field of view is edge to edge along the image's height.
    width, height = resolution
    fov = 6.0
    f = 0.5 * height / np.tan(np.radians(0.5 * fov))
    # 30 m ahead, x to the right (+y of ICRF), y down (-z of ICRF).
    ball = np.array(PLACE) + np.array([-30.0, dx, -dy])
    # The Sun from behind the camera: the ball is full, and bright alike about its centre.
    sun = wire.AU * (np.array(PLACE) - ball) / np.linalg.norm(np.array(PLACE) - ball)
    more = wire.craft("target", ball.tolist(), (0.0, 0.0, 0.0))
    # No Earth behind it.
    empty = wire.body("pebble", (0.0, 0.0, 0.0), 0.0)
    state = scene(
        fov_deg=fov, resolution=resolution, more=more, sun=tuple(sun.tolist()), central=empty
    )
    assert peer.update(state) == [b"OK"]
    picture = pixels(peer.image()).astype(np.float64)
    assert picture.shape == (height, width)
    light = np.maximum(picture - np.median(picture), 0.0)
    row, column = np.indices(light.shape)
    seen = np.array([(column * light).sum(), (row * light).sum()]) / light.sum()
    # Coordinates of OpenCV: the centre of the first pixel is (0, 0). The ball is an ellipse whose
    # centre lies 1/(1 - tan^2) farther out, 3e-4 of 20 px.
    expected = f * np.array([dx, dy]) / 30.0 + 0.5 * np.array(resolution) - 0.5
    np.testing.assert_allclose(seen, expected, atol=0.05)


def test_mars_is_oblate_though_sent_as_a_sphere(peer: wire.Peer) -> None:
    mars = wire.body("mars barycenter", (0.0, 0.0, 0.0), 3396.19)
    # A Sun of a tenth of its distance: white to the limb.
    state = scene(
        central=mars,
        place=(12e6, 0.0, 0.0),
        sun=(0.1 * wire.AU, 0.0, 0.0),
        fov_deg=36.0,
        resolution=(256, 256),
    )
    peer.update(state)
    y, x = np.nonzero(pixels(peer.image()) > 127)
    # From the plane of its equator an ellipse, whose second moments go with the axes squared. The
    # last pixel, lit in part and white all the same, adds half a pixel to both of 116: 3e-5.
    axis_ratio = y.std() / x.std()
    assert axis_ratio == pytest.approx(3376.20 / 3396.19, abs=3e-4)


# Geometric albedo in V: NASA planetary fact sheets.
@pytest.mark.parametrize(
    ("name", "measured"),
    [
        ("mars", 0.170),
        ("jupiter", 0.538),
        ("saturn", 0.499),
        ("uranus", 0.488),
        ("neptune", 0.442),
    ],
)
def test_the_full_disc_of_a_planet_is_as_bright_as_measured(name: str, measured: float) -> None:
    albedo = SPHEROIDS[name].globe.albedo
    assert albedo is not None
    # A Lambertian globe sends back 2/3 of its albedo. V is wider than the band of 500 to 600 nm,
    # which tells where methane absorbs red light: a tenth for Uranus.
    assert 2.0 / 3.0 * albedo[1] == pytest.approx(measured, rel=0.1)


@pytest.mark.parametrize("sun_au", [0.7, 1.6])
def test_a_camera_without_exposure_is_exposed_for_the_sunlit_planet(
    peer: wire.Peer, sun_au: float
) -> None:
    mars = wire.body("mars barycenter", (0.0, 0.0, 0.0), 3396.19)
    # The Sun behind the camera, whose id no file has.
    sun = (sun_au * wire.AU, 0.0, 0.0)
    state = scene(central=mars, place=(12e6, 0.0, 0.0), sun=sun, id=7, fov_deg=36.0)
    peer.update(state)
    picture = pixels(peer.image(7))
    # Half of the range at opposition; 10 deg from it the ground has this share of that.
    least = 0.5 * float(reflectance(MARS, 1.0, 0.985, 0.985) / reflectance(MARS, 1.0, 1.0, 1.0))
    # Of 256, rounded down; the pedestal has 4 of them.
    assert least < picture[20:28, 28:36].mean() / 255.0 < 0.52


def test_an_exposure_that_a_file_has_is_kept(base: Scenario, tmp_path: Path) -> None:
    said: list[str] = []
    times = []
    for line in ("", "exposure_time_s = 0.003"):
        (tmp_path / "navcam.toml").write_text(f'preset = "ideal"\n{line}\n')
        navcam = load_camera_file(tmp_path / "navcam.toml")
        state = scene_of(read_update(scene()), 1, base, navcam, said.append)
        times.append(state.cameras["camera 1"].camera.exposure_time)
    assert times[1] == 0.003
    assert times[0] != CameraTable().exposure_time_s
    assert ["exposure_time_s" in line for line in said].count(True) == 1


def test_a_state_is_drawn_once_however_often_it_is_asked_for(
    source: Source, peer: wire.Peer
) -> None:
    other = wire.Peer(source.front.address)
    before = source.simulator.captured
    peer.update(scene(seconds=11.0, frame=5))
    first = peer.image()
    assert peer.image() == first
    # The second of two vizInterfaces counts its frames by itself.
    other.update(scene(seconds=11.0, frame=6))
    assert other.image() == first
    other.close()
    assert source.simulator.captured == before + 1
    peer.update(scene(seconds=12.0))
    assert peer.image() != first
    assert source.simulator.captured == before + 2


def test_every_request_gets_the_reply_that_it_expects(peer: wire.Peer) -> None:
    assert peer.ask(b"PING") == [b"PONG"]
    assert peer.image() == b""
    assert peer.update(scene(frame=300)) == [b"OK"]
    # VizInput: field 1, the frame number.
    assert peer.ask(b"REQUEST_INPUT") == [b"VIZARD_INPUT", b"\x08\xac\x02"]
    assert peer.ask(b"REQUEST_IMAGE_x") == [bytes(4), b""]
    assert peer.ask(b"NONSENSE") == [b"OK"]
    assert peer.ask(b"SIM_UPDATE") == [b"OK"]
    assert peer.image() == b""


NAN = float("nan")
BAD = {
    "cut": lambda: scene()[:-3],
    "not protobuf": lambda: b"\xff" * 40,
    "camera of another id": lambda: scene(id=2),
    "unknown parent": lambda: scene(parent="nobody"),
    "depth": lambda: scene(render_mode=1),
    "no field of view": lambda: scene(fov_deg=0.0),
    "field of view no number": lambda: scene(fov_deg=NAN),
    "no pixels": lambda: scene(resolution=(0, 48)),
    "too many pixels": lambda: scene(resolution=(100_000, 100_000)),
    "inside the Earth": lambda: scene(place=(5e6, 0.0, 0.0)),
    "no Sun in deep space": lambda: scene(central=b"", sun=None),
    "Sun no number": lambda: scene(sun=(NAN, 0.0, 0.0)),
    "time no number": lambda: scene(seconds=NAN),
    "time before the start": lambda: scene(seconds=-1.0),
    "no such year": lambda: scene(more=wire.epoch(1600)),
    "position of two numbers": lambda: scene(position_B=(1.0, 2.0)),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_drawn_is_an_empty_image_and_the_run_goes_on(
    peer: wire.Peer, name: str
) -> None:
    assert peer.update(BAD[name]()) == [b"OK"]
    assert peer.image() == b""
    peer.update(scene())
    assert pixels(peer.image()).max() > 100


def test_a_failure_while_drawing_is_an_empty_image(source: Source, peer: wire.Peer) -> None:
    def fail() -> None:
        raise RuntimeError("on purpose")

    source.simulator.hook = fail
    peer.update(scene(seconds=21.0))
    try:
        assert peer.image() == b""
    finally:
        source.simulator.hook = None
    assert len(peer.image()) > 0


def test_the_epoch_is_utc_and_ambient_light_is_refused_aloud(
    base: Scenario, overrides: CameraOverrides
) -> None:
    said: list[str] = []
    ambient = wire.block(7, wire.double(1, 0.5))
    update = read_update(scene(more=ambient, seconds=2.0))
    state = scene_of(update, 1, base, overrides, said.append)
    # 2026-06-01T12:00:00 UTC is 1780315200 s of Unix time, 37 s before TAI.
    assert state.tai_ns == (1_780_315_200 + 37 + 2) * 10**9
    assert any("ambient = 0.5 is REFUSED" in line for line in said)


def test_the_epoch_of_the_first_message_holds(source: Source, peer: wire.Peer) -> None:
    peer.update(scene(seconds=41.0))
    first, before = peer.image(), source.simulator.captured
    peer.update(scene(seconds=41.0, at=b""))
    # The very same state, so nothing is drawn.
    assert peer.image() == first
    assert source.simulator.captured == before


def test_mutated_messages_are_read_or_refused(base: Scenario, overrides: CameraOverrides) -> None:
    rng = np.random.default_rng(5)
    good, refused = scene(), 0
    for _ in range(3000):
        data = bytearray(good)
        for place in rng.integers(0, len(data), rng.integers(1, 6)):
            data[place] = rng.integers(0, 256)
        if rng.random() < 0.3:
            del data[rng.integers(0, len(data)) :]
        try:
            scene_of(read_update(bytes(data)), 1, base, overrides, lambda _: None)
        except SimglError:
            refused += 1
    assert 1000 < refused < 3000


def test_unknown_fields_are_skipped() -> None:
    newer = wire.double(900, 1.0) + wire.number(901, 7) + wire.text(902, "new")
    newer += varint(903 << 3 | 5) + bytes(4)
    assert read_update(scene() + newer) == read_update(scene())


def test_a_recording_becomes_images(
    base: Scenario, overrides: CameraOverrides, tmp_path: Path
) -> None:
    states = [scene(seconds=1.0), scene(seconds=2.0, id=3)]
    data = b"".join(varint(len(s)) + s for s in states)
    recording = tmp_path / "run_UnityViz.bin"
    recording.write_bytes(data)
    with RenderSession(base) as render_session:
        out = tmp_path / "out"
        assert replay(recording, render_session, out, overrides={1: overrides, 3: overrides}) == 2
        names = ["camera_1_000001000000000.png", "camera_3_000002000000000.png"]
        assert sorted(p.name for p in out.iterdir()) == names
        recording.write_bytes(data[:-5])
        with pytest.raises(AssetError, match="ends 5 bytes early"):
            replay(recording, render_session, tmp_path / "cut", overrides={1: overrides})
    assert len(list((tmp_path / "cut").iterdir())) == 1


def test_a_disk_that_fills_up_ends_a_replay_in_one_line_and_leaves_whole_images(
    base: Scenario, overrides: CameraOverrides, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    states = [scene(seconds=float(second)) for second in (1, 2)]
    recording = tmp_path / "run_UnityViz.bin"
    recording.write_bytes(b"".join(varint(len(s)) + s for s in states))
    honest, written = Path.write_bytes, []

    def until_full(path: Path, data: bytes) -> int:
        written.append(path)
        if len(written) == 2:
            honest(path, data[:100])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return honest(path, data)

    out = tmp_path / "out"
    with RenderSession(base) as render_session:
        monkeypatch.setattr(Path, "write_bytes", until_full)
        with pytest.raises(OutputError, match=r"cannot be written \(No space left on device\)"):
            replay(recording, render_session, out, overrides={1: overrides})
        monkeypatch.undo()
        assert [p.name for p in out.iterdir()] == ["camera_1_000001000000000.png"]
        assert pixels((out / "camera_1_000001000000000.png").read_bytes()).shape == (48, 64)
        with pytest.raises(
            OutputError, match=r"run_UnityViz\.bin: cannot be written \(File exists"
        ):
            replay(recording, render_session, recording, overrides={1: overrides})


@pytest.mark.parametrize(
    ("entry", "problem"),
    [
        ("navcam.toml", 'must be ID=FILE such as 1=navcam.toml, got "navcam.toml"'),
        ("1=", "must be ID=FILE"),
        ("--1=navcam.toml", "must be ID=FILE"),
        ("99999999999999999999=navcam.toml", "must be ID=FILE"),
    ],
)
def test_a_camera_option_says_what_it_needs(entry: str, problem: str) -> None:
    with pytest.raises(ConfigError, match=problem):
        load_camera_files([entry])


def test_a_camera_file_does_not_say_what_basilisk_says(tmp_path: Path) -> None:
    path = tmp_path / "wide.toml"
    path.write_text("focal_length_mm = 8.0\n")
    with pytest.raises(ConfigError, match="focal_length_mm comes from Basilisk"):
        load_camera_file(path)


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        ("[sun]\ndirection_icrf = [1.0, 0.0, 0.0]\n", "fixes the Sun by hand"),
        ('[earth]\nshape = "none"\n', 'is "none", and Basilisk sends an Earth'),
    ],
)
def test_a_scenario_does_not_contradict_basilisk(tmp_path: Path, table: str, problem: str) -> None:
    path = tmp_path / "base.toml"
    path.write_text('[epoch]\nutc = "2026-06-01T12:00:00"\n' + table)
    with pytest.raises(ConfigError, match=problem):
        check_base(load_scenario(path))
