"""Images of the states that 42 sends, in lock-step with it.

Each state becomes the newest of the server's free-run stream, and 42 goes on when its images are
there. Flight software takes them from the same server with ``Client.next_images``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from simgl_bridge.client import Client
from simgl_bridge.client_errors import RemoteError
from simgl_bridge.client_images import ImageSet
from simgl_bridge.from_42.spacecraft_source import SpacecraftSource
from simgl_bridge.from_42.text_socket import TextSocket
from simgl_bridge.message_parts import Shot
from simgl_bridge.messages import ErrorCode


@dataclass
class Followed:
    """What was followed so far.

    states : messages of 42
    rendered : those of which there are images
    """

    states: int = 0
    rendered: int = 0


def follow(
    source: TextSocket,
    client: Client,
    spacecraft: Mapping[str, SpacecraftSource],
    cameras: Sequence[Shot],
    *,
    period_ns: int = 0,
    moving: bool = False,
) -> Followed:
    """Have the states of 42 rendered until it ends, or the source is told to stop.

    period_ns : the first state of every such interval of TAI is rendered; 0 renders every state
    moving : spacecraft move with their rates while the shutter is open

    Raises BridgeError where a message is malformed, or the server refuses a state or does not
    answer; 42 has then not been told to go on.
    """
    followed = Followed()
    last_slot: int | None = None
    sequence = 0
    while (message := source.next_state()) is not None:
        followed.states += 1
        # Slots of a fixed grid: a step that does not divide the period shifts nothing.
        slot = message.tai_ns // max(period_ns, 1)
        if slot != last_slot:
            last_slot = slot
            poses = {name: sent.pose(message) for name, sent in spacecraft.items()}
            state_id = client.send_state(message.tai_ns, cameras, poses, moving=moving)
            sequence = _images_of(client, state_id, sequence, source).sequence
            followed.rendered += 1
        source.acknowledge()
    return followed


def _images_of(client: Client, state_id: int, after: int, source: TextSocket) -> ImageSet:
    """The images of a state; those of states before it are passed over.

    A frame may take longer than an answer: the server then says that it draws.
    """
    is_drawn = True
    while True:
        try:
            images = client.next_images(after)
        except RemoteError as error:
            if error.code != ErrorCode.DEADLINE or source.is_stopped or not is_drawn:
                raise
            status = client.status()
            is_drawn = status is not None and status.state == "drawing"
            continue
        if images.state_id == state_id:
            return images
        after = images.sequence
