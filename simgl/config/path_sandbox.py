"""Base folders of relative paths, optionally restricted to a root folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from simgl.errors import AssetError


@dataclass(frozen=True)
class SandboxedFolder:
    """A base folder with a root that no path may leave.

    Used like a Path: ``folder / name`` is the path of a file.

    path : the base folder
    root : the root, resolved
    """

    path: Path
    root: Path

    def __truediv__(self, name: str | Path) -> Path:
        """The path of a file; AssetError if it, or the target of a link, lies outside the root."""
        path = self.path / name
        try:
            resolved = path.resolve()
        except (OSError, RuntimeError, ValueError) as error:  # links in a circle; no file's name
            raise AssetError(f"{str(path)!r}: cannot be read ({error})") from None
        if not resolved.is_relative_to(self.root):
            problem = f"leads out of {self.root}, the folder that a scenario's files must lie in"
            raise AssetError(f"{path}: {problem}")
        return path


Base = Path | SandboxedFolder


def folder_of(file: Path, base: Base) -> Base:
    """The folder of a file as a base folder, with the root of ``base``."""
    if isinstance(base, SandboxedFolder):
        return SandboxedFolder(file.parent, base.root)
    return file.parent
