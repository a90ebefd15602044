"""Runs every block of the how-to guides: ``python -m tools.run_guides [NAME.md ...]``.

Each guide runs in an empty folder, with few pixels, as the tests run the quick ones.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.docs.few_pixels import with_few_pixels
from tools.page_blocks import run_page

GUIDES = Path(__file__).resolve().parents[1] / "docs" / "howto"


def main() -> None:
    """Run the guides that are named, or all."""
    for name in sys.argv[1:] or sorted(page.name for page in GUIDES.glob("*.md")):
        with tempfile.TemporaryDirectory() as folder:
            run_page(GUIDES / name, Path(folder), with_few_pixels)
        print(f"{name}: every command ends with status 0", flush=True)


if __name__ == "__main__":
    main()
