"""Images as a video."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.container import OutputContainer
from av.video.stream import VideoStream
from PIL import Image

from simgl.arrays import Image8
from simgl.errors import OutputError
from simgl.output import complete_file

# H.264, at a quality that shows no artefacts on the limb's gradient.
_CODEC, _QUALITY = "libx264", "16"


@contextmanager
def mp4_file(path: Path, frame_rate: int) -> Iterator[Callable[[Image8], None]]:
    """What adds an image (height, width, 3), all of one size, to a video: H.264 in MP4.

    An odd last row or column is left out. The file appears when the block ends without an error.

    frame_rate : [Hz]
    Raises OutputError where it cannot be written.
    """
    with complete_file(path) as temporary:
        try:
            with av.open(str(temporary), "w", format="mp4") as container:
                stream = cast(VideoStream, container.add_stream(_CODEC, rate=Fraction(frame_rate)))
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": _QUALITY}
                size: list[int] = []

                def add(pixels: Image8) -> None:
                    if not size:
                        size.extend(side - side % 2 for side in pixels.shape[:2])
                        stream.height, stream.width = size
                    _encode(container, stream, pixels[: size[0], : size[1]])

                yield add
                if size:
                    for packet in stream.encode():
                        container.mux(packet)
        except av.FFmpegError as error:
            raise OutputError(f"{path}: cannot be encoded ({error})") from None


def write_mp4(path: Path, images: Sequence[Path], frame_rate: int) -> None:
    """A video of image files, one per frame; see ``mp4_file``."""
    with mp4_file(path, frame_rate) as add:
        for image_path in images:
            with Image.open(image_path) as image:
                add(np.asarray(image.convert("RGB")))


def _encode(container: OutputContainer, stream: VideoStream, pixels: Image8) -> None:
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
    for packet in stream.encode(frame):
        container.mux(packet)
