"""The ZeroMQ image service of simgl: a client sends a state and gets back its image."""

from simgl_bridge.client import Client, Image, RemoteError
from simgl_bridge.launch import launched_server
from simgl_bridge.pose import BodyPose

__all__ = ["BodyPose", "Client", "Image", "RemoteError", "launched_server"]
