"""Small glTF files written by hand for the import tests."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Json = dict[str, Any]

FLOAT, UNSIGNED_SHORT = 5126, 5123


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
        }

    def accessor(self, values: ArrayLike, component: int = FLOAT) -> int:
        """Vectors of floats or scalar indices; returns the accessor's number."""
        array = np.asarray(values, dtype="<f4" if component == FLOAT else "<u2")
        content = array.tobytes()
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)}
        )
        # Four-byte alignment, as the format asks.
        self.data += content + b"\0" * (-len(content) % 4)
        self.json["accessors"].append(
            {
                "bufferView": len(self.json["bufferViews"]) - 1,
                "componentType": component,
                "count": len(array),
                "type": "VEC3" if array.ndim == 2 else "SCALAR",
            }
        )
        return len(self.json["accessors"]) - 1

    def mesh(self, **primitive: Any) -> int:
        """A mesh of one primitive; returns its number."""
        self.json["meshes"].append({"primitives": [primitive]})
        return len(self.json["meshes"]) - 1

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
