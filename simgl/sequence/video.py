"""A video of a sequence's frames."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.container import OutputContainer
from av.video.stream import VideoStream
from PIL import Image

from simgl.errors import OutputError
from simgl.output import complete_file

# H.264, at a quality that shows no artefacts on the limb's gradient.
_CODEC, _QUALITY = "libx264", "16"


def write_mp4(path: Path, images: Sequence[Path], frame_rate: int) -> None:
    """H.264 in MP4 of images of one size, one per frame; an odd last row or column is left out.

    frame_rate : [Hz]
    Raises OutputError where it cannot be written.
    """
    with complete_file(path) as temporary:
        try:
            with av.open(str(temporary), "w", format="mp4") as container:
                _encode(container, images, frame_rate)
        except av.FFmpegError as error:
            raise OutputError(f"{path}: cannot be encoded ({error})") from None


def _encode(container: OutputContainer, images: Sequence[Path], frame_rate: int) -> None:
    stream = cast(VideoStream, container.add_stream(_CODEC, rate=Fraction(frame_rate)))
    stream.pix_fmt = "yuv420p"
    stream.options = {"crf": _QUALITY}
    for index, path in enumerate(images):
        with Image.open(path) as image:
            pixels = np.asarray(image.convert("RGB"))
        height, width = (size - size % 2 for size in pixels.shape[:2])
        if index == 0:
            stream.width, stream.height = width, height
        even = np.ascontiguousarray(pixels[:height, :width])
        for packet in stream.encode(av.VideoFrame.from_ndarray(even, format="rgb24")):
            container.mux(packet)
    for packet in stream.encode():
        container.mux(packet)
