"""Messages between a server and its renderer: one datagram each, large frames in shared memory.

A plane is copied once, into memory that both processes see, and ZeroMQ sends it from there. Memory
is used again once nobody reads it: new memory costs more time than the copy.
"""

from __future__ import annotations

import mmap
import os
import socket
import weakref
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import accumulate, pairwise

import msgspec
import numpy as np

from simgl.errors import BridgeError
from simgl_bridge.client_sessions import Frames

# Longer messages go through shared memory; this fits into the send buffer of any socket.
_INLINE = 64 * 1024
_LONGEST_DATAGRAM = 2 * _INLINE
# Memory that waits to be used again is at most this many times as large as the last message.
_MAX_FREE = 2
# Memory this many times larger than a message is left to larger ones.
_MAX_WASTE = 4


class _Head(msgspec.Struct, frozen=True, array_like=True):
    """What comes before the frames in a datagram.

    sizes : of the frames [bytes]
    memory : number of the sender's memory that holds them; None where they follow
    free : numbers of the receiver's memory that the sender no longer reads
    unmapped : those that the sender had no memory for
    """

    sizes: tuple[int, ...]
    memory: int | None
    free: tuple[int, ...]
    unmapped: tuple[int, ...]


_ENCODER = msgspec.msgpack.Encoder()
_DECODER = msgspec.msgpack.Decoder(_Head)
_LENGTH = 4


class Connection:
    """One end of the connection. Messages arrive in order, whole or not at all.

    end : of a pair of sockets, as ``socket_pair`` makes it

    is_cut : the other end was closed, and everything that it sent was received
    """

    def __init__(self, end: socket.socket) -> None:
        self._socket = end
        self._sent = _SentMemory()
        self._received: dict[int, mmap.mmap] = {}
        # From whatever thread drops the last reference to frames.
        self._released: list[int] = []
        self._unmapped: list[int] = []
        self.is_cut = False

    def fileno(self) -> int:
        """For a poller."""
        return self._socket.fileno()

    def send(self, frames: Frames) -> None:
        """Send a message.

        Raises OSError where the other end is closed, or takes nothing, and BridgeError where there
        is no memory.
        """
        sizes = tuple(memoryview(frame).nbytes for frame in frames)
        if sum(sizes) <= _INLINE:
            self._send(sizes, None, frames, ())
            return
        number, descriptors = self._sent.place(frames, sum(sizes))
        try:
            self._send(sizes, number, (), descriptors)
        finally:
            for descriptor in descriptors:
                os.close(descriptor)

    def _send(
        self, sizes: tuple[int, ...], memory: int | None, frames: Frames, descriptors: Sequence[int]
    ) -> None:
        free = tuple(self._released)
        del self._released[: len(free)]
        unmapped, self._unmapped = tuple(self._unmapped), []
        head = _ENCODER.encode(_Head(sizes, memory, free, unmapped))
        content = [len(head).to_bytes(_LENGTH, "little"), head, *frames]
        socket.send_fds(self._socket, content, descriptors)

    def receive(self) -> list[memoryview]:
        """The frames of the next message, read-only.

        Empty where the other end is closed, and where nothing waits at a socket that does not.

        Raises BridgeError where there is no memory for the next message, which is lost.
        """
        try:
            datagram, descriptors, _, _ = socket.recv_fds(self._socket, _LONGEST_DATAGRAM, 1)
        except BlockingIOError:
            return []
        except ConnectionResetError:
            # The other end left without reading what it was sent; what it sent is still there.
            return self.receive()
        if not datagram:
            self.is_cut = True
            return []
        content = memoryview(datagram)
        start = _LENGTH + int.from_bytes(content[:_LENGTH], "little")
        head = _DECODER.decode(content[_LENGTH:start])
        self._sent.release(head.free)
        self._sent.drop(head.unmapped)
        if head.memory is None:
            return _slices(content[start:], head.sizes)
        if descriptors:
            self._map(head.memory, descriptors[0])
        # Frames refer to the array, and the array to the memory.
        array = np.frombuffer(self._received[head.memory], np.uint8, sum(head.sizes))
        weakref.finalize(array, self._released.append, head.memory)
        return _slices(array.data, head.sizes)

    def _map(self, number: int, descriptor: int) -> None:
        try:
            with _memory_errors():
                self._received[number] = mmap.mmap(descriptor, 0, prot=mmap.PROT_READ)
        except BridgeError:
            self._unmapped.append(number)
            raise
        finally:
            os.close(descriptor)

    def close(self) -> None:
        """Hang up; frames that were received stay valid."""
        self._socket.close()


def socket_pair() -> tuple[socket.socket, socket.socket]:
    """Both ends; the first does not wait. Raises BridgeError."""
    try:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    except OSError as error:
        raise BridgeError(f"the renderer cannot be connected ({error.strerror})") from None
    ours.setblocking(False)
    return ours, theirs


class _SentMemory:
    """Memory for the messages of one end, by number."""

    def __init__(self) -> None:
        self._memory: dict[int, mmap.mmap] = {}
        self._free: set[int] = set()

    def release(self, numbers: Sequence[int]) -> None:
        """The other end no longer reads these."""
        self._free.update(numbers)

    def drop(self, numbers: Sequence[int]) -> None:
        """The other end cannot read these."""
        for number in numbers:
            del self._memory[number]

    def place(self, frames: Frames, size: int) -> tuple[int, Sequence[int]]:
        """Copy frames to memory: its number and, the first time only, its file descriptor."""
        fitting = [n for n in self._free if size <= len(self._memory[n]) <= _MAX_WASTE * size]
        descriptors = []
        if fitting:
            number = fitting[0]
            self._free.remove(number)
        else:
            number = next(n for n in range(len(self._memory) + 1) if n not in self._memory)
            with _memory_errors():
                descriptor = os.memfd_create("simgl-frames")
                try:
                    os.ftruncate(descriptor, size)
                    self._memory[number] = mmap.mmap(descriptor, size)
                except OSError:
                    os.close(descriptor)
                    raise
            descriptors.append(descriptor)
        while sum(len(self._memory[n]) for n in self._free) > _MAX_FREE * size:
            # The other end still has it mapped: its pages go at once.
            self._memory.pop(self._free.pop()).madvise(mmap.MADV_REMOVE)
        memory, start = memoryview(self._memory[number]), 0
        for frame in frames:
            content = memoryview(frame).cast("B")
            memory[start : start + content.nbytes] = content
            start += content.nbytes
        return number, descriptors


@contextmanager
def _memory_errors() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        problem = f"there is no memory for the images ({error.strerror})"
        raise BridgeError(problem) from None


def _slices(content: memoryview, sizes: Sequence[int]) -> list[memoryview]:
    return [content[a:b] for a, b in pairwise(accumulate(sizes, initial=0))]
