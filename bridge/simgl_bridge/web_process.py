"""The process of a server's browser view: shows in browsers what a loop's client was sent."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import zmq

from simgl.arrays import AnyArray
from simgl.errors import SimglError
from simgl.figures.displays import CameraImages
from simgl.physics.constants import ASTRONOMICAL_UNIT
from simgl.physics.frames import Pose, matrix_from_quaternion
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.viewer.idle_priority import run_when_idle
from simgl.web.page_server import PageServer
from simgl.web.snapshots import NewestSnapshot, Snapshot
from simgl.web.web_access import web_access
from simgl_bridge.message_parts import CameraImage, SentPose
from simgl_bridge.messages import Images, Statistics
from simgl_bridge.processes import end_with_parent
from simgl_bridge.sockets import receive
from simgl_bridge.web_feed import SHOWN_DECODER, WebOptions

# Shortest time between two images that are asked for [s].
_INTERVAL = 0.1
# Interval at which viewers and images are looked for where neither comes [s].
_POLL = 0.2
# Of each processor but one, which is the loop's own, that showing images may take; of a single one
# too.
_SHARE = 0.02
_PLANES = ("dn", "electrons", "radiance", "depth")


def shown_state(scenario: Scenario, images: Images) -> SceneState:
    """The state that images show."""
    shown = {name: sent for name, sent in images.bodies.items() if name in scenario.models}
    poses = {name: _pose(sent) for name, sent in shown.items()}
    joints = {name: sent.joints for name, sent in shown.items() if sent.joints}
    sun = None
    if images.images:
        sun = ASTRONOMICAL_UNIT * np.array(images.images[0].sun_direction_icrf)
    return scenario.with_poses(images.tai_ns, poses, joint_angles=joints, sun=sun)


def _pose(sent: SentPose) -> Pose:
    return Pose(
        position=np.array(sent.position_m, dtype=np.float64),
        velocity=np.array(sent.velocity_m_s, dtype=np.float64),
        R_icrf_from_body=matrix_from_quaternion(sent.q_icrf_from_body_xyzw),
    )


def camera_images(
    scenario: Scenario, images: Images, frames: Sequence[memoryview]
) -> dict[str, CameraImages]:
    """The planes of a reply by camera, without a copy.

    frames : one for each plane, in their order
    """
    by_camera, at = {}, 0
    for image in images.images:
        planes: dict[str, AnyArray] = {}
        for plane in image.planes:
            array = np.frombuffer(frames[at], plane.dtype).reshape(plane.shape)
            at += 1
            if plane.product in _PLANES:
                planes[plane.product] = array
        if image.camera in scenario.cameras:
            by_camera[image.camera] = _camera_images(scenario, image, planes)
    return by_camera


def _camera_images(
    scenario: Scenario, image: CameraImage, planes: dict[str, AnyArray]
) -> CameraImages:
    camera = scenario.cameras[image.camera]
    detector = replace(camera.detector, gain_dn_per_e=image.gain_dn_per_e)
    pixels, saturated = detector.width * detector.height, image.saturated_pixels
    return CameraImages(
        camera=replace(camera, exposure_time=image.exposure_time_s, detector=detector),
        planes=planes,
        saturated_share=None if saturated is None else saturated / pixels,
        seconds=image.render_us * 1e-6,
    )


def statistics_rows(statistics: Statistics, rate_hz: float) -> list[list[str]]:
    """Names and values as the page lists them.

    rate_hz : of replies with images
    """
    return [
        ["Replies with images", str(statistics.images)],
        ["Replies a second", f"{rate_hz:.1f}"],
        ["Sent again", str(statistics.repeated)],
        ["Errors", f"{statistics.errors} ({statistics.busy} busy)"],
        ["Lost replies", str(statistics.lost)],
        ["Requests waiting", str(statistics.waiting)],
        ["Clients", str(statistics.clients)],
    ]


def _rest(asked: float, used: float) -> None:
    """Wait until another image may be asked for.

    asked : when the last one was [s, monotonic]
    used : processor time of this process then [s]
    """
    share = _SHARE * max(1, (os.cpu_count() or 1) - 1)
    while True:
        # The last one may still be encoded, on another thread.
        interval = max(_INTERVAL, (time.process_time() - used) / share)
        if (rest := asked + interval - time.monotonic()) <= 0.0:
            return
        time.sleep(rest)


class Follower:
    """Asks the server for images while somebody looks on, and publishes them."""

    def __init__(self, scenario: Scenario, newest: NewestSnapshot, socket: zmq.Socket[Any]) -> None:
        self._scenario, self._newest, self._socket = scenario, newest, socket
        self._before: tuple[float, int] | None = None
        self._images: dict[str, CameraImages] = {}
        start = scenario.at(scenario.epoch_tai_ns)
        newest.publish(Snapshot(state=start, images={}, status={"message": ""}))
        socket.send(b"ready")

    def run(self) -> None:
        """For as long as the process lives."""
        is_asked = True
        asked, used = time.monotonic(), time.process_time()
        while True:
            if not is_asked and self._newest.wait_until_wanted(_POLL):
                _rest(asked, used)
                asked, used = time.monotonic(), time.process_time()
                self._socket.send(b"more")
                is_asked = True
            if is_asked and self._socket.poll(round(1e3 * _POLL)):
                frames = receive(self._socket)
                shown = SHOWN_DECODER.decode(frames[0].buffer)
                self._publish(shown.images, [f.buffer for f in frames[1:]], shown.statistics)
                is_asked = False

    def _publish(
        self, images: Images, frames: Sequence[memoryview], statistics: Statistics
    ) -> None:
        now = time.monotonic()
        rate = 0.0
        if self._before is not None:
            rate = (images.sequence - self._before[1]) / (now - self._before[0])
        self._before = now, images.sequence
        # A request may be for one camera; the others keep their last images.
        self._images |= camera_images(self._scenario, images, frames)
        message = ""
        try:
            state = shown_state(self._scenario, images)
        except SimglError as error:
            state, message = self._scenario.at(self._scenario.epoch_tai_ns), str(error)
        status = {"statistics": statistics_rows(statistics, rate), "message": message}
        self._newest.publish(Snapshot(state=state, images=dict(self._images), status=status))


def main() -> None:
    """The process."""
    address, parent, text = sys.argv[1:]
    end_with_parent(int(parent))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    options = msgspec.json.decode(text, type=WebOptions)
    try:
        token_file = None if options.token_file is None else Path(options.token_file)
        access = web_access(options.address, token_file)
        scenario = load_scenario(Path(options.scenario))
        newest = NewestSnapshot(scenario, follows=f'what clients of "{scenario.name}" are sent')
        # From here on, with all threads: the start takes seconds, as that of the renderer does.
        run_when_idle(owns_session=True)
        with PageServer(newest, access) as server, zmq.Context() as context:
            print(f"Open {server.url} in a browser.", flush=True)
            socket = context.socket(zmq.PAIR)
            socket.setsockopt(zmq.LINGER, 0)
            socket.connect(address)
            Follower(scenario, newest, socket).run()
    except SimglError as error:
        print(f"simgl: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
