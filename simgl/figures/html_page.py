"""HTML pages from templates, each one file that needs no other."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from simgl import assets
from simgl.figures.style import svg_bytes
from simgl.output import complete_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_html_page(
    path: Path,
    template: str,
    content: Mapping[str, object],
    filters: Mapping[str, Callable[..., object]] | None = None,
    folder: Path | None = None,
) -> None:
    """Fill a template of ``data/templates``, or of a folder whose templates may extend those.

    content : the template's names; one that it uses and that is missing is an error
    filters : further filters of the template by name
    """
    environment = Environment(
        loader=FileSystemLoader([*([folder] if folder else []), assets.data() / "templates"]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= filters or {}
    page = environment.get_template(template).render(content)
    with complete_file(path) as temporary:
        temporary.write_text(page + "\n", encoding="utf-8")


def png_source(image: bytes) -> str:
    """The bytes of a PNG, for the ``src`` of an image."""
    return f"data:image/png;base64,{base64.b64encode(image).decode()}"


def plot_source(figure: Figure) -> str:
    """A plot as SVG, light or dark as the page is, for the ``src`` of an image."""
    return f"data:image/svg+xml;base64,{base64.b64encode(svg_bytes(figure)).decode()}"
