"""The website of the documentation, a folder a version: ``python -m tools.docs_site out/docs``.

Versions built before stay, and every page links to all of them. Nothing needs a web server.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def build(site: Path) -> Path:
    """Build the pages of this version into ``site/VERSION``, and list all versions.

    returns : the first page
    Raises CalledProcessError for a page in no table of contents, a dead link or an unreadable
    docstring.
    """
    folder = site / version("simgl")
    words = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", str(ROOT / "docs")]
    subprocess.run([*words, str(folder)], check=True)
    list_versions(site)
    return folder / "index.html"


def list_versions(site: Path) -> list[str]:
    """Write ``versions.js``, which pages read, and a first page that leads to the newest version.

    returns : the versions in the folder, the newest first
    """
    versions = sorted((path.parent.name for path in site.glob("*/index.html")), key=_order)[::-1]
    (site / "versions.js").write_text(f"window.siteVersions = {json.dumps(versions)};\n")
    links = "".join(f'<li><a href="{name}/index.html">{name}</a></li>' for name in versions)
    (site / "index.html").write_text(
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>simgl</title>'
        f'<meta http-equiv="refresh" content="0; url={versions[0]}/index.html"></head>'
        f"<body><main><h1>simgl</h1><ul>{links}</ul></main></body></html>\n"
    )
    return versions


def _order(name: str) -> list[tuple[int, str]]:
    """Numbers as numbers: 0.10 after 0.9."""
    return [(int(part) if part.isdigit() else -1, part) for part in name.split(".")]


if __name__ == "__main__":
    try:
        print(build(Path(sys.argv[1])))
    except subprocess.CalledProcessError as error:
        sys.exit(error.returncode)
