"""A page is open to this machine, and to others by a token only."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from simgl.errors import ConfigError
from simgl.web.web_access import WebAccess, web_access


@pytest.mark.parametrize("address", ["127.0.0.1:5580", "localhost:80", "[::1]:5580", "127.9.9.9:*"])
def test_loopback_needs_no_token(address: str) -> None:
    assert web_access(address, None).token is None


@pytest.mark.parametrize("address", ["0.0.0.0:5580", "[::]:80", "192.168.1.2:*", "host:80"])
def test_other_addresses_need_a_token(address: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="open to other machines: needs --web-token FILE"):
        web_access(address, None)
    assert web_access(address, tmp_path / "token").token


@pytest.mark.parametrize("address", ["5580", "localhost", "localhost:", "localhost:65536", "a b:1"])
def test_a_malformed_address_is_named(address: str) -> None:
    with pytest.raises(ConfigError, match=f'--web-address must be HOST:PORT.*got "{address}"'):
        web_access(address, None)


def test_a_token_is_made_once_and_is_this_users_alone(tmp_path: Path) -> None:
    path = tmp_path / "token"
    first = web_access("0.0.0.0:80", path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert web_access("0.0.0.0:80", path) == first
    path.chmod(0o640)
    with pytest.raises(ConfigError, match="can be read by other users; chmod 600"):
        web_access("0.0.0.0:80", path)


def test_a_poor_token_and_an_impossible_file_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "token"
    path.write_text("short")
    path.chmod(0o600)
    with pytest.raises(ConfigError, match="must hold 16 to 200 letters"):
        web_access("0.0.0.0:80", path)
    with pytest.raises(ConfigError, match="--web-token cannot be written"):
        web_access("0.0.0.0:80", tmp_path / "none" / "token")


def test_without_a_token_only_names_of_this_machine_are_answered() -> None:
    access = WebAccess(host="127.0.0.1", port=1)
    named = {h: access.is_named(h) for h in ("localhost:1", "127.0.0.1", "[::1]:1", "evil.org:1")}
    assert named == {"localhost:1": True, "127.0.0.1": True, "[::1]:1": True, "evil.org:1": False}
