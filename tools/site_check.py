"""Opens every page of a website in a browser: ``python -m tools.site_check out/docs/VERSION``.

Of each page one line: how wide it is at the widths of a phone and of a desktop, and what axe finds
against people with disabilities, in light and dark colours. Ends with status 1 where a page is
wider than its window or axe finds anything. ``--images DIR`` also writes what each page looks like.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.web.harness import chromium

# Window widths of a phone and of a desktop [px].
WIDTHS = (390, 1280)
_HEIGHT = 844
# Longest picture of a page [px].
_LONGEST = 6000


@contextmanager
def opened_browser() -> Iterator[Any]:
    """Chromium without a window; raises ImportError without Playwright."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as runner:
        program = runner.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        yield program
        program.close()


def faults(tab: Any, page: Path, images: str | None = None) -> list[str]:
    """What is wrong with a page that is opened in a browser's tab.

    images : beginning of the paths of its pictures, one at each width
    """
    from axe_playwright_python.sync_playwright import Axe

    wrong = []
    tab.goto(page.resolve().as_uri())
    tab.wait_for_load_state("load")
    for width in WIDTHS:
        tab.set_viewport_size({"width": width, "height": _HEIGHT})
        wide = tab.evaluate("document.documentElement.scrollWidth")
        if wide > width:
            wrong.append(f"{wide} px wide in a window of {width} px")
        if images is not None:
            tall = min(tab.evaluate("document.documentElement.scrollHeight"), _LONGEST)
            clip = {"x": 0, "y": 0, "width": width, "height": tall}
            tab.screenshot(path=f"{images}_{width}.png", full_page=True, clip=clip)
    for colours in ("dark", "light"):
        tab.emulate_media(color_scheme=colours)
        for violation in Axe().run(tab).response["violations"]:
            where = violation["nodes"][0]["html"][:120]
            wrong.append(f"{colours}: {violation['id']} ({len(violation['nodes'])}), {where}")
    return wrong


def main() -> int:
    """Check a website; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.site_check")
    parser.add_argument("site", type=Path)
    parser.add_argument("--images", type=Path)
    options = parser.parse_args()
    if options.images is not None:
        options.images.mkdir(parents=True, exist_ok=True)
    pages = [p for p in options.site.rglob("*.html") if "_static" not in p.parts]
    # Listings of the source come last; they are many and alike.
    pages.sort(key=lambda page: ("_modules" in page.parts, page))
    faulty = 0
    with opened_browser() as browser:
        tab = browser.new_page()
        for page in pages:
            name = page.relative_to(options.site)
            images = options.images and f"{options.images / '_'.join(name.with_suffix('').parts)}"
            wrong = faults(tab, page, images)
            faulty += bool(wrong)
            print(f"{name}: {'; '.join(wrong) or 'ok'}", flush=True)
    print(f"{len(pages)} pages, {faulty} with faults")
    return min(faulty, 1)


if __name__ == "__main__":
    sys.exit(main())
