"""Addresses that a server may bind: of this machine only, unless clients need keys."""

from __future__ import annotations

import re
import socket
import stat
from pathlib import Path

from simgl.errors import ConfigError

DEFAULT_ADDRESS = "tcp://127.0.0.1:5563"
# Where programs that use Basilisk look for their image source.
DEFAULT_BASILISK_ADDRESS = "tcp://127.0.0.1:5556"

_TCP = re.compile(r"tcp://([A-Za-z0-9.-]+|\*|\[[0-9A-Fa-f:.]+\]):(\d{1,5}|\*)")
_LOOPBACK = re.compile(r"127\.\d{1,3}\.\d{1,3}\.\d{1,3}|localhost|\[::1\]")
_ALLOWED = "must be tcp://127.0.0.1:PORT or ipc://PATH"


def check_bindable(
    address: str, *, remote_allowed: bool = False, option: str = "--address"
) -> None:
    """Raises ConfigError for an address that is malformed or open to strangers.

    remote_allowed : clients need a key, or the user allows any client
    option : name of the command-line option, for the error
    """
    if address.startswith("ipc://"):
        _check_ipc(address, option)
        return
    match = _TCP.fullmatch(address)
    if match is None:
        raise _refused(address, "it has not this form", option)
    if match[2] != "*" and int(match[2]) > 65535:
        raise _refused(address, "a port is at most 65535", option)
    if not remote_allowed and not _LOOPBACK.fullmatch(match[1]):
        reason = "beyond this machine it needs --keys and --allow, or --insecure"
        if option == "--basilisk":
            reason = "Basilisk's protocol has no keys, so it stays on this machine"
        raise _refused(address, reason, option)


def is_loopback(address: str) -> bool:
    """Whether a TCP address is reachable from this machine only."""
    match = _TCP.fullmatch(address)
    return match is not None and _LOOPBACK.fullmatch(match[1]) is not None


def is_ipv6(address: str) -> bool:
    """Whether an address has an IPv6 host, such as ``tcp://[::1]:5563``."""
    return address.startswith("tcp://[")


def ipc_path(address: str) -> Path | None:
    """The socket file of an ipc address; None for tcp, and for Linux's abstract names (``@``)."""
    name = address.removeprefix("ipc://")
    return Path(name) if name != address and not name.startswith("@") else None


def is_listening(path: Path) -> bool:
    """Whether a process listens at a socket file; a process that died leaves its file."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        # A full queue means that a process listens, too.
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except (ConnectionRefusedError, FileNotFoundError):
            return False
        except BlockingIOError:
            return True
    return True


def _check_ipc(address: str, option: str) -> None:
    path = ipc_path(address)
    if path is None:
        raise _refused(address, "an abstract name has no file permissions", option)
    if path == Path("*"):
        raise _refused(address, "a socket needs a name of its own", option)
    # ZeroMQ removes any file at the path before it binds.
    if path.exists() and not stat.S_ISSOCK(path.stat().st_mode):
        raise _refused(address, "something other than a socket is there", option)
    if not path.parent.is_dir():
        raise _refused(address, "its folder does not exist", option)
    if len(str(path).encode()) > 107:
        raise _refused(address, "the path is longer than 107 bytes, the most for a socket", option)


def _refused(address: str, reason: str, option: str) -> ConfigError:
    return ConfigError("simgl serve", option, f'{_ALLOWED}, got "{address}": {reason}')
