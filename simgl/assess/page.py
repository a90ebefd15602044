"""What the pages of assessments share: colours of verdicts, style, pictures within the page."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from simgl.assess.criteria import Verdict
from simgl.output import complete_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {
    Verdict.GOOD: "#2e8b57",
    Verdict.TOO_BRIGHT: "#e0a800",
    Verdict.TOO_DARK: "#3b4252",
    Verdict.CONFUSED: "#8e5ea2",
    Verdict.NOT_IN_VIEW: "#c8ccd4",
}
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1d2430; margin: 2em auto; max-width: 1060px;
       padding: 0 1em; }
h1 { font-size: 1.6em; } h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #d5d9e0; }
table { border-collapse: collapse; margin: .6em 0; } th { text-align: left; font-weight: 600; }
td, th { padding: .15em .9em .15em 0; vertical-align: top; } td.n { text-align: right; }
img { max-width: 100%; }
.strip { display: flex; height: 22px; border-radius: 3px; overflow: hidden; }
.key { display: inline-block; width: .8em; height: .8em; border-radius: 2px; margin-right: .35em; }
figure { margin: 0; } figcaption { font-size: .85em; color: #4a5363; }
.pictures { display: grid; grid-template-columns: 1fr 1fr; gap: 1.2em; }
"""


def write_page(path: Path, title: str, sections: Sequence[str]) -> None:
    """One HTML file that needs no other."""
    page = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{html.escape(title)}</title>\n"
        f"<style>{_STYLE}</style></head>\n<body>\n" + "\n".join(sections) + "\n</body></html>\n"
    )
    with complete_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def image(png: bytes) -> str:
    """A PNG as an element of the page."""
    return f'<img src="data:image/png;base64,{base64.b64encode(png).decode()}" alt="">'


def inline(figure: Figure) -> str:
    """A drawing as an element of the page."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=100)
    return image(buffer.getvalue())
