"""What Basilisk's own navigation scenarios send, to a server without any file."""

from __future__ import annotations

import io
from collections.abc import Iterator

import numpy as np
import pytest
from PIL import Image
from simgl_bridge.basilisk.viz_scene import bare_scenario

from simgl.arrays import Array
from tests.bridge import basilisk_wire as wire
from tests.bridge.harness import basilisk_source

SIZE, FOV_DEG = 256, 55.0
FOCAL = 0.5 * SIZE / np.tan(np.radians(0.5 * FOV_DEG))
MARS_KM = 3396.19
# 18,000 km from Mars; the Sun 40 deg off the line to the camera, at Mars's distance from it.
PLACE = np.array([1.8e7, 0.0, 0.0])
SUN = 1.6 * wire.AU * np.array([np.cos(0.7), np.sin(0.7), 0.0])
# houghCircles takes what is brighter for the planet.
HOUGH = 15


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with basilisk_source(bare_scenario()) as (front, _):
        yield front.address


def message(seconds: float, place: Array = PLACE, *, first: bool = False) -> bytes:
    """A state as the scenarios send it: Mars at the origin, camera 1 towards it, 3 to the side."""
    state = wire.instant(seconds, int(seconds))
    for name, position, radius in (
        ("sun", SUN, 695700.0),
        ("earth", SUN + np.array([1.4e11, 0.0, 0.0]), 6378.1366),
        ("mars barycenter", np.zeros(3), MARS_KM),
        ("jupiter", SUN - np.array([0.0, 7e11, 0.0]), 71492.0),
    ):
        state += wire.body(name, position.tolist(), radius)
    state += wire.craft(
        "bskSat", place.tolist(), wire.looking_at_earth(PLACE.tolist(), (0.0, 0.0, 0.0))
    )
    for number, sigma_CB in ((1, (0.0, 0.0, 0.0)), (3, (0.0, 0.5, 0.0))):
        state += wire.camera(
            id=number,
            parent="bskSat",
            fov_deg=FOV_DEG,
            resolution=(SIZE, SIZE),
            direction_B=wire.direction_from_sigma(sigma_CB),
            position_B=(0.0, 0.2, 2.2),
        )
    # Settings: ambient light; fields that nobody here knows.
    state += wire.block(7, wire.double(1, 0.5) + wire.text(9, "black") + wire.number(40, 1))
    return state + wire.epoch(2019) if first else state


def picture(png: bytes) -> Array:
    seen = np.asarray(Image.open(io.BytesIO(png))).astype(np.float64)
    assert seen.shape == (SIZE, SIZE)
    return seen


@pytest.fixture
def peer(address: str) -> Iterator[wire.Peer]:
    # vizInterface is registered twice: its first socket asks once, and hangs on.
    abandoned, link = wire.Peer(address), wire.Peer(address)
    abandoned.socket.send(b"PING")
    assert link.ask(b"PING") == [b"PONG"]
    assert link.update(message(0.5, first=True)) == [b"OK"]
    yield link
    link.close()
    abandoned.close()


def test_the_lit_limb_of_mars_is_where_its_place_and_shape_put_it(peer: wire.Peer) -> None:
    peer.update(message(60.0))
    png = peer.image(1)
    assert peer.image(1) == png
    light = picture(png)
    # Across the limb towards the Sun, which is to the right (+y): where half of the light before
    # it is left.
    row = light[SIZE // 2 - 3 : SIZE // 2 + 3].mean(axis=0)
    row -= row[-20:].mean()
    before = row[160:165].mean()
    assert before > 4 * HOUGH
    last = int(np.flatnonzero(row > 0.5 * before)[-1])
    part = (row[last] - 0.5 * before) / (row[last] - row[last + 1])
    # The centre of the first pixel is 0.
    limb = last + part - (0.5 * SIZE - 0.5)
    expected = FOCAL * np.tan(np.arcsin(MARS_KM / 1.8e4))
    # The ground before the limb grows darker over some 5 px by a fifth, a tenth of a pixel at
    # half; the row of 6 bends by 0.1 px.
    assert limb == pytest.approx(expected, abs=0.25)


def test_what_is_brighter_than_the_threshold_of_hough_is_the_lit_part(peer: wire.Peer) -> None:
    peer.update(message(120.0))
    y, x = np.nonzero(picture(peer.image(1)) > HOUGH)
    radius = FOCAL * np.tan(np.arcsin(MARS_KM / 1.8e4))
    # The whole height of the disc, and half a pixel of blur at either end.
    assert np.ptp(y) + 1 == pytest.approx(2.0 * radius, abs=1.5)
    # Lit are (1 + cos phase) / 2 of the disc or, so near, less, and a rim of half a pixel.
    lit = 0.5 * (1.0 + np.cos(0.7)) * np.pi * radius**2
    assert 0.9 * lit < x.size < lit + 2.0 * np.pi * radius
    assert y.mean() == pytest.approx(0.5 * SIZE - 0.5, abs=0.5)


def test_the_camera_to_the_side_has_a_picture_without_a_planet(peer: wire.Peer) -> None:
    peer.update(message(180.0))
    assert picture(peer.image(3)).max() < HOUGH


def test_a_course_through_mars_is_empty_there_and_goes_on(peer: wire.Peer) -> None:
    # The orbit of scenario_OpNavOD comes to 3000 km of its centre.
    peer.update(message(240.0, np.array([3.0e6, 0.0, 0.0])))
    assert peer.image(1) == b""
    peer.update(message(300.0))
    assert peer.image(1)


def test_an_end_without_waiting_for_the_answer_leaves_the_others(
    address: str, peer: wire.Peer
) -> None:
    leaving = wire.Peer(address)
    last = message(360.0) + wire.block(10, wire.number(3, 1))
    leaving.socket.send_multipart([b"SIM_UPDATE", b"", b"", last])
    leaving.close()
    peer.update(message(420.0))
    assert peer.image(1)
