"""What the pages of assessments share: colours of verdicts, style, pictures within the page."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from simgl.assess.verdict import Verdict
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
:root { color-scheme: light dark; --ink: #1d2430; --soft: #4a5363; --line: #d5d9e0; --paper: #fff; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e3e6ec; --soft: #a3abb9; --line: #3a414e; --paper: #14171c; }
}
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper);
       margin: 2em auto; max-width: 1060px; padding: 0 1em; overflow-wrap: break-word; }
h1 { font-size: 1.6em; }
h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid var(--line); }
table { border-collapse: collapse; margin: .6em 0; }
th { text-align: left; font-weight: 600; white-space: nowrap; }
td { overflow-wrap: anywhere; }
td, th { padding: .15em .9em .15em 0; vertical-align: top; }
td.n { text-align: right; white-space: nowrap; }
img { display: block; max-width: 100%; background: #fff; border-radius: 3px; }
.strip { display: flex; height: 22px; border-radius: 3px; overflow: hidden; margin-top: .5em;
         border: 1px solid var(--line);
         print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.key { display: inline-block; width: .8em; height: .8em; border-radius: 2px; margin-right: .35em;
       print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.keys > span { margin-right: 1.2em; white-space: nowrap; }
figure { margin: 0 0 .6em; } img.plot { width: 100%; }
figcaption { font-size: .85em; color: var(--soft); margin-top: .3em; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(360px, 100%), 1fr));
            gap: 1.2em; align-items: start; margin-bottom: 2em; }
.pictures img { width: 100%; image-rendering: pixelated; }
.pictures img.plot { image-rendering: auto; }
@media print {
  :root { --ink: #000; --soft: #333; --line: #999; --paper: #fff; }
  body { margin: 0; max-width: none; font-size: 10pt; }
  h2, .epoch > p { break-after: avoid; } .epoch, figure, tr { break-inside: avoid; }
  .pictures { grid-template-columns: 1fr 1fr; }
  body > img.plot { width: auto; max-height: 11cm; }
}
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


def image(png: bytes, kind: str) -> str:
    """A PNG as an element of the page.

    kind : "picture", whose pixels stay square, or "plot"
    """
    data = base64.b64encode(png).decode()
    return f'<img class="{kind}" src="data:image/png;base64,{data}" alt="">'


def inline(figure: Figure) -> str:
    """A drawing as an element of the page."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=100)
    return image(buffer.getvalue(), "plot")
