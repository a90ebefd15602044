"""The documentation as a website: the pages of this folder, and the docstrings' interface."""

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

myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88

# "name, other : what they are": how docstrings here list fields and arguments.
_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : (.*)$")


def parameters_from_entries(lines: list[str]) -> list[str]:
    """Entries of a docstring in the form that Sphinx lays out as a list of parameters."""
    written: list[str] = []
    listing = False
    for line in lines:
        if entry := _ENTRY.match(line):
            line, listing = f":param {entry[1]}: {entry[2]}", True
        elif listing and line and not line.startswith(" "):
            written.append("")
            listing = False
        written.append(line)
    return written


def _read_docstring(*told: Any) -> None:
    """Called with the lines last, to be changed in place."""
    lines: list[str] = told[-1]
    lines[:] = parameters_from_entries(lines)


def _read_signature(*told: Any) -> tuple[str | None, str | None]:
    """A default that is made anew for each object, in a form that Sphinx can read."""
    signature: str | None = told[-2]
    returned: str | None = told[-1]
    return signature and signature.replace("<factory>", "..."), returned


def setup(app: Sphinx) -> None:
    """Have docstrings and signatures put into form before Sphinx reads them."""
    app.connect("autodoc-process-docstring", _read_docstring)
    app.connect("autodoc-process-signature", _read_signature)
