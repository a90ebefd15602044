"""Spacecraft that light themselves, and by how much they differ from a path tracer:
``python -m benchmarks.path_tracer.image_sheets --out DIR``.

The scenes of the truth tables: simgl, Mitsuba 3 and their difference in one picture each.

The tracer's pictures stay in DIR: another run there draws only simgl's.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from PIL import Image
from rich.console import Console

from benchmarks.path_tracer.compare import difference
from benchmarks.path_tracer.difference_images import in_a_row, shown, signed
from benchmarks.path_tracer.tracer import VISIBLE, trace
from benchmarks.truth.light_scenes import scenes
from simgl import Product, Scenario, Simulator
from simgl.arrays import Array
from simgl.display_colours import WHITE_RADIANCE
from simgl.output import check_writable, complete_file

# So much of the picture is darker than what is shown as white.
_WHITE = 0.99
_QUALITY = 88


def main(
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")],
    scene: Annotated[list[str] | None, typer.Option(help="Only these scenes.")] = None,
    paths: Annotated[int, typer.Option(help="Paths a pixel.", min=64)] = 512,
) -> None:
    """Draw simgl, Mitsuba 3, and their difference, scene by scene."""
    check_writable(out)
    known = scenes()
    unknown = set(scene or ()) - set(known)
    if unknown:
        raise typer.BadParameter(f"--scene {min(unknown)}: allowed are {', '.join(known)}")
    console = Console()
    for name in scene or list(known):
        scenario = known[name]
        state = scenario.at(scenario.epoch_tai_ns)
        traced = trace(state, state.cameras["cam"], VISIBLE, paths, out, lambda: None)
        image = _simgl(scenario)
        compared = difference(image, traced.radiance, traced.error)
        white = WHITE_RADIANCE * np.quantile(traced.radiance / WHITE_RADIANCE, _WHITE)
        picture = in_a_row(
            shown(image, white), shown(traced.radiance, white), signed(compared.relative)
        )
        with complete_file(out / f"light_{name.lower().replace(' ', '_')}.jpg") as part:
            Image.fromarray(picture).save(part, format="JPEG", quality=_QUALITY)
        agreement = compared.agreement
        console.print(
            f"{name}: {agreement.within_10_percent:.1%} of the pixels within 10 %, "
            f"sum {agreement.mean_ratio - 1.0:+.2%}; tracer: noise {agreement.noise_median:.1%} "
            f"in the median, {traced.cpu_seconds:.0f} s of processor time"
        )


def _simgl(scenario: Scenario) -> Array:
    """(height, width, 3) radiance in R, G, B of a frame loop's image."""
    with Simulator(scenario) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        capture = simulator.capture(state, "cam", {Product.RADIANCE})
    assert capture.radiance is not None
    return capture.radiance.radiance[..., list(VISIBLE)].astype(np.float64)


if __name__ == "__main__":
    typer.run(main)
