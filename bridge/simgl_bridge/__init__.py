"""The ZeroMQ image service of simgl: a client sends a state and gets back its images.

- ``messages``, ``message_parts``, ``value_ranges``, ``framing``, ``hashes``: the wire protocol
  simgl/1 (``docs/protocol.md``)
- ``client``, ``async_client``: sockets around ``client_protocol``, which makes requests and
  verifies replies; ``client_call``: deadlines and retries of one request;
  ``client_images``, ``client_errors``, ``body_pose``: what they take and return
- ``server``: the loop and the queue; ``simgl1_endpoint`` and ``basilisk``: the two protocols;
  ``image_replies``, ``free_run``: replies with images, in lock-step and of the newest state
- ``render_queue``, ``renderer_link``: from there to the renderer, which is another process:
  ``render_process``, ``render_request``, ``render_session``: from a request to its images
- ``session_recording``, ``session_replay``: what was asked and answered, in a file, and again
- ``operator_log``, ``public_text``: what the server prints, and what clients may read of an error
- ``access``, ``bind_address``, ``sockets``, ``router_socket``, ``preview``: sockets and keys
- ``commands``, ``serving``, ``processes``, ``launched_server``, ``run_with_server``: the server as
  a process

It may import all of ``simgl``; ``simgl`` never imports it. A new field of a message is added to
``messages`` or ``message_parts`` with its range (``value_ranges``), a check that needs the scene to
``validate_request``, its effect to ``render_request``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simgl_bridge.access import ClientKeys as ClientKeys
    from simgl_bridge.async_client import AsyncClient as AsyncClient
    from simgl_bridge.body_pose import BodyPose as BodyPose
    from simgl_bridge.client import Client as Client
    from simgl_bridge.client import PendingImages as PendingImages
    from simgl_bridge.client_errors import AccessError as AccessError
    from simgl_bridge.client_errors import NoAnswerError as NoAnswerError
    from simgl_bridge.client_errors import RemoteError as RemoteError
    from simgl_bridge.client_images import DelayLine as DelayLine
    from simgl_bridge.client_images import Image as Image
    from simgl_bridge.client_images import ImageSet as ImageSet
    from simgl_bridge.launched_server import launched_server as launched_server
    from simgl_bridge.message_parts import ServerStatus as ServerStatus
    from simgl_bridge.message_parts import Shot as Shot
    from simgl_bridge.preview import PreviewClient as PreviewClient

# Loaded at first use: a server answers its first client before a client's imports are done.
_MODULES = {
    "access": "ClientKeys",
    "async_client": "AsyncClient",
    "body_pose": "BodyPose",
    "client": "Client PendingImages",
    "client_errors": "AccessError NoAnswerError RemoteError",
    "client_images": "DelayLine Image ImageSet",
    "launched_server": "launched_server",
    "message_parts": "ServerStatus Shot",
    "preview": "PreviewClient",
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    """Load a public name from its module (PEP 562) and keep it."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"simgl_bridge.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
