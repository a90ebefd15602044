"""The ZeroMQ image service of simgl: a client sends a state and gets back its images."""

from simgl_bridge.access import ClientKeys
from simgl_bridge.async_client import AsyncClient
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.client import Client
from simgl_bridge.client_errors import AccessError, NoAnswerError, RemoteError
from simgl_bridge.client_images import DelayLine, Image, Tick
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
    "NoAnswerError",
    "RemoteError",
    "Shot",
    "Tick",
    "Watch",
    "launched_server",
]
