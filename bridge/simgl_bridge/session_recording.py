"""Recorded sessions: what a server was asked and what it answered, in one file.

The file begins with ``simgl session 1`` and a line feed. Records follow, all in this form::

    uint64  length of the header, little-endian
    uint64  length of the planes, little-endian
    uint32  CRC-32 of both lengths, header and planes, little-endian
    header  a MessagePack map with a text "type": opened, configured or answered
    planes  raw, in the order of the header; empty unless images are recorded

A record is handed to the operating system before the reply is sent, so a server that is killed
loses none of them; the file is synchronised with the disk when it is closed, so a power failure may
cost the last seconds. A last record that is cut off is ignored.
"""

from __future__ import annotations

import os
import struct
import time
import uuid
import zlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import reduce
from operator import or_
from pathlib import Path
from typing import BinaryIO

import msgspec

from simgl import __version__
from simgl.errors import AssetError, OutputError
from simgl.output import check_writable
from simgl_bridge.framing import BadMessageError
from simgl_bridge.hashes import plane_hash
from simgl_bridge.message_parts import CameraImage, SentPose
from simgl_bridge.messages import (
    ErrorCode,
    Message,
    Render,
    State,
)
from simgl_bridge.operator_log import OperatorLog
from simgl_bridge.renderer_messages import ServedScene
from simgl_bridge.value_ranges import Seed

_NAME = b"simgl session "
MAGIC = _NAME + b"1\n"
SUFFIX = ".simgl-session"
_LENGTHS, _CHECKSUM = struct.Struct("<QQ"), struct.Struct("<I")

Planes = Sequence[memoryview]


class Opened(Message, frozen=True, kw_only=True):
    """The first record: what is served.

    simgl : version
    started_utc : by the clock of the server, for people
    scenario_file : absolute path; nil for a scenario without a file
    root : absolute path of the folder that clients choose scenarios from; nil without one
    scene_hash : of the content of everything that the scenario names, without its seed
    with_images : whether planes are recorded, and not only their hashes
    """

    simgl: str
    started_utc: str
    scenario: str
    scenario_file: str | None
    root: str | None
    scene_hash: str
    seed: Seed
    renderer: str
    with_images: bool


class Configured(Message, frozen=True, kw_only=True):
    """A client chose another scenario or seed.

    scenario : name of the scenario in use, one of the root's; nil for the one that was opened
    """

    scenario: str | None
    seed: Seed
    scene_hash: str


class Answered(Message, frozen=True, kw_only=True):
    """A request, or a state in free-run, and the images that it was answered with.

    request : as it was sent
    bodies, images : of the reply
    plane_hashes : BLAKE2b with 16 bytes of each plane, in hexadecimal digits, in the order of the
        images
    """

    request: Render | State
    state_hash: str
    bodies: dict[str, SentPose]
    images: tuple[CameraImage, ...]
    plane_hashes: tuple[str, ...]


RECORDS: tuple[type[Message], ...] = (Opened, Configured, Answered)
_ENCODER = msgspec.msgpack.Encoder()
_DECODER: msgspec.msgpack.Decoder[Message] = msgspec.msgpack.Decoder(reduce(or_, RECORDS))


class SessionRecorder:
    """Writes the records of one session to a new file in a folder.

    with_images : record the planes, too

    Raises OutputError where no file can be written.
    """

    def __init__(self, folder: Path, *, with_images: bool = False) -> None:
        check_writable(folder)
        stamp = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())
        self.path = folder / f"{stamp}-{uuid.uuid4().hex[:8]}{SUFFIX}"
        self._with_images = with_images
        self._chosen: str | None = None
        # A choice that could not be written goes before the next record.
        self._unwritten = b""
        self._size = 0
        self._file: BinaryIO | None = None
        self._log = OperatorLog()

    def opened(self, scene: ServedScene, *, scenario_file: Path | None, root: Path | None) -> None:
        """Create the file and record what is served; raises OutputError."""
        record = Opened(
            simgl=__version__,
            started_utc=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
            scenario=scene.name,
            scenario_file=None if scenario_file is None else str(scenario_file.resolve()),
            root=None if root is None else str(root.resolve()),
            scene_hash=scene.scene_hash,
            seed=scene.seed,
            renderer=scene.renderer,
            with_images=self._with_images,
        )
        try:
            self._file = self.path.open("xb", buffering=0)
        except OSError as error:
            raise OutputError(f"{self.path}: cannot be written ({error.strerror})") from None
        self._append([MAGIC, *_encoded(record)])

    def configured(self, chosen: str | None, seed: int, scene_hash: str) -> None:
        """Record what a client chose, None for no other scenario.

        Where it cannot be written now it is, together with the next reply.
        """
        self._chosen = self._chosen if chosen is None else chosen
        record = Configured(scenario=self._chosen, seed=seed, scene_hash=scene_hash)
        self._unwritten = b"".join(_encoded(record))
        with suppress(OutputError):
            self._append(())

    def answered(
        self,
        request: Render | State,
        state_hash: str,
        bodies: dict[str, SentPose],
        images: tuple[CameraImage, ...],
        planes: Planes,
    ) -> None:
        """Record a reply before it is sent; raises BadMessageError where it must not be sent."""
        record = Answered(
            request=request,
            state_hash=state_hash,
            bodies=bodies,
            images=images,
            plane_hashes=tuple(map(plane_hash, planes)),
        )
        try:
            self._append(_encoded(record, planes if self._with_images else ()))
        except OutputError as error:
            code, problem = ErrorCode.NOT_RECORDED, f"the images are not recorded: {error}"
            raise BadMessageError(code, "", problem, request.id, retryable=True) from None

    def _append(self, parts: Sequence[bytes | memoryview]) -> None:
        try:
            self._write([self._unwritten, *parts])
        except OSError as error:
            problem = f"{self.path}: cannot be written ({error.strerror})"
            self._log(problem, "records not written")
            raise OutputError(problem) from None
        self._unwritten = b""

    def _write(self, parts: Sequence[bytes | memoryview]) -> None:
        """Append all parts, or nothing."""
        assert self._file is not None
        start = self._size
        try:
            # What an earlier failure may have left beyond this is written over.
            self._file.seek(start)
            for part in parts:
                rest = memoryview(part)
                while rest.nbytes:
                    rest = rest[self._file.write(rest) :]
        except OSError:
            with suppress(OSError):
                self._file.truncate(start)
            raise
        self._size = self._file.tell()

    def close(self) -> None:
        """Synchronise the file with the disk and close it."""
        if self._file is not None:
            try:
                with self._file:
                    os.fsync(self._file.fileno())
            except OSError as error:
                self._log(f"{self.path}: may not be on the disk ({error.strerror})")
            self._file = None
        self._log.close()


def _encoded(record: Message, planes: Planes = ()) -> list[bytes | memoryview]:
    header = _ENCODER.encode(record)
    lengths = _LENGTHS.pack(len(header), sum(plane.nbytes for plane in planes))
    checksum = zlib.crc32(header, zlib.crc32(lengths))
    for plane in planes:
        checksum = zlib.crc32(plane, checksum)
    return [lengths + _CHECKSUM.pack(checksum), header, *planes]


def is_session(path: Path) -> bool:
    """Whether a file is a recorded session of any version; AssetError where it cannot be read."""
    return _magic_of(path).startswith(_NAME)


def _magic_of(path: Path) -> bytes:
    try:
        if not path.is_file():
            raise AssetError(f"{path}: there is no such file")
        with path.open("rb") as file:
            return file.read(len(MAGIC))
    except OSError as error:
        raise AssetError(f"{path}: cannot be read ({error.strerror})") from None


class SessionFile:
    """Reads the records of a session.

    opened : what was served
    ignored : bytes at the end that are no whole record; known once all records were read

    Raises AssetError where the file cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.ignored = 0
        magic = _magic_of(path)
        if magic != MAGIC:
            other = magic.startswith(_NAME)
            problem = "has another version, or is damaged" if other else "is not a recorded session"
            raise AssetError(f"{path}: {problem}")
        first = next(self.records(), None)
        if first is None or not isinstance(first[0], Opened):
            raise AssetError(f"{path}: does not say what was served; nothing was recorded")
        self.opened = first[0]

    def records(self) -> Iterator[tuple[Message, bytes]]:
        """The records in order, each with its planes.

        Raises AssetError at a record that is damaged, after those before it.
        """
        try:
            with self.path.open("rb") as file:
                size = os.fstat(file.fileno()).st_size
                file.seek(len(MAGIC))
                while (start := file.tell()) < size:
                    record = self._next(file, size)
                    if record is None:
                        self.ignored = size - start
                        return
                    yield record
        except OSError as error:
            raise AssetError(f"{self.path}: cannot be read ({error.strerror})") from None

    def _next(self, file: BinaryIO, size: int) -> tuple[Message, bytes] | None:
        """The next record; None where the file ends within it."""
        start = file.tell()
        head = file.read(_LENGTHS.size + _CHECKSUM.size)
        # Zeros are left where a disk lost power before it had the content.
        if len(head) < _LENGTHS.size + _CHECKSUM.size or not any(head):
            return None
        header_size, planes_size = _LENGTHS.unpack_from(head)
        end = file.tell() + header_size + planes_size
        if end > size:
            return None
        header, planes = file.read(header_size), file.read(planes_size)
        checksum = zlib.crc32(planes, zlib.crc32(header, zlib.crc32(head[: _LENGTHS.size])))
        try:
            if head[_LENGTHS.size :] != _CHECKSUM.pack(checksum):
                raise ValueError("its checksum is that of other bytes")
            return _DECODER.decode(header), planes
        except (ValueError, RecursionError) as error:
            if end == size:
                return None
            raise AssetError(
                f"{self.path}: the record at byte {start} is damaged ({error})"
            ) from None
