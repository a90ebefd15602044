"""The page of an assessment: what every template of ``assess`` shows."""

from __future__ import annotations

from pathlib import Path

from simgl.assess.trajectory_assessment import Assignment
from simgl.assess.verdict import Verdict
from simgl.figures.html_page import write_html_page
from simgl.figures.style import GREEN, NIGHT, ORANGE, PALE, PURPLE
from simgl.physics.ephemeris import utc_from_tai_ns

COLOURS = {
    Verdict.GOOD: GREEN,
    Verdict.TOO_BRIGHT: ORANGE,
    Verdict.TOO_DARK: NIGHT,
    Verdict.CONFUSED: PURPLE,
    Verdict.NOT_IN_VIEW: PALE,
}


def write_page(path: Path, template: str, work: Assignment, **content: object) -> None:
    """One HTML file that needs no other, from a template's name and what it shows."""
    camera = work.scenario.cameras[work.camera]
    d, lens = camera.detector, camera.lens
    content |= {
        "work": work,
        "camera": camera,
        "camera_text": f"{work.camera}: {d.width} x {d.height}, {1e3 * lens.focal_length:g} mm, "
        f"f/{lens.f_number:g}",
        "colours": COLOURS,
    }
    write_html_page(path, template, content, {"utc": utc_from_tai_ns})
