"""The bytes of a glTF 2.0 file: JSON, buffers, accessors, image files and the tree of nodes."""

from __future__ import annotations

import base64
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TypeVar
from urllib.parse import unquote

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import AnyArray, Array
from simgl.config.path_sandbox import Base
from simgl.config.validation import fitted
from simgl.errors import AssetError, ConfigError
from simgl.input_files import read_file
from simgl.model_files import gltf_schema as schema

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
UNSIGNED, FLOAT = (5121, 5123, 5125), (5126,)
# Floats, or fractions of the largest number of 8 or 16 bits.
FRACTION = (5126, 5121, 5123)
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# Of the JSON, as Python objects some ten times as large, and of buffers and images together.
_MAX_JSON_BYTES, _MAX_NAMED_BYTES = 256 << 20, 4 << 30
# A node is visited once for each way that leads to it from the root. Part numbers have 16 bits.
MAX_NODES, MAX_NODE_DEPTH = 50_000, 256
_MAGIC, _JSON_CHUNK, _BINARY_CHUNK = b"glTF", 0x4E4F534A, 0x004E4942

T = TypeVar("T")


def _chunks(path: Path, content: bytes) -> tuple[bytes, bytes | None]:
    """The JSON text and the binary chunk of a .glb file."""
    if len(content) < 20 or content[:4] != _MAGIC:
        raise AssetError(f"{path}: is not a binary glTF file (no glTF header)")
    version, total = struct.unpack_from("<II", content, 4)
    if version != 2:
        raise AssetError(f"{path}: is glTF version {version}; simgl reads version 2")
    if len(content) < total:
        raise AssetError(f"{path}: is cut short, {len(content)} of {total} bytes")
    chunks: dict[int, bytes] = {}
    start = 12
    while start + 8 <= total:
        length, kind = struct.unpack_from("<II", content, start)
        if start + 8 + length > total:
            raise AssetError(f"{path}: has a chunk that runs past the end of the file")
        chunks.setdefault(kind, content[start + 8 : start + 8 + length])
        start += 8 + length
    if _JSON_CHUNK not in chunks:
        raise AssetError(f"{path}: has no JSON chunk")
    return chunks[_JSON_CHUNK], chunks.get(_BINARY_CHUNK)


class GltfFile:
    """One glTF file: its JSON and the bytes of its buffers and images.

    folder : of the files that it names; None is the folder of the file
    """

    def __init__(self, path: Path, folder: Base | None = None) -> None:
        self.path = path
        self._folder = path.parent if folder is None else folder
        content = read_file(path)
        self._named_bytes = 0
        self._blob: bytes | None = None
        if path.suffix.lower() == ".glb":
            content, self._blob = _chunks(path, content)
        if len(content) > _MAX_JSON_BYTES:
            raise AssetError(f"{path}: holds more than 256 MiB of JSON; put the buffers beside it")
        try:
            data = msgspec.json.decode(content)
        except ValueError as error:  # DecodeError and UnicodeDecodeError are of this kind
            raise AssetError(f"{path}: is not a glTF file ({error})") from None
        except RecursionError:
            raise AssetError(f"{path}: is not a glTF file (it is nested too deeply)") from None
        try:
            self.gltf = fitted(data, schema.Gltf, str(path))
        except ConfigError as error:
            raise AssetError(str(error)) from None
        unread = [n for n in self.gltf.extensions_required if n not in schema.READ_EXTENSIONS]
        if unread:
            names = ", ".join(unread)
            raise AssetError(f"{path}: needs the glTF extension {names}, which simgl does not read")
        self._buffers = [self._buffer(b.uri) for b in self.gltf.buffers]

    def _buffer(self, uri: str | None) -> bytes:
        if uri is None:
            if self._blob is None:
                raise AssetError(f"{self.path}: names no buffer file and carries no binary chunk")
            return self._blob
        return self._bytes("buffer", uri)

    def _bytes(self, what: str, uri: str) -> bytes:
        if uri.startswith("data:"):
            article = "an" if what[0] in "aeiou" else "a"
            try:
                content = base64.b64decode(uri.partition(",")[2], validate=True)
            except ValueError:  # binascii.Error, or for characters beyond ASCII
                raise AssetError(
                    f"{self.path}: holds {article} {what} that is not base64"
                ) from None
            return self._counted(content)
        try:
            file = self._folder / unquote(uri)
        except AssetError as error:
            raise AssetError(f'{self.path}: {what} "{uri}": {error}') from None
        try:
            content = read_file(file)
        except AssetError as error:
            reason = str(error).removeprefix(f"{file}: ")
            raise AssetError(f'{self.path}: {what} "{uri}" {reason}') from None
        return self._counted(content)

    def _counted(self, content: bytes) -> bytes:
        """The content of one of the files that this one names; all together are limited."""
        self._named_bytes += len(content)
        if self._named_bytes > _MAX_NAMED_BYTES:
            raise AssetError(f"{self.path}: names buffers and images of more than 4 GiB")
        return content

    def image(self, index: int) -> bytes:
        """The PNG or JPEG file of an image."""
        image = self.item("image", self.gltf.images, index)
        if image.uri is not None:
            return self._bytes("image", image.uri)
        if image.buffer_view is None:
            raise AssetError(f"{self.path}: image {index} names neither a file nor a buffer view")
        view = self.item("buffer view", self.gltf.buffer_views, image.buffer_view)
        data = self.item("buffer", self._buffers, view.buffer)
        end = view.byte_offset + (view.byte_length or 0)
        if end > len(data):
            raise AssetError(f"{self.path}: image {index} runs past the end of its buffer")
        return data[view.byte_offset : end]

    def item(self, kind: str, items: Sequence[T], index: int) -> T:
        """One of the file's numbered objects."""
        if index >= len(items):
            raise AssetError(f"{self.path}: names {kind} {index}, but holds only {len(items)}")
        return items[index]

    def array(
        self, index: int, kinds: str | tuple[str, ...], components: tuple[int, ...]
    ) -> AnyArray:
        """(count, width) values of an accessor of the given types and component types."""
        accessor = self.item("accessor", self.gltf.accessors, index)
        allowed = (kinds,) if isinstance(kinds, str) else kinds
        if accessor.type not in allowed or accessor.component_type not in components:
            types = " or ".join(_COMPONENTS[c] for c in components)
            got = f"{accessor.type} of {_COMPONENTS[accessor.component_type]}"
            wanted = f"{' or '.join(allowed)} of {types}"
            raise AssetError(f"{self.path}: accessor {index} must be {wanted}, got {got}")
        if accessor.buffer_view is None or accessor.sparse is not None:
            raise AssetError(f"{self.path}: accessor {index} is sparse or empty; that is not read")
        view = self.item("buffer view", self.gltf.buffer_views, accessor.buffer_view)
        data = self.item("buffer", self._buffers, view.buffer)
        dtype = np.dtype("<" + _COMPONENTS[accessor.component_type])
        width = _WIDTHS[accessor.type]
        start = view.byte_offset + accessor.byte_offset
        stride = view.byte_stride or dtype.itemsize * width
        if start + stride * (accessor.count - 1) + dtype.itemsize * width > len(data):
            raise AssetError(f"{self.path}: accessor {index} runs past the end of its buffer")
        return np.ndarray(
            (accessor.count, width), dtype, data, start, (stride, dtype.itemsize)
        ).copy()

    def fractions(self, index: int, kinds: str | tuple[str, ...]) -> Array:
        """(count, width) values of an accessor of floats or of normalized integers."""
        values = self.array(index, kinds, FRACTION)
        if values.dtype.kind != "f" and not self.gltf.accessors[index].normalized:
            raise AssetError(f"{self.path}: accessor {index} has integers that are not normalized")
        largest = 1.0 if values.dtype.kind == "f" else float(np.iinfo(values.dtype).max)
        return values.astype(np.float64) / largest

    def nodes(self) -> Iterator[tuple[schema.Node, Array, tuple[int, ...]]]:
        """Every node of the scene, parents before children.

        With its (4, 4) file_from_node matrix and the indices of the nodes from the root to it.
        """

        if not self.gltf.scenes:
            raise AssetError(f"{self.path}: holds no scene")
        roots = self.item("scene", self.gltf.scenes, self.gltf.scene).nodes
        self._check_tree(roots)
        local = {}
        waiting: list[tuple[int, Array, tuple[int, ...]]] = [
            (root, np.eye(4), ()) for root in reversed(roots)
        ]
        while waiting:
            index, parent, above = waiting.pop()
            node, path = self.gltf.nodes[index], (*above, index)
            if index not in local:
                local[index] = self._local(index, node)
            matrix = parent @ local[index]
            yield node, matrix, path
            waiting += ((child, matrix, path) for child in reversed(node.children))

    def _check_tree(self, roots: Sequence[int]) -> None:
        """Raise AssetError for nodes in a circle, and for more than are placed.

        Children that several nodes share are counted without being visited again: a few nodes may
        stand for more than there is memory for.
        """
        # Of each node how many are placed with it, and how many levels they take.
        sizes: dict[int, tuple[int, int]] = {}
        open_nodes: dict[int, None] = {}
        waiting = [(root, False) for root in roots]
        while waiting:
            index, left = waiting.pop()
            if left:
                del open_nodes[index]
                below = [sizes[child] for child in self.gltf.nodes[index].children]
                count = 1 + sum(one for one, _ in below)
                sizes[index] = count, 1 + max((depth for _, depth in below), default=0)
            elif index in open_nodes:
                raise AssetError(f"{self.path}: node {index} is its own ancestor")
            elif index not in sizes:
                node = self.item("node", self.gltf.nodes, index)
                open_nodes[index] = None
                waiting.append((index, True))
                waiting += ((child, False) for child in dict.fromkeys(node.children))
        if sum(sizes[root][0] for root in roots) > MAX_NODES:
            problem = f"places more than {MAX_NODES} nodes, each counted wherever it is used"
            raise AssetError(f"{self.path}: {problem}")
        if any(sizes[root][1] > MAX_NODE_DEPTH for root in roots):
            problem = f"has nodes more than {MAX_NODE_DEPTH} levels below each other"
            raise AssetError(f"{self.path}: {problem}")

    def _local(self, index: int, node: schema.Node) -> Array:
        if node.matrix is not None:
            return np.array(node.matrix, dtype=np.float64).reshape(4, 4).T
        if not np.any(node.rotation):
            raise AssetError(f"{self.path}: node {index} has a rotation of all zeros")
        matrix = np.eye(4)
        matrix[:3, :3] = Rotation.from_quat(node.rotation).as_matrix() * np.asarray(node.scale)
        matrix[:3, 3] = node.translation
        return matrix
