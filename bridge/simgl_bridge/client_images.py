"""Images that a client receives, with the state that they show, and their delay."""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec import structs

from simgl.arrays import AnyArray, Array, Image16
from simgl.errors import BridgeError
from simgl_bridge.hashes import plane_hash
from simgl_bridge.message_parts import (
    CameraImage,
    Plane,
    Quaternion,
    SentPose,
    Vector,
)
from simgl_bridge.messages import Images
from simgl_bridge.plane_compression import ZSTD, decompressed

# Pixel types of planes, little-endian.
DTYPES = ("<u2", "<u4", "<f4")


@dataclass(frozen=True, kw_only=True, eq=False)
class Image:
    """The image of one camera and the state that it shows.

    camera : its name
    planes : product to pixels, row 0 at the top; read-only
    units : product to unit
    sequence : number of the reply among those with images of the server
    tai_ns : mid-exposure
    exposure_start_tai_ns, exposure_end_tai_ns : half an exposure before and after mid-exposure
    readout_end_tai_ns : when the last row is read; not before its exposure ends
    available_tai_ns : when flight software receives the image
    state_hash : of the state that is shown, verified by the client
    exposure_time_s, gain_dn_per_e : that were used
    camera_position_m : of the pinhole, Earth-centred ICRF
    q_camera_from_icrf_xyzw : camera axes are z boresight, x right, y down
    intrinsics : (3, 3) from camera axes to pixel coordinates
    sun_direction_icrf : unit, from the camera towards the Sun
    sun_irradiance_w_m2 : bands R, G, B, N at the camera, unobstructed
    bodies : every spacecraft's pose that the image shows
    seed : of the noise
    saturated_pixels : None if digital numbers were not requested
    render_time_s : rendering time on the server
    part_names : part id to "spacecraft/part", if part ids were requested
    interreflection : "off"; "exact"; or "quick": with joints moved and ``joint_light = "quick"``;
        empty from servers that do not report it
    thermal_state, thermal_history : state and origin of a thermal camera's temperatures, see
        ``thermal_from`` of ``Client.render_all``
    """

    planes: Mapping[str, AnyArray]
    units: Mapping[str, str]
    sequence: int
    tai_ns: int
    exposure_start_tai_ns: int
    exposure_end_tai_ns: int
    readout_end_tai_ns: int
    available_tai_ns: int
    state_hash: str
    camera: str
    camera_position_m: Vector
    q_camera_from_icrf_xyzw: Quaternion
    exposure_time_s: float
    gain_dn_per_e: float
    intrinsics: Array
    sun_direction_icrf: Vector
    sun_irradiance_w_m2: Quaternion
    bodies: Mapping[str, SentPose]
    seed: int
    saturated_pixels: int | None
    render_time_s: float
    part_names: Mapping[int, str]
    interreflection: str
    thermal_state: str
    thermal_history: str

    @property
    def dn(self) -> Image16:
        """(height, width) digital numbers; raises BridgeError if they were not requested."""
        if "dn" not in self.planes:
            raise BridgeError(f'this image has no "dn", only {", ".join(self.planes)}')
        return self.planes["dn"]

    def plane_hash(self, product: str = "dn") -> str:
        """Hash of an image's content, as in recorded sessions: 32 hexadecimal digits.

        product : of the plane, such as "dn"
        """
        plane = np.ascontiguousarray(self.planes[product])
        return plane_hash(memoryview(plane.data).cast("B"))


@dataclass(frozen=True, kw_only=True, eq=False)
class ImageSet(Mapping[str, Image]):
    """The images of one request by camera.

    images : camera name to image
    sequence : number of the reply among those with images of the server
    tai_ns : mid-exposure
    state_hash : of the state that is shown, verified by the client
    seed : of the noise
    boot : of the server process
    state_id : free-run: id of the state that is shown; None in lock-step
    dropped : free-run: states replaced by newer ones, unrendered, since the images before
    """

    images: Mapping[str, Image]
    sequence: int
    tai_ns: int
    state_hash: str
    seed: int
    boot: str
    state_id: int | None
    dropped: int

    def __getitem__(self, camera: str) -> Image:
        return self.images[camera]

    def __iter__(self) -> Any:
        return iter(self.images)

    def __len__(self) -> int:
        return len(self.images)


class DelayLine:
    """Delays images by read-out and transport, in simulation time.

    >>> line = DelayLine()
    >>> line.post(client.render(now, "navcam", bodies))
    >>> for image in line.due(now):            # available_tai_ns is over
    ...     navigation.update(image)           # image.tai_ns is its mid-exposure
    """

    def __init__(self) -> None:
        self._pending: list[tuple[int, int, Image]] = []
        self._count = 0

    def post(self, image: Image) -> None:
        """Hold an image until it is available.

        image : of any camera
        """
        self._count += 1
        heapq.heappush(self._pending, (image.available_tai_ns, self._count, image))

    def due(self, tai_ns: int) -> list[Image]:
        """The images available by a time, in order; each is returned once.

        tai_ns : time of the flight software
        """
        arrived = []
        while self._pending and self._pending[0][0] <= tai_ns:
            arrived.append(heapq.heappop(self._pending)[2])
        return arrived

    def __len__(self) -> int:
        return len(self._pending)


def images_of(reply: Images, payload: Sequence[memoryview]) -> ImageSet:
    """The images in a reply; arrays refer to the received frames without a copy.

    Raises BridgeError if frames and header do not match.
    """
    announced = sum(len(i.planes) for i in reply.images)
    if announced != len(payload):
        raise BridgeError(f"reply announces {announced} planes and brings {len(payload)}")
    frames = iter(payload)
    images = {}
    for image in reply.images:
        planes = {p.product: _pixels(p, next(frames)) for p in image.planes}
        images[image.camera] = _image(reply, image, planes)
    return ImageSet(
        images=images,
        sequence=reply.sequence,
        tai_ns=reply.tai_ns,
        state_hash=reply.state_hash,
        seed=reply.seed,
        boot=reply.boot,
        state_id=reply.state_id,
        dropped=reply.dropped,
    )


def _image(reply: Images, image: CameraImage, planes: Mapping[str, AnyArray]) -> Image:
    shared = structs.asdict(image)
    for name in ("position_m", "intrinsics", "render_us", "planes"):
        del shared[name]
    return Image(
        planes=planes,
        units={p.product: p.unit for p in image.planes},
        sequence=reply.sequence,
        tai_ns=reply.tai_ns,
        state_hash=reply.state_hash,
        camera_position_m=image.position_m,
        intrinsics=np.array(image.intrinsics),
        bodies=reply.bodies,
        seed=reply.seed,
        render_time_s=image.render_us * 1e-6,
        **shared,
    )


def _pixels(plane: Plane, frame: memoryview) -> AnyArray:
    if plane.dtype not in DTYPES or min(plane.shape, default=0) < 1:
        raise BridgeError(f"is not a plane: {plane}")
    dtype = np.dtype(plane.dtype)
    expected = math.prod(plane.shape) * dtype.itemsize
    if plane.compression == ZSTD:
        frame = memoryview(decompressed(plane.product, frame, expected))
    elif plane.compression:
        raise BridgeError(f'plane "{plane.product}" is compressed as "{plane.compression}"')
    if frame.nbytes != expected:
        raise BridgeError(
            f'plane "{plane.product}" announces {expected} bytes and brings {frame.nbytes}'
        )
    array = np.frombuffer(frame, dtype=dtype).reshape(plane.shape)
    array.flags.writeable = False
    return array
