"""The page's server: who is let in, what is dropped, and that nobody makes it wait."""

from __future__ import annotations

import json
import re
import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files
from pathlib import Path

import pytest

from simgl.errors import ConfigError
from simgl.web.page_server import PageServer
from simgl.web.snapshots import NewestSnapshot
from simgl.web.viewers import MAX_VIEWERS
from simgl.web.web_access import WebAccess, web_access
from tests.patience import limit, wait_until
from tests.web.harness import Socket, got, next_jpeg, shown, snapshot, stream

Shown = tuple[NewestSnapshot, PageServer]


@pytest.fixture
def page() -> Iterator[Shown]:
    newest, server = shown()
    with server:
        yield newest, server


@pytest.mark.parametrize("name", ["", "style.css", "view.js", "scene3d.js"])
def test_the_page_names_no_address_elsewhere(page: Shown, name: str) -> None:
    status, content = got(page[1], f"/{name}")
    assert status == 200
    assert not re.search(rb"https?://|@import|//cdn", content)
    assert content == (files("simgl.web") / "page" / (name or "index.html")).read_bytes()


def test_a_pixel_is_answered_and_nonsense_refused(page: Shown) -> None:
    newest, server = page
    status, content = got(server, "/pixel.json?camera=nav&x=3&y=5")
    dn = newest.newest()[1].images["nav"].planes["dn"]  # type: ignore[union-attr]
    assert (status, json.loads(content)["dn"]) == (200, int(dn[5, 3]))
    wrong = ["camera=nav&x=a&y=1", "camera=nav&x=99&y=1", "camera=none&x=1&y=1", ""]
    assert [got(server, f"/pixel.json?{query}")[0] for query in wrong] == [400, 404, 404, 400]
    others = ["/model/none", "/stream/none.mjpg", "/../pyproject.toml", "/view.py"]
    assert {got(server, path)[0] for path in others} == {404}


def test_a_page_of_a_stranger_gets_nothing(page: Shown) -> None:
    server = page[1]
    assert got(server, "/scenario.json", Host="evil.org")[0] == 403
    link = Socket(server, origin="http://evil.org")
    assert link.status == 403
    link.close()


def test_a_token_opens_the_page_and_nothing_else_does(tmp_path: Path) -> None:
    _, server = shown(web_access("127.0.0.1:*", tmp_path / "token"))
    with server:
        token = server.url.partition("token=")[2]
        paths = ("/", "/scenario.json", "/pixel.json", "/stream/nav.mjpg", "/model/box", "/view")
        assert {got(server, path)[0] for path in paths} == {401}
        other = token[:-1] + ("y" if token.endswith("x") else "x")
        assert got(server, f"/scenario.json?token={other}")[0] == 401
        assert got(server, f"/scenario.json?token={token}")[0] == 200
        cookie = f"simgl_{server.port}={token}"
        assert got(server, "/", Cookie=cookie)[0] == 200
        without, with_token = Socket(server), Socket(server, path=f"/view?token={token}")
        assert (without.status, with_token.status) == (401, 101)
        without.close()
        with_token.close()


def test_an_address_that_is_taken_is_named(page: Shown) -> None:
    newest, server = page
    with pytest.raises(ConfigError, match=f"127.0.0.1:{server.port} cannot be bound"):
        PageServer(newest, WebAccess(host="127.0.0.1", port=server.port))


def test_a_stream_gets_the_newest_image_and_drops_the_rest(page: Shown) -> None:
    newest, server = page
    link, buffer = stream(server, "/stream/nav.mjpg"), bytearray()
    first = next_jpeg(link, buffer)
    for value in range(20, 60):
        newest.publish(snapshot(newest, value))
    last = newest.newest()[0]
    seen = [next_jpeg(link, buffer)]
    link.settimeout(0.5)
    try:
        while True:
            seen.append(next_jpeg(link, buffer))
    except TimeoutError:
        link.close()
    assert last == 41
    assert first not in seen
    assert len(seen) < 40
    # The last one is the newest.
    assert seen[-1] == got_image(server)


def got_image(server: PageServer) -> bytes:
    link = stream(server, "/stream/nav.mjpg")
    image = next_jpeg(link, bytearray())
    link.close()
    return image


def test_a_page_gets_the_next_image_only_when_it_is_ready(page: Shown) -> None:
    newest, server = page
    link = Socket(server)
    link.send('{"type": "watch", "camera": "nav", "show": "dn"}')
    opcode, content = link.receive()
    assert (opcode, json.loads(content)["number"]) == (1, 1)
    assert link.receive()[0] == 2
    for value in range(100, 110):
        newest.publish(snapshot(newest, value))
    link.send('{"type": "ready"}')
    assert json.loads(link.receive()[1])["number"] == 11
    link.close()


@pytest.mark.parametrize("message", ["[]", "{", '{"no": 1}', "[" * 4000, "null", '"text"'])
def test_a_message_that_is_none_ends_its_connection_alone(page: Shown, message: str) -> None:
    server = page[1]
    link = Socket(server)
    link.send(message)
    while (answer := link.receive())[0] != 8:
        assert answer[0] in (1, 2)
    link.close()
    assert got(server, "/scenario.json")[0] == 200


def test_one_that_never_reads_and_24_that_do_delay_nobody() -> None:
    newest, server = shown(patience=limit(3.0))
    with server:
        # Three images of a megapixel do not fit into the buffers of a connection.
        newest.publish(snapshot(newest, 1, 1024))
        stuck = stream(server, "/stream/nav.mjpg", receive_buffer=4096)
        links = [(stream(server, "/stream/nav.mjpg"), bytearray()) for _ in range(24)]
        slowest = 0.0
        pool = ThreadPoolExecutor(len(links))
        for further in [snapshot(newest, value, 1024) for value in (2, 3, 4)]:
            assert all(pool.map(next_jpeg, *zip(*links, strict=True)))
            start = time.perf_counter()
            newest.publish(further)
            slowest = max(slowest, time.perf_counter() - start)
        # Publishing hands over a reference and wakes a thread, whoever reads.
        assert slowest < limit(0.1)
        assert all(pool.map(next_jpeg, *zip(*links, strict=True)))
        pool.shutdown()
        viewers = server._viewers
        wait_until(lambda: len(viewers) == 24, "the one that never reads is disconnected")
        for link, _ in links:
            link.close()
        wait_until(lambda: len(viewers) == 0, "all have left")
        stuck.close()


def test_viewers_beyond_the_limit_are_refused(page: Shown) -> None:
    _, server = page
    links = [stream(server, "/stream/nav.mjpg") for _ in range(MAX_VIEWERS)]
    wait_until(lambda: len(server._viewers) == MAX_VIEWERS, "all are in")
    assert got(server, "/stream/nav.mjpg")[0] == 503
    assert got(server, "/scenario.json")[0] == 200
    for link in links:
        link.close()


def test_a_server_that_is_closed_leaves_its_port(page: Shown) -> None:
    newest, server = page
    link = stream(server, "/stream/nav.mjpg")
    next_jpeg(link, bytearray())
    server.close()
    link.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", server.port), 5.0)
    newest.publish(snapshot(newest))
