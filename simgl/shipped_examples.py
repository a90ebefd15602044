"""Examples that come with the package, and their copies in a folder of the user's.

A copy has the layout of the repository, ``examples/short/radiance.py`` beside
``examples/approach.toml``, so that scripts and the commands of the documentation run as they are.
Pages' pictures are made by further examples, which stay in the repository.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from simgl import assets
from simgl.errors import ConfigError, OutputError, did_you_mean
from simgl.output import complete_file

COMMAND_LINE = "command line"
# Each file is an example; a folder with a __main__ is one by itself.
_PATTERNS = (
    "*.toml",
    "first_image.py",
    "short/*.py",
    "trajectories/*.toml",
    "bridge/*.toml",
    "bridge/*.py",
    "bands/led_camera.toml",
    "bands/star_tracker.toml",
    "bands/swir.toml",
    "bands/swir_earth.toml",
    "event_camera/*.toml",
    "campaign/*.toml",
    "campaign/overlay.py",
    "closed_loop/__main__.py",
)
_PROJECT = "start"


@dataclass(frozen=True, kw_only=True)
class Example:
    """A shipped example.

    name : its path below ``examples``, without a suffix
    title : its first sentence
    command : runs a copy, from the folder that ``examples`` was copied to
    files : it and all files that it reads, relative to ``examples``
    """

    name: str
    title: str
    command: str
    files: tuple[Path, ...]


def shipped_examples() -> dict[str, Example]:
    """Examples by name, scenarios first."""
    root = assets.examples()
    paths = [path for pattern in _PATTERNS for path in sorted(root.glob(pattern))]
    return {e.name: e for e in (_example(p, root) for p in paths if p.name != "__init__.py")}


def copy_example(name: str, folder: Path) -> list[Path]:
    """Write an example, or "all", below ``folder/examples``; returns the paths.

    A file that is there already with the same content stays. Raises ConfigError for an unknown
    name and OutputError, with nothing written, where a file of other content is in the way.
    """
    examples = shipped_examples()
    if name != "all" and name not in examples:
        problem = f'"{name}" is not shipped; {did_you_mean(name, examples)}'
        raise ConfigError(COMMAND_LINE, "NAME", problem)
    chosen = examples.values() if name == "all" else [examples[name]]
    root = assets.examples()
    files = dict.fromkeys(file for example in chosen for file in example.files)
    return _copy({root / file: folder / "examples" / file for file in files})


def new_project(folder: Path) -> list[Path]:
    """Write a scenario, a camera and a closed loop into a new folder.

    Raises ConfigError for a name that is none, and OutputError where it is there or cannot be made.
    """
    if not folder.name or not str(folder).isprintable():
        problem = f'must be the name of a new folder, such as "first", got "{folder}"'
        raise ConfigError(COMMAND_LINE, "NAME", problem)
    if os.path.lexists(folder):
        raise OutputError(f"{folder}: is there already; nothing was written, give a new name")
    template = assets.examples() / _PROJECT
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        # All files appear at once, or none.
        with TemporaryDirectory(prefix=".", dir=folder.parent) as name:
            temporary = Path(name, "project")
            temporary.mkdir()
            for path in sorted(template.glob("*.*")):
                (temporary / path.name).write_bytes(path.read_bytes())
            temporary.rename(folder)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written ({error.strerror})") from None
    return sorted(folder.iterdir())


def _example(path: Path, root: Path) -> Example:
    relative = path.relative_to(root)
    if path.name == "__main__.py":
        name, head = relative.parent.as_posix(), path.with_name("__init__.py")
        command = f"python -m examples.{name}"
        files = [file.relative_to(root) for file in sorted(path.parent.glob("*.*"))]
    else:
        name, head, files = relative.with_suffix("").as_posix(), path, [relative]
        command = f"python examples/{relative.as_posix()}"
        if path.suffix == ".toml":
            program = "campaign" if path.parent.name == "campaign" else "render"
            command = f"simgl {program} examples/{relative.as_posix()} --out out"
    if path.parent.name == "campaign" and path.suffix == ".py":
        files.append(relative.with_name("__init__.py"))
        command = f"python -m examples.{name.replace('/', '.')}"
    for file in files:  # Grows while it is read: what is read may read others.
        files += [other for other in _read_by(root / file, root) if other not in files]
    return Example(name=name, title=_first_sentence(head), command=command, files=tuple(files))


def _read_by(path: Path, root: Path) -> list[Path]:
    """Files of the examples that a file names in quotes; those that fit a formatted name."""
    named = re.findall(r'"([\w./{}-]+\.\w+)"', path.read_text(encoding="utf-8"))
    patterns = [re.sub(r"\{\w+\}", "*", name) for name in named]
    folders = (path.parent, root, root.parent)
    matches = [m.resolve() for p in patterns for folder in folders for m in sorted(folder.glob(p))]
    return list(dict.fromkeys(m.relative_to(root) for m in matches if m.is_relative_to(root)))


def _first_sentence(path: Path) -> str:
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        head = text.split('"""')[1]
    else:
        head = " ".join(line[1:].strip() for line in text.partition("\n\n")[0].splitlines())
        head = head.partition(" [")[0]
    return re.split(r"(?<=\.)\s|: simgl|: python", " ".join(head.split()))[0].rstrip(".")


def _copy(copies: dict[Path, Path]) -> list[Path]:
    """Copy all files or none; returns where they are."""
    content = {target: path.read_bytes() for path, target in copies.items()}
    for target, data in content.items():
        if os.path.lexists(target) and not _holds(target, data):
            problem = "is there already with other content; nothing was written"
            raise OutputError(f"{target}: {problem}, give another --out")
    for target, data in content.items():
        if not target.exists():
            with complete_file(target) as temporary:
                temporary.write_bytes(data)
    return list(content)


def _holds(path: Path, data: bytes) -> bool:
    try:
        return path.is_file() and path.read_bytes() == data
    except OSError:
        return False
