"""Access control: CURVE keys and the server's list of clients.

A pair of keys is two files, ``NAME.key`` (public) and ``NAME.key_secret`` (mode 0600), in the
format of ZeroMQ's own tools. A secret key that other users can read, and a key that they can
replace, is refused wherever it is used.
"""

from __future__ import annotations

import errno
import os
import re
import shlex
import stat
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zmq
from zmq.auth import create_certificates, load_certificate
from zmq.auth.thread import ThreadAuthenticator

from simgl.errors import AssetError, BridgeError, ConfigError, OutputError
from simgl.input_files import read_file
from simgl_bridge.bind_address import check_bindable, ipc_path, is_ipv6, is_listening

_DOMAIN = b"simgl"
# A key file has 300 bytes.
_MAX_KEY_BYTES = 1 << 16
# 32 bytes in ZeroMQ's Z85.
_KEY = re.compile(rb"[0-9A-Za-z.:+=^!/*?&<>()\[\]{}@%$#-]{40}")


@dataclass(frozen=True, kw_only=True)
class Access:
    """Who may connect to a server; by default any program of this machine.

    secret : the server's own ``.key_secret`` file; clients then need a key
    allowed : folder with the ``.key`` files of the clients that may connect
    insecure : accept any client from any machine
    """

    secret: Path | None = None
    allowed: Path | None = None
    insecure: bool = False

    def __post_init__(self) -> None:
        if self.secret is not None and self.allowed is None:
            raise ConfigError("simgl serve", "--keys", "requires --allow, the keys of the clients")
        if self.allowed is not None and self.secret is None:
            raise ConfigError("simgl serve", "--allow", "requires --keys, the key of the server")
        if self.insecure and self.secret is not None:
            raise ConfigError("simgl serve", "--insecure", "contradicts --keys")
        if self.secret is not None:
            _pair(self.secret)
        if self.allowed is not None:
            listed = sorted(self.allowed.glob("*.key"))
            if not listed:
                problem = f"must be a folder with the .key files of clients, got {self.allowed}"
                raise ConfigError("simgl serve", "--allow", problem)
            _check_not_replaceable(self.allowed)
            # One unreadable file would make ZeroMQ refuse every client.
            for path in listed:
                _keys_in(path)

    @property
    def allows_remote(self) -> bool:
        """Whether an address that other machines reach may be bound."""
        return self.insecure or self.secret is not None

    def start_authenticator(self, context: zmq.Context[Any]) -> ThreadAuthenticator | None:
        """Check keys of the clients of a context, if the server has keys.

        Call it before any socket is bound.
        """
        if self.secret is None:
            return None
        authenticator = ThreadAuthenticator(context)
        authenticator.start()
        authenticator.configure_curve(domain=_DOMAIN.decode(), location=str(self.allowed))
        return authenticator

    def apply(self, socket: zmq.Socket[Any]) -> None:
        """Make a socket require keys, if the server has some."""
        if self.secret is None:
            return
        public, secret = _pair(self.secret)
        socket.setsockopt(zmq.CURVE_SERVER, 1)
        socket.setsockopt(zmq.CURVE_PUBLICKEY, public)
        socket.setsockopt(zmq.CURVE_SECRETKEY, secret)
        socket.setsockopt(zmq.ZAP_DOMAIN, _DOMAIN)


ANY_LOCAL = Access()


@dataclass(frozen=True, kw_only=True)
class ClientKeys:
    """Keys of a client, for a server that requires them.

    secret : the client's own ``.key_secret`` file
    server : the server's ``.key`` file
    """

    secret: Path
    server: Path

    def apply(self, socket: zmq.Socket[Any]) -> None:
        """Give a socket the keys; raises ConfigError where a file holds none.

        socket : of the client, before it connects
        """
        public, secret = _pair(self.secret)
        socket.setsockopt(zmq.CURVE_PUBLICKEY, public)
        socket.setsockopt(zmq.CURVE_SECRETKEY, secret)
        socket.setsockopt(zmq.CURVE_SERVERKEY, _keys_in(self.server)[0])


def _keys_in(path: Path) -> tuple[bytes, bytes | None]:
    """The public and the secret key in a file; None where it holds no secret one.

    Raises ConfigError where it holds none, or other users can read or replace what must be safe
    from them.
    """
    try:
        # Only a regular file: ZeroMQ's own reader would wait for a pipe for ever.
        read_file(path, _MAX_KEY_BYTES)
        # Of the file itself, where the path is a link.
        status = path.stat()
        public, secret = load_certificate(path)
    except AssetError as error:
        problem = str(error).removeprefix(f"{path}: ")
        raise ConfigError(str(path), "", problem) from None
    except (OSError, ValueError):
        raise ConfigError(str(path), "", "is not a key file; simgl keys makes them") from None
    for key in (public, secret):
        if key is not None and not _KEY.fullmatch(key):
            raise ConfigError(str(path), "", "holds a key that is cut off or damaged")
    if secret is not None and status.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        problem = (
            f"has mode {_octal(status)}: its secret key is open to other users; "
            f"chmod 600 {shlex.quote(str(path))}"
        )
        raise ConfigError(str(path), "", problem)
    _check_not_replaceable(path)
    for folder in dict.fromkeys((path.parent, path.resolve().parent)):
        # In a folder such as /tmp (sticky), only its owner replaces a file.
        if not folder.stat().st_mode & stat.S_ISVTX:
            _check_not_replaceable(folder)
    return public, secret


def _check_not_replaceable(path: Path) -> None:
    """Raises ConfigError where any user may write to a key file, or to a folder of keys."""
    status = path.stat()
    if status.st_mode & stat.S_IWOTH:
        problem = (
            f"has mode {_octal(status)}: any user can replace its keys; "
            f"chmod o-w {shlex.quote(str(path))}"
        )
        raise ConfigError(str(path), "", problem)


def _octal(status: os.stat_result) -> str:
    return f"{stat.S_IMODE(status.st_mode):04o}"


def _pair(path: Path) -> tuple[bytes, bytes]:
    public, secret = _keys_in(path)
    if secret is None:
        problem = "holds no secret key; the secret one ends in .key_secret"
        raise ConfigError(str(path), "", problem)
    return public, secret


def make_keys(name: str, folder: Path) -> tuple[Path, Path]:
    """Make a pair of keys; returns the public and the secret file.

    Raises ConfigError rather than replace a file, and OutputError where none can be written.
    """
    if not name or not name.replace("-", "").replace("_", "").isalnum():
        problem = f'must be letters, digits, "-" and "_", got "{name}"'
        raise ConfigError("simgl keys", "NAME", problem)
    public, secret = folder / f"{name}.key", folder / f"{name}.key_secret"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # ZeroMQ writes with the mode that is usual, so it writes into a folder of this user alone.
        with ExitStack() as undo, tempfile.TemporaryDirectory(prefix=".", dir=folder) as private:
            create_certificates(private, name)
            for path, mode in ((secret, 0o600), (public, 0o644)):
                # With its mode from the start, and never through a link that stands there.
                handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
                undo.callback(path.unlink, missing_ok=True)
                with os.fdopen(handle, "wb") as file:
                    os.fchmod(handle, mode)
                    file.write((Path(private) / path.name).read_bytes())
            undo.pop_all()
    except OSError as error:
        if isinstance(error, FileExistsError) and Path(error.filename) in (public, secret):
            raise ConfigError("simgl keys", "NAME", f"would replace {error.filename}") from None
        raise OutputError(f"{folder}: cannot be written ({error.strerror})") from None
    return public, secret


@contextmanager
def _umask(mask: int) -> Iterator[None]:
    previous = os.umask(mask)
    try:
        yield
    finally:
        os.umask(previous)


def reason(error: zmq.ZMQError) -> str:
    """The text of a ZeroMQ error, without the address that it may add."""
    return zmq.strerror(error.errno or 0)


def bind(socket: zmq.Socket[Any], address: str, access: Access, option: str = "--address") -> str:
    """Bind a socket with access control; returns the address with the port in use.

    Raises ConfigError for an address open to strangers and BridgeError where it cannot be bound.
    """
    check_bindable(address, remote_allowed=access.allows_remote, option=option)
    access.apply(socket)
    if is_ipv6(address):
        socket.setsockopt(zmq.IPV6, 1)
    path = ipc_path(address)
    # ZeroMQ would silently replace a server that listens there.
    if path is not None and is_listening(path):
        raise BridgeError(f"{address}: cannot be bound ({os.strerror(errno.EADDRINUSE)})")
    try:
        # The socket file is accessible to its user only, from the start.
        with _umask(0o177):
            socket.bind(address)
    except zmq.ZMQError as error:
        raise BridgeError(f"{address}: cannot be bound ({reason(error)})") from None
    return str(socket.get_string(zmq.LAST_ENDPOINT))
