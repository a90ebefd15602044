"""The ZeroMQ image service of simgl: a client sends a state and gets back its images."""

from simgl_bridge.access import ClientKeys
from simgl_bridge.asynchronous import AsyncClient
from simgl_bridge.client import Client
from simgl_bridge.failures import AccessError, NoAnswerError, RemoteError
from simgl_bridge.image import DelayLine, Image, Tick
from simgl_bridge.launch import launched_server
from simgl_bridge.messages import Shot
from simgl_bridge.pose import BodyPose
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
