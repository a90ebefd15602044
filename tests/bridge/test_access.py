"""Who may come: keys and the server's list; everybody else is told at once, and gets nothing."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer
import zmq
from simgl_bridge import AccessError, Client, ClientKeys
from simgl_bridge.access import Access, make_keys
from simgl_bridge.client_call import Call
from simgl_bridge.client_protocol import ClientProtocol
from simgl_bridge.commands import keys
from simgl_bridge.messages import Ping, Pong
from typer.testing import CliRunner

from simgl import Scenario
from simgl.errors import BridgeError, ConfigError, OutputError
from tests.bridge.harness import Running
from tests.patience import limit

Starter = Callable[..., Running]


@dataclass
class Ring:
    """A folder of keys: the server's, a guest's, a stranger's; the guest is on the list."""

    folder: Path

    @property
    def access(self) -> Access:
        """The server's side."""
        return Access(secret=self.folder / "server.key_secret", allowed=self.folder / "allowed")

    def client(self, name: str, server: str = "server") -> ClientKeys:
        """A client's side."""
        return ClientKeys(
            secret=self.folder / f"{name}.key_secret", server=self.folder / f"{server}.key"
        )


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Ring:
    folder = tmp_path_factory.mktemp("keys")
    for name in ("server", "guest", "stranger"):
        make_keys(name, folder)
    (folder / "allowed").mkdir()
    (folder / "allowed" / "guest.key").write_bytes((folder / "guest.key").read_bytes())
    return Ring(folder)


@pytest.fixture
def guarded(start_server: Starter, scenario: Scenario, ring: Ring) -> Running:
    return start_server(scenario, access=ring.access)


def test_a_client_on_the_list_is_served(guarded: Running, ring: Ring, scenario: Scenario) -> None:
    with Client(guarded.address, timeout_s=limit(20.0), keys=ring.client("guest")) as client:
        assert client.render(scenario.epoch_tai_ns, "nav").dn.shape == (48, 64)


def test_anybody_else_is_told_at_once(guarded: Running, ring: Ring) -> None:
    wrong = {
        "a key that is not on the list": ring.client("stranger"),
        "another server's key": ring.client("guest", server="stranger"),
        "no key": None,
    }
    for what, given in wrong.items():
        start = time.monotonic()
        # Not at the deadline of 30 s
        with pytest.raises(AccessError, match="the server refused this client: its key") as caught:
            Client(guarded.address, timeout_s=limit(30.0), keys=given)
        assert time.monotonic() - start < limit(10.0), what
        assert str(caught.value).startswith(guarded.address)
    # And the guest is still welcome.
    with Client(guarded.address, timeout_s=limit(20.0), keys=ring.client("guest")) as client:
        assert client.ping() < limit(5.0)


def test_a_client_with_keys_gets_no_answer_from_a_server_without(
    running: Running, ring: Ring
) -> None:
    with pytest.raises(BridgeError):
        Client(running.address, timeout_s=2.0, keys=ring.client("guest"))


def test_beyond_this_machine_only_with_keys_or_on_purpose(
    start_server: Starter, scenario: Scenario
) -> None:
    # The refusal comes before anything is bound.
    with pytest.raises(ConfigError, match="needs --keys and --allow, or --insecure"):
        start_server(scenario, "tcp://0.0.0.0:*")


def test_halves_of_access_are_refused(ring: Ring, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--keys requires --allow"):
        Access(secret=ring.folder / "server.key_secret")
    with pytest.raises(ConfigError, match="--allow requires --keys"):
        Access(allowed=ring.folder)
    with pytest.raises(ConfigError, match="--insecure contradicts --keys"):
        Access(secret=ring.folder / "server.key_secret", allowed=ring.folder, insecure=True)
    with pytest.raises(ConfigError, match=r"--allow must be a folder with the \.key files"):
        Access(secret=ring.folder / "server.key_secret", allowed=tmp_path)
    with pytest.raises(ConfigError, match="holds no secret key"):
        Access(secret=ring.folder / "server.key", allowed=ring.folder / "allowed")
    with pytest.raises(ConfigError, match=r"absent: cannot be read \(No such file or directory\)"):
        Access(secret=tmp_path / "absent", allowed=ring.folder / "allowed")


def test_a_key_on_the_list_that_cannot_be_read_is_named(ring: Ring, tmp_path: Path) -> None:
    # One of them would shut every client out.
    (tmp_path / "guest.key").write_bytes((ring.folder / "guest.key").read_bytes())
    damaged = tmp_path / "old.key"
    good = (ring.folder / "stranger.key").read_text()
    for text, problem in (
        ("not a key\n", "is not a key file; simgl keys makes them"),
        (good.rstrip('"\n')[:-3] + '"\n', "holds a key that is cut off or damaged"),
    ):
        damaged.write_text(text)
        with pytest.raises(ConfigError) as caught:
            Access(secret=ring.folder / "server.key_secret", allowed=tmp_path)
        assert str(caught.value) == f"{damaged}: {problem}"


def test_keys_that_cannot_be_written_are_one_line(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(OutputError, match=r"taken: cannot be written \(File exists\)$"):
        make_keys("loop", tmp_path / "taken")


def test_keys_are_made_for_their_owner_alone_and_never_replaced(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(keys)
    result = CliRunner().invoke(app, ["loop", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    secret, public = tmp_path / "loop.key_secret", tmp_path / "loop.key"
    assert stat.S_IMODE(secret.stat().st_mode) == 0o600
    assert stat.S_IMODE(public.stat().st_mode) == 0o644
    before = secret.read_bytes()
    with pytest.raises(ConfigError, match="would replace"):
        make_keys("loop", tmp_path)
    assert secret.read_bytes() == before
    for name in ("../up", "", "a b"):
        with pytest.raises(ConfigError, match='must be letters, digits, "-" and "_"'):
            make_keys(name, tmp_path)


def test_a_secret_key_that_others_can_read_is_refused(ring: Ring, tmp_path: Path) -> None:
    copied = tmp_path / "my keys" / "server.key_secret"
    copied.parent.mkdir()
    copied.write_bytes((ring.folder / "server.key_secret").read_bytes())
    link = tmp_path / "link.key_secret"
    link.symlink_to(copied)
    for mode in (0o604, 0o640, 0o644, 0o660, 0o610, 0o777):
        copied.chmod(mode)
        for path, shown in ((copied, f"'{copied}'"), (link, str(link))):
            with pytest.raises(ConfigError) as caught:
                Access(secret=path, allowed=ring.folder / "allowed")
            assert str(caught.value) == (
                f"{path}: has mode {mode:04o}: its secret key is open to other users; "
                f"chmod 600 {shown}"
            )
            with pytest.raises(ConfigError, match=f"has mode {mode:04o}: its secret key"):
                Client(
                    "tcp://127.0.0.1:1",
                    keys=ClientKeys(secret=path, server=ring.folder / "server.key"),
                )
    for mode in (0o600, 0o400):
        copied.chmod(mode)
        for path in (copied, link):
            Access(secret=path, allowed=ring.folder / "allowed")


def test_a_secret_key_in_the_place_of_a_public_one_is_refused_too(
    ring: Ring, tmp_path: Path
) -> None:
    # Where it lies in the list of clients, or is handed out as the server's.
    secret = (ring.folder / "guest.key_secret").read_bytes()
    (tmp_path / "guest.key").write_bytes(secret)
    (tmp_path / "guest.key").chmod(0o644)
    with pytest.raises(ConfigError, match=r"guest\.key: has mode 0644: its secret key is open"):
        Access(secret=ring.folder / "server.key_secret", allowed=tmp_path)


def test_keys_that_any_user_can_replace_are_refused(ring: Ring, tmp_path: Path) -> None:
    allowed = tmp_path / "allowed"
    allowed.mkdir()
    guest = allowed / "guest.key"
    guest.write_bytes((ring.folder / "guest.key").read_bytes())
    own = ring.folder / "server.key_secret"
    guest.chmod(0o666)
    with pytest.raises(ConfigError, match=r"guest\.key: has mode 0666: any user .*; chmod o-w "):
        Access(secret=own, allowed=allowed)
    guest.chmod(0o644)
    # A user who cannot write over a file of somebody else's in /tmp can add one of his own.
    for mode in (0o777, 0o1777):
        allowed.chmod(mode)
        with pytest.raises(ConfigError, match=f"allowed: has mode {mode:04o}: any user can"):
            Access(secret=own, allowed=allowed)
    allowed.chmod(0o755)
    Access(secret=own, allowed=allowed)
    tmp_path.chmod(0o777)
    linked = tmp_path / "server.key_secret"
    linked.symlink_to(own)
    with pytest.raises(ConfigError, match=f"{tmp_path}: has mode 0777: any user can replace"):
        Access(secret=linked, allowed=allowed)
    tmp_path.chmod(0o1777)
    Access(secret=linked, allowed=allowed)


@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero"), Path.mkdir])
def test_a_key_file_that_is_no_file_is_refused_at_once(
    ring: Ring, tmp_path: Path, make: Callable[[Path], None]
) -> None:
    path = tmp_path / "odd.key_secret"
    make(path)
    with pytest.raises(ConfigError, match=r"odd\.key_secret: (is a|cannot be read)"):
        Access(secret=path, allowed=ring.folder / "allowed")


def test_a_new_secret_key_is_never_open_to_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    modes = []
    real = os.open

    def watched(path: str, flags: int, mode: int = 0o777, **options: int) -> int:
        handle = real(path, flags, mode, **options)
        if str(path).endswith("loop.key_secret"):
            modes.append((stat.S_IMODE(os.fstat(handle).st_mode), flags & os.O_EXCL))
        return handle

    monkeypatch.setattr(os, "open", watched)
    before = os.umask(0)
    try:
        make_keys("loop", tmp_path)
    finally:
        os.umask(before)
    assert modes == [(0o600, os.O_EXCL)]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["loop.key", "loop.key_secret"]


def test_new_keys_follow_no_link_and_leave_no_half(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    for kept, link in (("loop.key", "loop.key_secret"), ("loop.key_secret", "loop.key")):
        (tmp_path / link).symlink_to(elsewhere)
        with pytest.raises(ConfigError, match=f"would replace {tmp_path / link}"):
            make_keys("loop", tmp_path)
        assert not elsewhere.exists()
        assert not (tmp_path / kept).exists()
        (tmp_path / link).unlink()


def test_a_server_that_ends_in_the_middle_of_a_handshake_is_not_taken_for_a_refusal() -> None:
    protocol = ClientProtocol("tcp://127.0.0.1:1")

    def error_after(event: int) -> BridgeError | None:
        call = Call(Ping(id=1), Pong, 10.0)
        protocol.open(call)
        assert not protocol.handle_event(event)
        protocol.close(call)
        return call.error

    assert isinstance(error_after(zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL), AccessError)
    # To a client that was admitted before, as when a server is stopped and started again.
    assert not protocol.handle_event(zmq.EVENT_HANDSHAKE_SUCCEEDED)
    assert protocol.handle_event(zmq.EVENT_DISCONNECTED)
    assert error_after(zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL) is None
    assert isinstance(error_after(zmq.EVENT_HANDSHAKE_FAILED_AUTH), AccessError)
