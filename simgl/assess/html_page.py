"""Reports as HTML pages from templates, with images within the page."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from simgl import assets
from simgl.assess.trajectory_assessment import Assignment
from simgl.assess.verdict import Verdict
from simgl.output import complete_file
from simgl.physics.ephemeris import utc_from_tai_ns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {
    Verdict.GOOD: "#2e8b57",
    Verdict.TOO_BRIGHT: "#e0a800",
    Verdict.TOO_DARK: "#3b4252",
    Verdict.CONFUSED: "#8e5ea2",
    Verdict.NOT_IN_VIEW: "#c8ccd4",
}


def write_page(path: Path, template: str, work: Assignment, **content: object) -> None:
    """One HTML file that needs no other, from a template's name and what it shows."""
    environment = Environment(
        loader=FileSystemLoader(assets.data() / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["utc"] = utc_from_tai_ns
    camera = work.scenario.cameras[work.camera]
    d, lens = camera.detector, camera.lens
    page = environment.get_template(template).render(
        work=work,
        camera=camera,
        camera_text=f"{work.camera}: {d.width} x {d.height}, {1e3 * lens.focal_length:g} mm, "
        f"f/{lens.f_number:g}",
        colours=COLOURS,
        **content,
    )
    with complete_file(path) as temporary:
        temporary.write_text(page + "\n", encoding="utf-8")


def base64_png(image: Figure | bytes) -> str:
    """A plot, or the bytes of a PNG, for the ``src`` of an image."""
    if isinstance(image, bytes):
        return base64.b64encode(image).decode()
    buffer = io.BytesIO()
    image.savefig(buffer, dpi=100)
    return base64.b64encode(buffer.getvalue()).decode()
