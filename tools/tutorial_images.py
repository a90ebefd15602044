"""Makes the images of the tutorial by running it: python -m tools.tutorial_images [FOLDER].

FOLDER is docs/pictures by default. Takes about a minute on two CPU cores.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from simgl import contact_sheet, display_from_dn, load_scenario
from simgl.arrays import Image8
from tools.page_blocks import run_page

ROOT = Path(__file__).parents[1]
# Pixels along a page's text, and what a page may weigh.
_WIDTH, _QUALITY = 1000, 85


def tutorial_images(folder: Path) -> dict[str, Image8]:
    """Images of the tutorial by file name; its files are left in ``folder``."""
    run_page(ROOT / "docs" / "tutorial.md", folder)
    out = folder / "out"
    frames = sorted((out / "approach" / "navcam").glob("*.view.png"))
    step_s = 60
    approach = {f"{step_s * n} s": _pixels(path) for n, path in enumerate(frames)}
    return {
        "tutorial_first": np.hstack(
            [_pixels(out / "first" / f"{name}.view.png") for name in ("overview", "navcam")]
        ),
        "tutorial_probe": _pixels(out / "mission" / "overview.view.png"),
        "tutorial_camera": _radiance_and_dn(folder),
        "tutorial_approach": contact_sheet(approach, columns=4),
        "tutorial_loop": _pixels(folder / "loop.png"),
    }


def _pixels(path: Path) -> Image8:
    return np.asarray(Image.open(path).convert("RGB"))


def _radiance_and_dn(folder: Path) -> Image8:
    """The third step's image as a preview of the radiance, and its digital numbers."""
    camera = load_scenario(folder / "mission.toml").cameras["navcam"]
    path = folder / "out" / "camera" / "navcam"
    dn = np.asarray(Image.open(path.with_suffix(".dn.png"))).astype(np.uint16)
    return np.hstack([_pixels(path.with_suffix(".view.png")), display_from_dn(dn, camera)])


def main(folder: Path) -> None:
    """Write the images as JPEG."""
    with tempfile.TemporaryDirectory() as name:
        for stem, pixels in tutorial_images(Path(name)).items():
            image = Image.fromarray(pixels)
            if image.width > _WIDTH:
                height = round(image.height * _WIDTH / image.width)
                image = image.resize((_WIDTH, height), Image.Resampling.LANCZOS)
            image.save(folder / f"{stem}.jpg", quality=_QUALITY, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else ROOT / "docs" / "pictures")
