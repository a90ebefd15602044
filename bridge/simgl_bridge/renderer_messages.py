"""Messages between a server and its renderer process, as MessagePack; planes follow as raw frames.

    server                                    renderer
                                         <-   Progress       while it starts
                                         <-   ServedScene    ready
    Draw           a checked request     ->
                                         <-   Drawn          values used, then planes
    Configure      scenario, seed        ->
                                         <-   ServedScene    the new one
    DrawForBasilisk  state, camera       ->
                                         <-   BasiliskPng    then the image
    Finish                               ->

A task may be answered by an Error instead, and the start by a Failure. Both ends are of the same
version, so the messages are no part of the protocol simgl/1.
"""

from __future__ import annotations

from functools import reduce
from operator import or_

import msgspec
from msgspec import Struct

from simgl_bridge.basilisk.viz_messages import Update
from simgl_bridge.message_parts import CameraDescription, CameraImage, SentPose
from simgl_bridge.messages import (
    Configure,
    Error,
    Message,
    Render,
    State,
)


class Draw(Message, frozen=True, kw_only=True):
    """The images of a request.

    preview : whether a preview of the first image is wanted
    """

    request: Render | State
    preview: bool


class DrawForBasilisk(Message, frozen=True, kw_only=True):
    """The image of a camera for a state of Basilisk."""

    camera_id: int
    state: Update


class Finish(Message, frozen=True, kw_only=True):
    """Close the simulator and end."""


class Progress(Message, frozen=True, kw_only=True):
    """What is being prepared, and how far; total is 0 where steps are not counted."""

    what: str
    done: int = 0
    total: int = 0


class ServedJoint(Struct, frozen=True, kw_only=True):
    """A movable joint: its limits [rad] or [m], and the unit to name."""

    name: str
    limits: tuple[float, float]
    unit: str


class ServedModel(Struct, frozen=True, kw_only=True):
    """A spacecraft that a request may place."""

    joints: tuple[ServedJoint, ...]


class ServedScene(Message, frozen=True, kw_only=True):
    """What a server has to know of its scenario: to describe it, and to check requests.

    renderer : OpenGL renderer and version
    name : of the scenario
    camera_files : of Basilisk's cameras, for the operator
    compressions : of planes, that the renderer has
    """

    renderer: str
    name: str
    scene_hash: str
    epoch_tai_ns: int
    seed: int
    cameras: dict[str, CameraDescription]
    models: dict[str, ServedModel]
    lamps: tuple[str, ...]
    camera_files: str = ""
    compressions: tuple[str, ...] = ()


class Drawn(Message, frozen=True, kw_only=True):
    """Images of a request; their planes follow as frames, and the preview's pixels as the last.

    bodies : every spacecraft's pose as it was used
    preview_camera : camera of the preview; empty where there is none
    preview_shape : height, width, 3 of 8-bit sRGB
    """

    bodies: dict[str, SentPose]
    images: tuple[CameraImage, ...]
    preview_camera: str = ""
    preview_shape: tuple[int, int, int] = (0, 0, 0)


class BasiliskPng(Message, frozen=True, kw_only=True):
    """An image for Basilisk, which follows as a frame; empty where there is none."""


class Failure(Message, frozen=True, kw_only=True):
    """Why the renderer cannot start: one line that names file, key and value."""

    detail: str


Task = Draw | DrawForBasilisk | Configure
Answer = Drawn | BasiliskPng | ServedScene | Error

_TASKS = (Draw, DrawForBasilisk, Configure, Finish)
_REPORTS = (Progress, ServedScene, Drawn, BasiliskPng, Error, Failure)

TASK_DECODER: msgspec.msgpack.Decoder[Message] = msgspec.msgpack.Decoder(reduce(or_, _TASKS))
REPORT_DECODER: msgspec.msgpack.Decoder[Message] = msgspec.msgpack.Decoder(reduce(or_, _REPORTS))
ENCODER = msgspec.msgpack.Encoder()
