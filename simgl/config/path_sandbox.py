"""Where a scenario's files lie, and how far it may reach for them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from simgl.errors import AssetError


@dataclass(frozen=True)
class SandboxedFolder:
    """A folder that relative paths start from, in a larger one that no path may leave.

    Stands where a plain Path would: ``folder / name`` is the path of a file.

    root : resolved
    """

    path: Path
    root: Path

    def __truediv__(self, name: str | Path) -> Path:
        """The path of a file; AssetError where it, or what it links to, lies outside the root."""
        path = self.path / name
        if not path.resolve().is_relative_to(self.root):
            problem = f"leads out of {self.root}, the folder that a scenario's files must lie in"
            raise AssetError(f"{path}: {problem}")
        return path


Base = Path | SandboxedFolder


def beside(base: Base, file: Path) -> Base:
    """The folder of a file that was found from ``base``, with the same bounds."""
    return (
        SandboxedFolder(file.parent, base.root)
        if isinstance(base, SandboxedFolder)
        else file.parent
    )
