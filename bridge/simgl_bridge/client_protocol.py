"""A client's side of the conversation without sockets: what it asks, and whether replies fit.

The synchronous client and the asynchronous one share it.
"""

from __future__ import annotations

import math
import operator
import time
from collections.abc import Mapping, Sequence

import zmq

from simgl.errors import BridgeError, ConfigError
from simgl_bridge.body_pose import BodyPose, floats
from simgl_bridge.client_errors import AccessError, NoAnswerError
from simgl_bridge.client_images import Tick, tick_of
from simgl_bridge.connect import FAILURES
from simgl_bridge.framing import VERSION, BadMessageError, unpack_reply
from simgl_bridge.messages import (
    CameraCard,
    Hello,
    Images,
    Message,
    Render,
    SentPose,
    SentSun,
    Shot,
    State,
    Welcome,
)
from simgl_bridge.state_hash import state_hash

# A deadline that the server keeps ends this much before the client's own [s].
_MARGIN = 0.2
# The most that a request may ask a server to wait [s].
LONGEST_DEADLINE = 3600.0


def check_timeout(timeout_s: float) -> None:
    """Raises ConfigError for a wait that would not end."""
    if not 0.0 < timeout_s < math.inf:
        raise ConfigError("Client", "timeout_s", f"must be finite, above 0 s, got {timeout_s}")


def server_deadline_ms(timeout_s: float, attempts: int = 1) -> int:
    """Time for the server to say that it cannot [ms], before a client gives up itself."""
    seconds = attempts * timeout_s
    return max(1, round(1000.0 * min(max(0.5 * seconds, seconds - _MARGIN), LONGEST_DEADLINE)))


def shot_of(
    camera: str,
    exposure_time_s: float | None,
    gain_dn_per_e: float | None,
    products: Sequence[str],
) -> Shot:
    """What one camera is asked for; None takes the camera's own."""
    return Shot(
        camera=camera,
        exposure_time_s=None if exposure_time_s is None else float(exposure_time_s),
        gain_dn_per_e=None if gain_dn_per_e is None else float(gain_dn_per_e),
        products=tuple(products),
    )


class ClientProtocol:
    """Requests made and replies checked, with what is known of the server.

    welcome : the last one; set by whoever carries the messages
    restarts : times that another server process of the same scene answered
    """

    welcome: Welcome

    def __init__(self, address: str) -> None:
        self.address = address
        self.last_sequence: int | None = None
        self.restarts = 0
        self.connected = False
        self._let_in = False
        self._boot = ""
        self._last_id = 0
        self._heard: float | None = None

    def next_id(self) -> int:
        """An id that was not used before."""
        self._last_id += 1
        return self._last_id

    def hello(self, name: str) -> Hello:
        """The first words."""
        return Hello(client=name, versions=(VERSION,))

    def greeted(self, welcome: Welcome) -> None:
        """Remember what the server said of itself."""
        self.welcome, self._boot = welcome, welcome.boot

    def render(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None,
        sun_position_m: Sequence[float] | None,
        seek: bool,
        deadline_ms: int | None,
        lamps: Mapping[str, float] | None = None,
        moving: bool = False,
    ) -> Render:
        """A request of the lock-step."""
        return Render(
            id=self.next_id(),
            tai_ns=_whole(tai_ns),
            cameras=tuple(cameras),
            bodies=_sent(bodies),
            sun=_sun(sun_position_m),
            seek=seek,
            deadline_ms=deadline_ms,
            lamps=_shares(lamps),
            moving=moving,
        )

    def state(
        self,
        tai_ns: int,
        cameras: Sequence[Shot],
        bodies: Mapping[str, BodyPose] | None,
        sun_position_m: Sequence[float] | None,
        lamps: Mapping[str, float] | None = None,
        moving: bool = False,
    ) -> State:
        """A state of the free-run."""
        return State(
            id=self.next_id(),
            tai_ns=_whole(tai_ns),
            cameras=tuple(cameras),
            bodies=_sent(bodies),
            sun=_sun(sun_position_m),
            lamps=_shares(lamps),
            moving=moving,
        )

    def opened(self, frames: Sequence[memoryview]) -> Message:
        """The message in frames that arrived; raises BridgeError for nonsense."""
        self._heard = time.monotonic()
        try:
            return unpack_reply(frames)
        except BadMessageError as error:
            raise BridgeError(f"{self.address}: the server sent nonsense: {error}") from None

    def shown(self, asked: Render | State, images: Images, payload: Sequence[memoryview]) -> Tick:
        """The images of a reply, once they are those of the state that was asked for.

        Raises BridgeError where they are not.
        """
        self._check_scene(images)
        own = state_hash(
            tai_ns=asked.tai_ns,
            bodies=asked.bodies,
            sun=asked.sun,
            cameras=[self._as_used(shot) for shot in asked.cameras],
            seed=self.welcome.seed,
            lamps=asked.lamps,
            moving=asked.moving,
        )
        if (images.tai_ns, images.state_hash) != (asked.tai_ns, own):
            raise BridgeError(
                f"{self.address}: image {images.sequence} shows another state than request "
                f"{asked.id}: {images.tai_ns} ns, hash {images.state_hash}; "
                f"asked for {asked.tai_ns} ns, hash {own}"
            )
        return self.unverified(images, payload)

    def unverified(self, images: Images, payload: Sequence[memoryview]) -> Tick:
        """The images of a reply of whose state this client knows nothing."""
        try:
            tick = tick_of(images, payload)
        except BridgeError as error:
            raise BridgeError(f"{self.address}: {error}") from None
        self.last_sequence = images.sequence
        return tick

    def _check_scene(self, images: Images) -> None:
        known = (self.welcome.scene_hash, self.welcome.seed)
        if (images.scene_hash, images.seed) != known:
            raise BridgeError(
                f"{self.address}: the server shows another scene now, {images.scene_hash} with "
                f"seed {images.seed} instead of {known[0]} with seed {known[1]}; connect again"
            )
        if images.boot != self._boot:
            # Restarted with the same scene: a picture depends on nothing else.
            self._boot = images.boot
            self.restarts += 1

    def _as_used(self, shot: Shot) -> tuple[str, float, float]:
        card = self._card(shot.camera)
        exposure, gain = shot.exposure_time_s, shot.gain_dn_per_e
        return (
            shot.camera,
            card.exposure_time_s if exposure is None else exposure,
            card.gain_dn_per_e if gain is None else gain,
        )

    def _card(self, camera: str) -> CameraCard:
        return next(c for c in self.welcome.cameras if c.name == camera)

    def heed(self, event: int) -> bool:
        """Take notice of an event of the socket's monitor; whether the connection broke.

        Raises AccessError where the handshake failed.
        """
        # A server that ends in the middle of a handshake fails it without detail, as one that does
        # not take the keys does: to a client that was let in before it is a broken connection.
        cut_off = event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL and self._let_in
        if event & FAILURES and not cut_off:
            raise AccessError(
                f"{self.address}: the server refused this client: its key, or the server's, is "
                "missing or wrong, or the client is not on the server's list"
            )
        broke = event == zmq.EVENT_DISCONNECTED and self.connected
        self.connected = event == zmq.EVENT_HANDSHAKE_SUCCEEDED
        self._let_in = self._let_in or self.connected
        return broke

    def no_answer(self, reason: str, message: Message) -> NoAnswerError:
        """The error for a request that nobody answered."""
        age = None if self._heard is None else time.monotonic() - self._heard
        asked = type(message).__name__.lower()
        return NoAnswerError(self.address, reason, asked, age, self.last_sequence)

    def timed_out(self, message: Message, timeout_s: float) -> NoAnswerError:
        """The error at a deadline."""
        what = "no answer" if self.connected else "no connection"
        return self.no_answer(f"{what} within {timeout_s:g} s", message)


def _sent(bodies: Mapping[str, BodyPose] | None) -> dict[str, SentPose]:
    return {name: pose.as_sent() for name, pose in (bodies or {}).items()}


def _whole(tai_ns: int) -> int:
    try:
        return operator.index(tai_ns)
    except TypeError:
        problem = "must be a whole number of nanoseconds"
        raise TypeError(f"tai_ns {problem}, got {tai_ns!r}") from None


def _shares(lamps: Mapping[str, float] | None) -> dict[str, float]:
    return {name: float(share) for name, share in (lamps or {}).items()}


def _sun(position_m: Sequence[float] | None) -> SentSun | None:
    if position_m is None:
        return None
    x, y, z = floats("sun_position_m", position_m, 3)
    return SentSun(position_m=(x, y, z))
