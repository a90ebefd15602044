"""Small glTF files written by hand for the import tests."""

from __future__ import annotations

import base64
import io
import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

Json = dict[str, Any]

FLOAT, UNSIGNED_SHORT = 5126, 5123


def png(pixels: ArrayLike) -> bytes:
    """A PNG file of (height, width[, 3 or 4]) values, 8 bits each or grey of 16."""
    array = np.asarray(pixels)
    file = io.BytesIO()
    Image.fromarray(array if array.dtype == np.uint16 else array.astype(np.uint8)).save(file, "PNG")
    return file.getvalue()


def png_of_16_bits(pixels: ArrayLike, transparent: tuple[int, ...] = ()) -> bytes:
    """A PNG file of (height, width, 2 to 4) values of 16 bits, which Pillow does not write.

    transparent : the one colour that is, of three channels
    """
    array = np.asarray(pixels, dtype=">u2")
    height, width, channels = array.shape
    kind = {2: 4, 3: 2, 4: 6}[channels]

    def chunk(name: bytes, data: bytes) -> bytes:
        check = zlib.crc32(name + data)
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", check)

    # Each row behind the number of its filter.
    rows = b"".join(b"\0" + row.tobytes() for row in array)
    chunks = [chunk(b"IHDR", struct.pack(">2I5B", width, height, 16, kind, 0, 0, 0))]
    if transparent:
        chunks.append(chunk(b"tRNS", np.array(transparent, dtype=">u2").tobytes()))
    chunks += [chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


class Document:
    """A glTF document under construction: accessors fill one buffer."""

    def __init__(self) -> None:
        self.data = b""
        self.json: Json = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [],
            "meshes": [],
            "materials": [],
            "accessors": [],
            "bufferViews": [],
            "images": [],
            "samplers": [],
            "textures": [],
        }

    def view(self, content: bytes) -> int:
        """Any bytes; returns the number of their buffer view."""
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)}
        )
        # Four-byte alignment, as the format asks.
        self.data += content + b"\0" * (-len(content) % 4)
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: ArrayLike, component: int = FLOAT) -> int:
        """Vectors of floats or scalar indices; returns the accessor's number."""
        array = np.asarray(values, dtype="<f4" if component == FLOAT else "<u2")
        self.json["accessors"].append(
            {
                "bufferView": self.view(array.tobytes()),
                "componentType": component,
                "count": len(array),
                "type": "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}",
            }
        )
        return len(self.json["accessors"]) - 1

    def mesh(self, **primitive: Any) -> int:
        """A mesh of one primitive; returns its number."""
        self.json["meshes"].append({"primitives": [primitive]})
        return len(self.json["meshes"]) - 1

    def texture(self, pixels: ArrayLike, **sampler: int) -> int:
        """An embedded PNG of (height, width[, 3 or 4]) bytes; returns the texture's number."""
        self.json["images"].append({"bufferView": self.view(png(pixels)), "mimeType": "image/png"})
        texture = {"source": len(self.json["images"]) - 1}
        if sampler:
            self.json["samplers"].append(sampler)
            texture["sampler"] = len(self.json["samplers"]) - 1
        self.json["textures"].append(texture)
        return len(self.json["textures"]) - 1

    def _whole(self, buffer: Json) -> bytes:
        content = {k: v for k, v in self.json.items() if v != []}
        content["buffers"] = [{"byteLength": len(self.data), **buffer}]
        return json.dumps(content).encode()

    def write_gltf(self, path: Path) -> Path:
        """With the buffer as a data URI."""
        text = base64.b64encode(self.data).decode()
        path.write_bytes(self._whole({"uri": f"data:application/octet-stream;base64,{text}"}))
        return path

    def write_gltf_and_bin(self, path: Path, name: str, uri: str) -> Path:
        """With the buffer in a file beside it."""
        (path.parent / name).write_bytes(self.data)
        path.write_bytes(self._whole({"uri": uri}))
        return path

    def write_glb(self, path: Path) -> Path:
        """As one binary file."""
        text = self._whole({})
        text += b" " * (-len(text) % 4)
        body = struct.pack("<II", len(text), 0x4E4F534A) + text
        body += struct.pack("<II", len(self.data), 0x004E4942) + self.data
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
        return path


def triangle(**node: Any) -> Document:
    """One part: the triangle (0,0,0) (1,0,0) (0,1,0) without indices or normals."""
    document = Document()
    points = document.accessor([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = document.mesh(attributes={"POSITION": points})
    document.json["nodes"].append({"name": "facet", "mesh": mesh, **node})
    return document


# Corners of the image: left and right end, bottom and top; v runs down from the top row.
UPRIGHT = ((0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0))


def square(uv: ArrayLike = UPRIGHT, **attributes: int) -> Document:
    """One part: a square of 2 m facing +z, x to the right and y up, in material 0.

    uv : of its corners (-1,-1) (1,-1) (1,1) (-1,1)
    """
    document = Document()
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    mesh = document.mesh(
        attributes={
            "POSITION": document.accessor(corners),
            "NORMAL": document.accessor([[0, 0, 1]] * 4),
            "TEXCOORD_0": document.accessor(uv),
            **attributes,
        },
        indices=document.accessor([0, 1, 2, 0, 2, 3], UNSIGNED_SHORT),
        material=0,
    )
    document.json["nodes"].append({"name": "square", "mesh": mesh})
    return document
