"""Every block of the tutorial runs, in order, and leaves what the page says."""

from __future__ import annotations

import csv
import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from simgl.shipped_examples import new_project
from tests.docs.few_pixels import with_few_pixels
from tools.page_blocks import blocks, run_page

TUTORIAL = Path(__file__).parents[2] / "docs" / "tutorial.md"


@pytest.fixture(scope="module")
def tutorial(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of a reader who has done all of the tutorial, and what was printed."""
    folder = tmp_path_factory.mktemp("tutorial")
    with (
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(StringIO()) as printed,
    ):
        patch.setattr("simgl.interruption.end_by_signals", lambda: None)
        run_page(TUTORIAL, folder, with_few_pixels)
    return folder, printed.getvalue()


def test_every_block_is_run() -> None:
    assert not [block for block in blocks(TUTORIAL) if block.not_run is not None]
    assert {block.language for block in blocks(TUTORIAL)} == {"sh", "toml", "python"}


def test_every_image_that_the_page_names_is_there(tutorial: tuple[Path, str]) -> None:
    folder, _ = tutorial
    named = re.findall(r"`((?:out/)[\w/.]+\.png|loop\.png)`", TUTORIAL.read_text())
    assert len(set(named)) == 6
    for name in named:
        with Image.open(folder / name) as image:
            low, high = np.asarray(image, dtype=np.float64).min(), np.asarray(image).max()
        assert high > low, name


def test_frames_of_the_approach_follow_the_table(tutorial: tuple[Path, str]) -> None:
    folder, _ = tutorial
    with (folder / "out" / "approach" / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4
    assert len(list((folder / "out" / "approach" / "navcam").glob("*.dn.png"))) == 4


def test_the_loop_centres_the_target(tutorial: tuple[Path, str]) -> None:
    _, printed = tutorial
    number = r"([-+]?\d+\.\d+)"
    rows = re.findall(rf"range +{number} m  off axis {number} {number} rad", printed)
    ranges, *angles = zip(*([float(n) for n in row] for row in rows), strict=True)
    assert len(ranges) == 8
    assert list(ranges) == sorted(ranges, reverse=True)
    assert ranges[0] > 60.0
    # 4 m beside and 3 m above the axis at 60 m; the light's middle is within 0.5 m of the target's.
    for angle, start in zip(angles, (-0.067, 0.050), strict=True):
        assert abs(angle[0] - start) < 0.008
        # Halved in each of seven steps from 0.067 rad at 60 m to 32 m, where it counts twice:
        # 0.001 rad; a pixel of these images is 0.0015 rad, of which the middle of hundreds of
        # bright ones resolves a tenth. It is printed to 0.0001.
        assert abs(angle[-1]) < 0.0013 + 0.00005


def test_blocks_are_saved_appended_and_skipped(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "```toml\n# a/one.toml\nx = 1\n```\n```toml\n# at the end of a/one.toml\ny = 2\n```\n"
        "<!-- not run: no such program -->\n\n```sh\nno-such-program\n```\n"
        "```python\nn = 3\n```\n```python\nfrom pathlib import Path\nassert n == 3\n"
        "Path('two').write_text('2')\n```\n"
        "```sh\necho three \\\n  > three\n```\n```text\nonly read\n```\n"
    )
    run_page(page, tmp_path)
    saved = (tmp_path / "a" / "one.toml").read_text()
    assert saved == "# a/one.toml\nx = 1\n# at the end of a/one.toml\ny = 2\n"
    assert (tmp_path / "two").read_text() == "2"
    assert (tmp_path / "three").read_text() == "three\n"
    page.write_text("```sh\ntrue\nfalse\n```\n")
    with pytest.raises(RuntimeError, match=r"page\.md:2: false ends with status 1"):
        run_page(page, tmp_path)


def test_few_pixels_are_fewer_once(tmp_path: Path) -> None:
    new_project(tmp_path / "first")
    with_few_pixels(tmp_path)
    before = {path: path.read_text() for path in tmp_path.rglob("*.toml")}
    assert "width_px = 320  # halved " in before[tmp_path / "first" / "camera.toml"]
    assert "focal_length_mm = 4.0  # halved " in before[tmp_path / "first" / "scenario.toml"]
    with_few_pixels(tmp_path)
    assert {path: path.read_text() for path in tmp_path.rglob("*.toml")} == before
