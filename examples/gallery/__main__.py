"""Render the images of docs/gallery.md: ``python -m examples.gallery --out docs/pictures``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from PIL import Image

from examples.gallery.gallery_images import gallery_images
from simgl import SimglError
from simgl.cli_progress import activity
from simgl.output import check_writable, complete_file

QUALITY = 88


def main(
    out: Annotated[Path, typer.Option(help="Folder for the images.")] = Path("out/gallery"),
    shrink: Annotated[int, typer.Option(min=1, max=16, help="Make them smaller by this.")] = 1,
) -> None:
    """Render every image of the gallery as JPEG."""
    check_writable(out)
    with activity("opening OpenGL") as progress:
        for name, image in gallery_images(shrink, progress):
            path = out / f"{name}.jpg"
            with complete_file(path) as temporary:
                Image.fromarray(image).save(temporary, quality=QUALITY)
            print(path)


if __name__ == "__main__":
    try:
        typer.run(main)
    except SimglError as error:
        print(f"gallery: {error}", file=sys.stderr)
        sys.exit(2)
