"""Sphinx configuration: the pages of this folder, and the Python interface from its docstrings."""

from __future__ import annotations

import re
from importlib.metadata import version as version_of
from typing import Any

from sphinx.application import Sphinx

project = "simgl"
author = "The simgl founders"
copyright = f"{author}, Apache-2.0"
version = release = version_of("simgl")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
html_theme = "furo"
html_title = "simgl"
html_show_sphinx = False
html_static_path = ["_static"]
templates_path = ["_templates"]
html_js_files = ["site.js"]
html_css_files = ["site.css"]
html_theme_options: dict[str, Any] = {"top_of_page_buttons": []}
# The theme's, with the version and its siblings.
html_sidebars = {
    "**": [
        "sidebar/brand.html",
        "sidebar/versions.html",
        "sidebar/search.html",
        "sidebar/scroll-start.html",
        "sidebar/navigation.html",
        "sidebar/scroll-end.html",
    ]
}

myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88

# "name, other : meaning" is how docstrings of simgl list fields and arguments.
_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : (.*)$")


def parameters_from_entries(lines: list[str]) -> list[str]:
    """A docstring with its entries as the ``:param`` fields that Sphinx lays out."""
    converted: list[str] = []
    in_entries = False
    for line in lines:
        if entry := _ENTRY.match(line):
            # Sphinx takes what stands before a space for a type.
            names = entry[1].replace(", ", ",")
            line, in_entries = f":param {names}: {entry[2]}", True
        elif in_entries and line and not line.startswith(" "):
            converted.append("")
            in_entries = False
        converted.append(line)
    return converted


def _process_docstring(*event: Any) -> None:
    """Sphinx passes the docstring's lines last; they are changed in place."""
    lines: list[str] = event[-1]
    lines[:] = parameters_from_entries(lines)


def _process_signature(*event: Any) -> tuple[str | None, str | None]:
    """Dataclass default factories in a form that Sphinx can parse."""
    signature: str | None = event[-2]
    return_annotation: str | None = event[-1]
    return signature and signature.replace("<factory>", "..."), return_annotation


def setup(app: Sphinx) -> None:
    """Register the conversions of docstrings and signatures."""
    app.connect("autodoc-process-docstring", _process_docstring)
    app.connect("autodoc-process-signature", _process_signature)
