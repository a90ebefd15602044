"""Where the page may be bound, and who may see it: this machine alone, unless there is a token."""

from __future__ import annotations

import hmac
import ipaddress
import os
import re
import secrets
import stat
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from simgl.errors import ConfigError

DEFAULT_WEB_ADDRESS = "127.0.0.1:5580"

_ADDRESS = re.compile(r"(?P<host>[A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\]):(?P<port>\d{1,5}|\*)")
_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,200}")


@dataclass(frozen=True, kw_only=True)
class WebAccess:
    """Where a page is bound and what opens it.

    host : name or number, without brackets
    port : 0 takes a free one
    token : that browsers must show; None on loopback lets every user of this machine in
    """

    host: str
    port: int
    token: str | None = None

    def admits(self, shown: str | None) -> bool:
        """Whether a token opens the page; takes equally long for every wrong one."""
        if self.token is None:
            return True
        return shown is not None and hmac.compare_digest(shown.encode(), self.token.encode())

    def is_named(self, host_header: str) -> bool:
        """Whether a browser meant this server: without a token only names of loopback count.

        A page of a stranger could otherwise have its own name resolved to this machine.
        """
        if self.token is not None:
            return True
        return is_loopback(_host_of(host_header))


def web_access(address: str, token_file: Path | None) -> WebAccess:
    """Check an address HOST:PORT and read the token.

    A token file that does not exist is written, with a token of its own and mode 0600.

    Raises ConfigError for an address that is malformed, or open to other machines without a token,
    for a token file that is none or that other users can read, and where Tornado is missing.
    """
    if find_spec("tornado") is None:
        raise ConfigError("command line", "--web", 'needs Tornado: pip install "simgl[web]"')
    match = _ADDRESS.fullmatch(address)
    if match is None or (match["port"] != "*" and int(match["port"]) > 65535):
        problem = f'must be HOST:PORT, such as {DEFAULT_WEB_ADDRESS}, got "{address:.80}"'
        raise ConfigError("command line", "--web-address", problem)
    token = None if token_file is None else _token(token_file)
    host = match["host"].strip("[]")
    if token is None and not is_loopback(host):
        problem = f'"{address}" is open to other machines: needs --web-token FILE'
        raise ConfigError("command line", "--web-address", problem)
    port = 0 if match["port"] == "*" else int(match["port"])
    return WebAccess(host=host, port=port, token=token)


def is_loopback(host: str) -> bool:
    """Whether a host is this machine, by number or by the name localhost."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def _host_of(header: str) -> str:
    """The host of a header HOST or HOST:PORT, without brackets."""
    match = re.fullmatch(r"\[([^\]]*)\](?::\d+)?|([^:]*)(?::\d+)?", header)
    return "" if match is None else match[1] or match[2] or ""


def _token(path: Path) -> str:
    if not path.exists():
        _write_token(path)
    try:
        mode = path.stat().st_mode
        text = path.read_text(encoding="ascii").strip()
    except (OSError, ValueError) as error:
        raise _refused(path, f"cannot be read ({error})") from None
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise _refused(path, f"can be read by other users; chmod 600 {path}")
    if _TOKEN.fullmatch(text) is None:
        raise _refused(path, "must hold 16 to 200 letters, digits, - or _")
    return text


def _write_token(path: Path) -> None:
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    try:
        with os.fdopen(os.open(path, flags, 0o600), "w") as file:
            file.write(secrets.token_urlsafe(24) + "\n")
    except OSError as error:
        raise _refused(path, f"cannot be written ({error.strerror})") from None


def _refused(path: Path, problem: str) -> ConfigError:
    return ConfigError(str(path), "--web-token", problem)
