"""A window that follows a server: its newest preview, at twice the usual content scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import zmq
from simgl_bridge.framing import pack
from simgl_bridge.messages import Preview
from simgl_bridge.preview import PreviewClient, PreviewImage

from simgl.arrays import Image8
from simgl.viewer.overlay_boxes import BoxStyle, text_box
from tests.patience import wait_until
from tests.viewer.opened_window import opened_window

TAI_NS = 1_774_008_037_000_000_000


def image(level: int) -> Image8:
    """A vertical ramp whose top left pixel is red."""
    pixels = np.full((30, 40, 3), level, np.uint8)
    pixels[0, 0] = (255, 0, 0)
    return pixels


def send(socket: zmq.Socket[bytes], number: int, level: int) -> None:
    """What a server's monitor sends."""
    pixels = image(level)
    header = Preview(
        number=number, skipped=0, sequence=100 + number, boot="b" * 16, camera="nav",
        tai_ns=TAI_NS, shape=pixels.shape,
    )  # fmt: skip
    socket.send_multipart([*pack(header), pixels.tobytes()])


def test_the_newest_preview_replaces_those_that_nobody_took() -> None:
    with zmq.Context() as context, context.socket(zmq.PUB) as server:
        server.setsockopt(zmq.LINGER, 0)
        port = server.bind_to_random_port("tcp://127.0.0.1")
        with PreviewClient(f"tcp://127.0.0.1:{port}") as client:
            assert client.newest() is None
            first: list[PreviewImage] = []

            def arrived() -> bool:
                # A subscription takes a moment to arrive.
                send(server, 1, 10)
                newest = client.newest()
                first.extend([newest] if newest else [])
                return bool(first)

            wait_until(arrived, "the first preview")
            # What was sent while the subscription was under way.
            wait_until(lambda: client.newest() is None, "an empty queue")
            send(server, 2, 20)
            send(server, 3, 30)
            taken: list[PreviewImage] = []

            def both_arrived() -> bool:
                newest = client.newest()
                taken.extend([newest] if newest else [])
                return bool(taken) and taken[-1].sequence == 103

            wait_until(both_arrived, "two more")
            # Whether both came at once or one by one, none is missed without being counted.
            assert sum(one.missed + 1 for one in taken) == 2
            assert taken[-1].pixels[5, 5].tolist() == [30, 30, 30]


def test_text_is_legible_over_white_and_over_black() -> None:
    box = text_box(["epoch"], BoxStyle()).astype(float)
    for behind in (0.0, 255.0):
        seen = (box[..., :3] * box[..., 3:] + behind * (255.0 - box[..., 3:])) / 255.0
        light = np.where(
            seen <= 10.0, seen / 255.0 / 12.92, ((seen / 255.0 + 0.055) / 1.055) ** 2.4
        )
        luminance = light @ [0.2126, 0.7152, 0.0722]
        # Contrast of WCAG 2.2, which asks for 4.5 for text.
        assert (luminance.max() + 0.05) / (np.median(luminance) + 0.05) > 4.5


@pytest.mark.display
def test_the_window_shows_what_a_server_publishes(display: str, tmp_path: Path) -> None:
    with zmq.Context() as context, context.socket(zmq.PUB) as server:
        server.setsockopt(zmq.LINGER, 0)
        address = f"tcp://127.0.0.1:{server.bind_to_random_port('tcp://127.0.0.1')}"
        with opened_window(display, tmp_path, "--follow", address, dots_per_inch=192) as window:
            said = window.said()
            assert said["boxes"]["info"][0] == f"follows {address}"
            # Two pixels for each of a desktop at 96 dots an inch.
            assert said["size"] == [1920, 1280]
            numbers = iter(range(1, 10_000))

            def shown() -> bool:
                send(server, next(numbers), 200)
                return window.said()["number"] > 0

            wait_until(shown, "a preview")
            window.person.move(640, 640)
            said = window.wait_for(lambda said: "pixel" in said["boxes"], "a pixel")
            assert said["boxes"]["pixel"][1] == "sRGB 200 200 200"
            assert said["boxes"]["info"][2].startswith("camera nav, reply 1")
            assert said["boxes"]["info"][0] == "2026-03-20T12:00:00 UTC"
            picture, _ = window.screenshot()
            assert picture[640, 960].tolist() == [200, 200, 200]
