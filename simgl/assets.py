"""Folders of shaders, models, examples, data: in the installed package, or in a checkout."""

from __future__ import annotations

import hashlib
from pathlib import Path

from simgl.errors import AssetError

_PACKAGE = Path(__file__).resolve().parent


def _find(name: str) -> Path:
    for candidate in (_PACKAGE / name, _PACKAGE.parent / name):
        if candidate.is_dir():
            return candidate
    raise AssetError(f'no folder "{name}" in {_PACKAGE} or {_PACKAGE.parent}; reinstall simgl')


def shaders() -> Path:
    """The folder of GLSL files."""
    return _find("shaders")


def models() -> Path:
    """The folder of shipped spacecraft models, one folder each."""
    return _find("models")


def examples() -> Path:
    """The folder of examples."""
    return _find("examples")


def data() -> Path:
    """The folder of maps, spectra and camera presets."""
    return _PACKAGE / "data"


def digests() -> dict[str, str]:
    """SHA-256 of all shaders and of all data: images depend on both."""
    return {"shaders": _digest(shaders()), "data": _digest(data())}


def _digest(folder: Path) -> str:
    h = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            content = hashlib.sha256(path.read_bytes()).hexdigest()
            h.update(f"{path.relative_to(folder).as_posix()} {content}\n".encode())
    return h.hexdigest()
