"""Where a server may listen: this machine only, for the link has no authentication yet."""

from __future__ import annotations

import re
import stat
from pathlib import Path

from simgl.errors import ConfigError

DEFAULT_ADDRESS = "tcp://127.0.0.1:5563"

_LOOPBACK = re.compile(r"tcp://(?:127\.\d{1,3}\.\d{1,3}\.\d{1,3}|localhost):(\d{1,5}|\*)")
_ALLOWED = "must be tcp://127.0.0.1:PORT or ipc://PATH"


def check_bindable(address: str) -> None:
    """Raises ConfigError for an address that is malformed or reaches beyond this machine."""
    if address.startswith("ipc://"):
        _check_ipc(address)
        return
    match = _LOOPBACK.fullmatch(address)
    if match is None:
        reason = "the link has no authentication yet and stays on this machine"
        raise _refused(address, reason)
    if match[1] != "*" and int(match[1]) > 65535:
        raise _refused(address, "a port is at most 65535")


def ipc_path(address: str) -> Path | None:
    """The socket file of an ipc address; None for tcp, and for Linux's abstract names (``@``)."""
    name = address.removeprefix("ipc://")
    return Path(name) if name != address and not name.startswith("@") else None


def _check_ipc(address: str) -> None:
    path = ipc_path(address)
    if path is None:
        raise _refused(address, "an abstract name has no file permissions")
    # ZeroMQ removes whatever stands at the path before it binds.
    if path.exists() and not stat.S_ISSOCK(path.stat().st_mode):
        raise _refused(address, "something that is no socket stands there")
    if not path.parent.is_dir():
        raise _refused(address, "its folder does not exist")
    if len(str(path).encode()) > 107:
        raise _refused(address, "the path is longer than 107 bytes, the most for a socket")


def _refused(address: str, reason: str) -> ConfigError:
    return ConfigError("simgl serve", "--address", f'{_ALLOWED}, got "{address}": {reason}')
