"""What a shell offers at the tab key; quick to import, since it runs at every press."""

from __future__ import annotations

from pathlib import Path

from simgl import assets

_MODEL_SUFFIXES = (".glb", ".gltf", ".obj", ".stl")


def scenario_files(incomplete: str) -> list[str]:
    """Scenario and campaign files, and the folders on the way to them."""
    return _paths(incomplete, (".toml",))


def camera_presets(incomplete: str) -> list[str]:
    """Shipped camera presets, and preset files."""
    names = sorted(path.stem for path in (assets.data() / "cameras").glob("*.toml"))
    return _beginning(incomplete, names) + _paths(incomplete, (".toml",))


def model_names(incomplete: str) -> list[str]:
    """Shipped models, and model files."""
    names = sorted(path.parent.name for path in assets.models().glob("*/model.toml"))
    return _beginning(incomplete, names) + _paths(incomplete, _MODEL_SUFFIXES)


def example_names(incomplete: str) -> list[str]:
    """Shipped examples."""
    from simgl.shipped_examples import shipped_examples

    return _beginning(incomplete, ["all", *shipped_examples()])


def bench_scenes(incomplete: str) -> list[str]:
    """Shipped benchmark scenes."""
    from simgl.bench.scenes import bench_scenes as scenes

    return _beginning(incomplete, sorted(scenes()))


def bench_sets(incomplete: str) -> list[str]:
    """Sets of benchmark scenes."""
    from simgl.bench.scenes import SETS

    return _beginning(incomplete, sorted(SETS))


def _beginning(incomplete: str, names: list[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def _paths(incomplete: str, suffixes: tuple[str, ...]) -> list[str]:
    """Files of some kinds, and folders with a slash at the end."""
    start = incomplete.rpartition("/")[2]
    prefix = incomplete[: len(incomplete) - len(start)]
    paths = []
    try:
        entries = sorted(Path(prefix or ".").iterdir())
    except OSError:
        return []
    for path in entries:
        if path.name.startswith(start) and (start or not path.name.startswith(".")):
            if path.is_dir():
                paths.append(f"{prefix}{path.name}/")
            elif path.suffix.lower() in suffixes:
                paths.append(f"{prefix}{path.name}")
    return paths
