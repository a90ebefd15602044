"""The architecture holds: imports only go down from layer to layer, and passes stand alone."""

from __future__ import annotations

from collections import Counter

import pytest

from tests.hygiene.source import Module, imported_modules, imports, modules

# Packages and modules directly below simgl/, lowest layer first. A package may import from every
# lower layer, and from itself. "" is the public interface, simgl/__init__.py.
LAYERS = (
    ("arrays", "disk_cache", "errors", "lru_cache", "progress"),
    ("assets", "environment_map", "sample_grid"),
    ("gpu", "physics"),
    ("config", "motion"),
    ("camera",),
    ("images", "scene"),
    ("false_colour", "flash_lidar", "model_files", "rays"),
    ("levels", "radiosity", "scenario"),
    ("view",),
    ("shapes",),
    ("passes",),
    ("camera_pipeline", "renderer"),
    ("simulator",),
    ("bench", "cli_progress", "output", "workers"),
    ("doctor", "inspection", "maps", "sequence", "viewer"),
    ("assess", "campaign"),
    ("", "cli"),
    ("__main__",),
)
LAYER = {package: number for number, packages in enumerate(LAYERS) for package in packages}

# Packages that may import less than their layer allows.
LIMITED_TO = {
    # Knows OpenGL, not spacecraft.
    "gpu": {"arrays", "assets", "errors", "gpu", "lru_cache"},
    # Formulas, whatever draws them.
    "physics": {"arrays", "assets", "physics"},
}

# Shared by passes; every other pass stands alone.
SHARED_PASSES = {
    "simgl.passes.albedo_table",
    "simgl.passes.background.air",
    "simgl.passes.background.air_tables",
    "simgl.passes.background.cloud_map",
    "simgl.passes.background.discs",
    "simgl.passes.background.earth_maps",
    "simgl.passes.background.earth_textures",
    "simgl.passes.background.planet_blocks",
    "simgl.passes.mesh_store",
    "simgl.passes.outline_program",
    "simgl.passes.shared_blocks",
    "simgl.passes.texture_store",
}

each_module = pytest.mark.parametrize("module", modules(), ids=lambda m: m.name)


def package(name: str) -> str:
    """The first name below ``simgl``."""
    return name.partition(".")[2].partition(".")[0]


@each_module
def test_every_package_has_a_layer(module: Module) -> None:
    assert module.package in LAYER, f"say in LAYERS where {module.package} belongs"


@each_module
def test_imports_only_go_down(module: Module) -> None:
    for name in imported_modules(module):
        own, other = module.package, package(name)
        assert own == other or LAYER[other] < LAYER[own], f"{module.name} imports {name}"


@each_module
def test_limited_packages_keep_their_limits(module: Module) -> None:
    allowed = LIMITED_TO.get(module.package)
    if allowed is not None:
        assert {package(name) for name in imported_modules(module)} <= allowed


@pytest.mark.parametrize(
    "module", [m for m in modules() if m.package == "passes"], ids=lambda m: m.name
)
def test_passes_do_not_import_each_other(module: Module) -> None:
    others = {name for name in imported_modules(module) if package(name) == "passes"}
    assert others <= SHARED_PASSES, module.name


@each_module
def test_simgl_never_imports_its_bridge(module: Module) -> None:
    assert not [name for name in imports(module) if name.startswith("simgl_bridge")]


def test_no_two_modules_import_each_other() -> None:
    links = {m.name: imported_modules(m) - {m.name} for m in modules()}
    done: set[str] = set()

    def visit(name: str, chain: tuple[str, ...]) -> None:
        assert name not in chain, " -> ".join((*chain, name))
        if name not in done:
            for other in sorted(links[name]):
                visit(other, (*chain, name))
            done.add(name)

    for name in links:
        visit(name, ())


def test_no_file_name_is_used_twice() -> None:
    names = Counter(m.path.stem for m in modules() if m.path.stem not in ("__init__", "__main__"))
    assert not [name for name, count in names.items() if count > 1]
