"""Who may connect: CURVE keys, the server's list of clients, and how sockets get them.

A pair of keys is two files, ``NAME.key`` (public, to hand out) and ``NAME.key_secret`` (mode 0600),
in the format of ZeroMQ's own tools.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zmq
from zmq.auth import create_certificates, load_certificate
from zmq.auth.thread import ThreadAuthenticator

from simgl.errors import BridgeError, ConfigError
from simgl_bridge.address import check_bindable, ipc_path

_DOMAIN = b"simgl"


@dataclass(frozen=True, kw_only=True)
class Access:
    """Who may connect to a server; by default any program of this machine.

    secret : the server's own ``.key_secret`` file; clients then need a key
    allowed : folder with the ``.key`` files of the clients that may come
    insecure : let anybody in, from anywhere
    """

    secret: Path | None = None
    allowed: Path | None = None
    insecure: bool = False

    def __post_init__(self) -> None:
        if (self.secret is None) != (self.allowed is None):
            problem = "goes together with --allow: a key of the server, and the keys of its clients"
            raise ConfigError("simgl serve", "--keys", problem)
        if self.insecure and self.secret is not None:
            raise ConfigError("simgl serve", "--insecure", "contradicts --keys")
        if self.secret is not None:
            _pair(self.secret)
        if self.allowed is not None and not any(self.allowed.glob("*.key")):
            problem = f"must be a folder with the .key files of clients, got {self.allowed}"
            raise ConfigError("simgl serve", "--allow", problem)

    @property
    def guarded(self) -> bool:
        """Whether an address beyond this machine may be bound."""
        return self.insecure or self.secret is not None

    def guard(self, context: zmq.Context[Any]) -> ThreadAuthenticator | None:
        """Start the doorkeeper of a context, before any socket is bound; None where none is due."""
        if self.secret is None:
            return None
        doorkeeper = ThreadAuthenticator(context)
        doorkeeper.start()
        doorkeeper.configure_curve(domain=_DOMAIN.decode(), location=str(self.allowed))
        return doorkeeper

    def apply(self, socket: zmq.Socket[Any]) -> None:
        """Make a socket one that asks for keys, if they are asked for."""
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
    """What a client needs for a server that asks for keys.

    secret : the client's own ``.key_secret`` file
    server : the server's ``.key`` file
    """

    secret: Path
    server: Path

    def apply(self, socket: zmq.Socket[Any]) -> None:
        """Give a socket the keys; raises ConfigError where a file holds none."""
        public, secret = _pair(self.secret)
        socket.setsockopt(zmq.CURVE_PUBLICKEY, public)
        socket.setsockopt(zmq.CURVE_SECRETKEY, secret)
        socket.setsockopt(zmq.CURVE_SERVERKEY, _keys_in(self.server)[0])


def _keys_in(path: Path) -> tuple[bytes, bytes | None]:
    try:
        return load_certificate(path)
    except (OSError, ValueError) as error:
        raise ConfigError(str(path), "", f"is no key file ({error})") from None


def _pair(path: Path) -> tuple[bytes, bytes]:
    public, secret = _keys_in(path)
    if secret is None:
        problem = "holds no secret key; the secret one ends in .key_secret"
        raise ConfigError(str(path), "", problem)
    return public, secret


def make_keys(name: str, folder: Path) -> tuple[Path, Path]:
    """Make a pair of keys; returns the public and the secret file.

    Raises ConfigError rather than replace a file.
    """
    if not name or not name.replace("-", "").replace("_", "").isalnum():
        problem = f'must be letters, digits, "-" and "_", got "{name}"'
        raise ConfigError("simgl keys", "NAME", problem)
    public, secret = folder / f"{name}.key", folder / f"{name}.key_secret"
    for path in (public, secret):
        if path.exists():
            raise ConfigError("simgl keys", "NAME", f"would replace {path}")
    folder.mkdir(parents=True, exist_ok=True)
    # Made unreadable for others, not made so afterwards.
    before = os.umask(0o077)
    try:
        create_certificates(folder, name)
    finally:
        os.umask(before)
    public.chmod(0o644)
    return public, secret


def bound(socket: zmq.Socket[Any], address: str, access: Access, option: str = "--address") -> str:
    """Bind a socket where and as it may be; returns the address with the port that was found.

    Raises ConfigError for an address open to strangers and BridgeError where it cannot be bound.
    """
    check_bindable(address, guarded=access.guarded, option=option)
    access.apply(socket)
    try:
        socket.bind(address)
    except zmq.ZMQError as error:
        raise BridgeError(f"{address}: cannot be bound ({error.strerror})") from None
    if path := ipc_path(address):
        path.chmod(0o600)
    return str(socket.get_string(zmq.LAST_ENDPOINT))
