"""The page in a real browser: it shows, answers keys, fits a phone, and axe sees no fault."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from simgl import Simulator
from simgl.web.page_server import PageServer
from simgl.web.snapshots import NewestSnapshot
from simgl.web.view_session import ViewSession
from tests.patience import limit, wait_until
from tests.web.harness import LOCAL, chromium, next_jpeg, shown, snapshot, stream
from tests.web.small_scene import box_scenario

playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
if chromium() is None:
    pytest.skip("no Chromium is installed", allow_module_level=True)

PHONE, DESK = {"width": 390, "height": 844}, {"width": 1360, "height": 900}
_FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as runner:
        program = runner.chromium.launch(executable_path=chromium(), args=_FLAGS)
        yield program
        program.close()


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A session that draws the box with an Earth, on a thread of its own as OpenGL wants it."""
    scenario = box_scenario(earth={}, sun={})
    newest, stop = NewestSnapshot(scenario), threading.Event()
    failures: list[BaseException] = []

    def draw() -> None:
        try:
            with Simulator(scenario) as simulator:
                ViewSession(simulator, newest).run(stop.is_set)
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=draw)
    with PageServer(newest, LOCAL) as server:
        thread.start()
        yield server.url
        stop.set()
        thread.join()
    assert not failures


class Page:
    """A page that is open, with what it loaded and complained of."""

    def __init__(self, browser: Any, address: str, size: dict[str, int]) -> None:
        self.page = browser.new_page(viewport=size)
        self.loaded: list[str] = []
        self.complaints: list[str] = []
        self.page.on("request", lambda request: self.loaded.append(request.url))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on(
            "console",
            lambda m: self.complaints.append(m.text) if m.type == "error" else None,
        )
        self.page.goto(address)
        self.wait("document.getElementById('pixels').naturalWidth > 0")
        self.wait("document.querySelectorAll('#labels span').length > 3")

    def wait(self, expression: str) -> None:
        wait_until(lambda: bool(self.page.evaluate(expression)), expression, 30.0)

    def wait_fact(self, group: str, name: str, text: str) -> None:
        wait_until(lambda: text in self.fact(group, name), f"{name} {text}")

    def fact(self, group: str, name: str) -> str:
        """The value beside a name in a list of the page."""
        terms = self.page.locator(f"#{group} dt").all_inner_texts()
        return str(self.page.locator(f"#{group} dd").nth(terms.index(name)).inner_text())


@pytest.fixture(scope="module")
def desk(browser: Any, address: str) -> Iterator[Page]:
    """Opened once; what it is told stays."""
    opened = Page(browser, address, DESK)
    yield opened
    opened.page.close()


@pytest.fixture
def phone(browser: Any, address: str) -> Iterator[Page]:
    opened = Page(browser, address, PHONE)
    yield opened
    opened.page.close()


@pytest.mark.parametrize("device", ["desk", "phone"])
def test_it_fits_loads_nothing_from_elsewhere_and_axe_finds_no_fault(
    device: str, request: pytest.FixtureRequest, address: str
) -> None:
    from axe_playwright_python.sync_playwright import Axe

    page: Page = request.getfixturevalue(device)
    wide = page.page.evaluate("document.documentElement.scrollWidth")
    assert wide == page.page.viewport_size["width"]
    assert not [url for url in page.loaded if not url.startswith((address, f"blob:{address}"))]
    faults = Axe().run(page.page).response["violations"]
    assert [(f["id"], [n["html"] for n in f["nodes"]]) for f in faults] == []
    assert page.complaints == []


@pytest.mark.parametrize("shown_as", ["radiance", "depth", "electrons", "light: sun"])
def test_every_display_comes_with_its_scale_and_pixels_in_units(desk: Page, shown_as: str) -> None:
    # One after the other, each has another unit than the last.
    unit = {"depth": "[m]", "electrons": "[e-]"}.get(shown_as, "[W m-2 sr-1]")
    desk.page.select_option("#show", shown_as)
    desk.wait("!document.getElementById('scale').hidden && document.getElementById('note').hidden")
    desk.wait(f"document.getElementById('scale-name').innerText.includes('{unit}')")
    desk.page.fill("#pixel-y", "24")
    for column, depth in (("0", "no spacecraft"), ("32", " m")):
        desk.page.fill("#pixel-x", column)
        desk.wait_fact("pixel-facts", "Depth", depth)
    assert "W m-2 sr-1" in desk.fact("pixel-facts", "Radiance")
    assert "e-" in desk.fact("pixel-facts", "Mean signal")
    assert "DN" in desk.fact("pixel-facts", "Digital number")


def test_controls_work_by_keyboard(desk: Page) -> None:
    page = desk.page
    assert desk.fact("scene-facts", "Range to box") == "12 m"
    page.locator("#time").focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    desk.wait("document.getElementById('epoch').value.startsWith('2026-03-20 12:00:05')")
    page.locator("#exposure").focus()
    page.keyboard.press("End")
    desk.wait("document.getElementById('image-facts').innerText.includes('10 ms')")
    page.locator("#sun-given").focus()
    page.keyboard.press("Space")
    desk.wait("!document.getElementById('sun-ra').disabled")
    page.locator("#sun-dec").focus()
    page.keyboard.press("End")
    desk.wait("document.getElementById('sun-dec-value').value === '90.0°'")
    page.locator("#scene3d").focus()
    # The last label is that of an axis; the first one's place is the middle.
    before = page.locator("#labels span").last.get_attribute("style")
    for key in ("ArrowLeft", "ArrowUp", "+", "-", "-"):
        page.keyboard.press(key)
    wait_until(
        lambda: page.locator("#labels span").last.get_attribute("style") != before, "it turns"
    )
    page.keyboard.press("Space")
    desk.wait("document.getElementById('play').textContent === 'Pause'")
    page.keyboard.press("Space")
    desk.wait("document.getElementById('play').textContent === 'Play'")


def test_a_page_beside_24_streams_and_one_that_never_reads_stays_live(browser: Any) -> None:
    newest, server = shown(patience=limit(30.0))
    with server:
        stuck = stream(server, "/stream/nav.mjpg", receive_buffer=4096)
        links = [(stream(server, "/stream/nav.mjpg"), bytearray()) for _ in range(24)]
        for link, buffer in links:
            next_jpeg(link, buffer)
        opened = Page(browser, server.url, PHONE)
        for value in range(5):
            newest.publish(snapshot(newest, value, 256))
            time.sleep(0.05)
        last = "document.querySelector('#statistics dd').innerText === '26'"
        opened.wait(last)
        opened.page.close()
        for link, _ in links:
            link.close()
        stuck.close()


def test_the_numbers_of_a_scale_differ_where_depths_hardly_do(browser: Any) -> None:
    newest, server = shown()
    depth = np.linspace(198.5, 200.9, 48 * 48, dtype=np.float32).reshape(48, 48)
    newest.publish(snapshot(newest, depth=depth))
    with server:
        opened = Page(browser, server.url, PHONE)
        opened.page.select_option("#show", "depth")
        opened.wait("document.querySelectorAll('#ticks span').length === 5")
        ticks = opened.page.locator("#ticks span").all_inner_texts()
        assert len(set(ticks)) == 5
        opened.page.close()
