"""Film one orbit: ``python -m examples.orbit_film --out out/orbit_film``."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
import typer
from PIL import Image

from examples.orbit_film.places import PLACES, SEASONS, places
from examples.orbit_film.views import beta_frames, orbit_frames, views
from simgl import SimglError, contact_sheet
from simgl.arrays import Image8
from simgl.cli_progress import activity
from simgl.output import check_writable, complete_file
from simgl.video import write_mp4

QUALITY = 72
FRAME_RATE = 4


def main(
    out: Annotated[Path, typer.Option(help="Folder for the film and the sheets.")] = Path(
        "out/orbit_film"
    ),
    beta: Annotated[
        list[float] | None,
        typer.Option(help="Only a sheet of an orbit with the Sun so far from its plane [deg]."),
    ] = None,
) -> None:
    """The film as MP4, its 24 frames on a sheet, and sheets of the Earth: from every distance,
    fifteen places, four seasons."""
    check_writable(out)
    with activity("opening OpenGL") as progress:
        for angle in beta or []:
            frames = dict(beta_frames(angle, progress))
            _write_sheet(out / f"orbit_beta_{angle:g}.jpg", frames, columns=4, width=300)
        if beta:
            return
        frames = dict(orbit_frames(progress))
        others = dict(views(progress))
        fifteen = dict(places(PLACES, progress))
        seasons = dict(places(SEASONS, progress))
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{k:06}.png" for k in range(len(frames))]
        for path, image in zip(paths, frames.values(), strict=True):
            Image.fromarray(image).save(path)
        write_mp4(out / "orbit.mp4", paths, FRAME_RATE)
    print(out / "orbit.mp4")
    _write_sheet(out / "orbit_film.jpg", frames, columns=4, width=300)
    _write_sheet(out / "earth_views.jpg", others, columns=3, width=480)
    _write_sheet(out / "earth_places.jpg", fifteen, columns=3, width=480)
    _write_sheet(out / "earth_seasons.jpg", seasons, columns=2, width=480)


def _write_sheet(path: Path, images: Mapping[str, Image8], *, columns: int, width: int) -> None:
    size = width, width * 3 // 4
    panels = {
        name: np.asarray(Image.fromarray(image).resize(size, Image.Resampling.LANCZOS))
        for name, image in images.items()
    }
    with complete_file(path) as temporary:
        Image.fromarray(contact_sheet(panels, columns)).save(temporary, quality=QUALITY)
    print(path)


if __name__ == "__main__":
    try:
        typer.run(main)
    except SimglError as error:
        print(f"orbit_film: {error}", file=sys.stderr)
        sys.exit(2)
