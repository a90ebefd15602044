"""A contact sheet of a detector's effects: ``python -m examples.camera_effects --out DIR``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from PIL import Image

from examples.camera_effects.panels import rendered_panels
from simgl import SimglError, contact_sheet
from simgl.cli_progress import activity
from simgl.output import check_writable, complete_file

COLUMNS = 4


def main(
    out: Annotated[Path, typer.Option(help="Folder for the sheet.")] = Path("out/camera_effects"),
    width: Annotated[int, typer.Option(min=64, max=1280, help="Pixels of each image.")] = 480,
) -> None:
    """Render the sheet as PNG."""
    check_writable(out)
    with activity("opening OpenGL") as progress:
        panels = dict(rendered_panels(width, progress))
    path = out / "camera_effects.png"
    with complete_file(path) as temporary:
        Image.fromarray(contact_sheet(panels, COLUMNS)).save(temporary)
    print(path)


if __name__ == "__main__":
    try:
        typer.run(main)
    except SimglError as error:
        print(f"camera_effects: {error}", file=sys.stderr)
        sys.exit(2)
