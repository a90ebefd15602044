"""The website: galleries show their files, pages fit a phone and can be read by everybody."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from simgl import load_scenario
from tests.web.harness import chromium
from tools.docs_site import list_versions

ROOT = Path(__file__).parents[2]
GALLERIES = [ROOT / "docs" / name for name in ("gallery.md", "earth_gallery.md")]
PAGES = ("index", "gallery", "assessment")
_FILE = re.compile(r"~~~\{literalinclude\} (\S+\.toml)$", re.M)


@pytest.mark.parametrize("page", GALLERIES, ids=lambda path: path.name)
def test_a_gallery_has_the_scenario_of_each_section_beside_it(page: Path) -> None:
    """Included from the examples, so that page and file cannot differ, and to be downloaded."""
    text = page.read_text()
    downloads = set(re.findall(r"\{download\}`[^`<]*<([^`>]+)>`", text))
    files = _FILE.findall(text)
    assert set(files) == downloads
    for name in files:
        assert load_scenario((page.parent / name).resolve()).cameras
    # A file goes for the sections after it, up to the next one.
    assert len(files) >= 2


def test_versions_are_listed_with_the_newest_first(tmp_path: Path) -> None:
    for name in ("0.9.0", "0.10.0", "0.1.0"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "index.html").write_text("")
    assert list_versions(tmp_path) == ["0.10.0", "0.9.0", "0.1.0"]
    assert "url=0.10.0/index.html" in (tmp_path / "index.html").read_text()
    assert '"0.9.0"' in (tmp_path / "versions.js").read_text()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Few pages, built as all are; a version that was there before beside them."""
    root = tmp_path_factory.mktemp("site")
    source = root / "docs"
    source.mkdir()
    for name in ("conf.py", "_static", "_templates", "pictures"):
        (source / name).symlink_to(ROOT / "docs" / name)
    (root / "examples").symlink_to(ROOT / "examples")
    for name in PAGES[1:]:
        shutil.copy(ROOT / "docs" / f"{name}.md", source)
    toc = "```{toctree}\n:caption: Pages\n" + "\n".join(PAGES[1:]) + "\n```\n"
    (source / "index.md").write_text(f"# Start\n\nA page.\n\n{toc}")
    built = root / "site" / "2.0"
    words = [sys.executable, "-m", "sphinx", "-q", "-Q", str(source), str(built)]
    subprocess.run(words, check=True)
    (root / "site" / "1.0").mkdir()
    (root / "site" / "1.0" / "index.html").write_text("")
    list_versions(root / "site")
    return built


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api")
    if chromium() is None:
        pytest.skip("no Chromium")
    with playwright.sync_playwright() as runner:
        program = runner.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        yield program
        program.close()


def test_pages_fit_a_phone_and_pass_the_accessibility_check(site: Path, browser: Any) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page = browser.new_page(viewport={"width": 390, "height": 844})
    for name in PAGES:
        page.goto(f"file://{site}/{name}.html")
        page.wait_for_selector("#versions a", state="attached")
        for width in (390, 1280):
            page.set_viewport_size({"width": width, "height": 844})
            assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        found = axe.run(page).response["violations"]
        assert not [(one["id"], one["nodes"][0]["html"]) for one in found], name
    assert page.get_attribute("#versions a", "href") is not None


def test_search_finds_without_a_server(site: Path, browser: Any) -> None:
    page = browser.new_page()
    page.goto(f"file://{site}/search.html?q=Wilson")
    page.wait_for_selector("#search-results li a")
    assert "Lighting assessment" in page.inner_text("#search-results")
