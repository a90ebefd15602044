"""The ZeroMQ image service of simgl: a client sends a state and gets back its images.

- ``messages``, ``framing``, ``hashes``: the wire protocol simgl/1 (``docs/protocol.md``)
- ``client``, ``async_client``: sockets around ``client_protocol``, which has the requests, retries
  and deadlines; ``client_images``, ``client_errors``, ``body_pose``: what they take and return
- ``server``: the loop and the queue; ``simgl1_endpoint`` and ``basilisk``: the two protocols;
  ``render_request``, ``render_session``: from a request to its images
- ``access``, ``bind_address``, ``sockets``, ``router_socket``, ``preview``: sockets and keys
- ``commands``, ``processes``, ``launched_server``, ``run_with_server``: the server as a process

It may import all of ``simgl``; ``simgl`` never imports it. A new field of a message is added to
``messages``, its check to ``validate_request``, its effect to ``render_request``.
"""

from simgl_bridge.access import ClientKeys
from simgl_bridge.async_client import AsyncClient
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.client import Client
from simgl_bridge.client_errors import AccessError, NoAnswerError, RemoteError
from simgl_bridge.client_images import DelayLine, Image, ImageSet
from simgl_bridge.launched_server import launched_server
from simgl_bridge.messages import Shot
from simgl_bridge.preview import Watch

__all__ = [
    "AccessError",
    "AsyncClient",
    "BodyPose",
    "Client",
    "ClientKeys",
    "DelayLine",
    "Image",
    "ImageSet",
    "NoAnswerError",
    "RemoteError",
    "Shot",
    "Watch",
    "launched_server",
]
