"""Small HTML tables: how a notebook shows a scenario, a state and a capture."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape


def html_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table with a title; texts are escaped, so that no name of a file becomes markup."""
    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows
    )
    caption = f"<caption>{escape(title)}</caption>"
    header = f"<thead><tr>{head}</tr></thead>" if columns else ""
    return f"<table>{caption}{header}<tbody>{body}</tbody></table>"


def html_image(png: bytes, description: str) -> str:
    """An image within the page, never wider than it.

    png : the file's bytes
    description : for those who do not see it
    """
    data = base64.b64encode(png).decode("ascii")
    style = "max-width: 100%"
    return f'<img src="data:image/png;base64,{data}" alt="{escape(description)}" style="{style}">'
