"""The architecture holds: imports only go down from layer to layer, and passes stand alone."""

from __future__ import annotations

from collections import Counter

from tests.hygiene.source import imported_modules, imports, modules

# Packages and modules directly below simgl/, lowest layer first. A package may import from every
# lower layer, and from itself. "" is the public interface, simgl/__init__.py.
LAYERS = (
    (
        "arrays",
        "blas_threads",
        "content_digest",
        "errors",
        "garbage_collection",
        "interruption",
        "lru_cache",
        "next_step",
        "progress",
    ),
    (
        "assets",
        "background_work",
        "decoded_files",
        "html_table",
        "input_files",
        "sample_grid",
        "sparse_arrays",
    ),
    ("disk_cache", "file_cache", "gpu", "physics"),
    ("config", "display_colours", "environment_map", "motion", "value_checks"),
    ("camera", "glossy_sky"),
    ("display_images", "mono12p", "products", "scene"),
    ("images", "model_files", "rays"),
    ("flash_lidar", "radiosity", "scenario"),
    ("thermal", "view"),
    ("passes",),
    ("rendering",),
    ("simulator",),
    ("cli_progress", "output", "workers"),
    ("figures", "video"),
    (
        "doctor",
        "inspection",
        "ros2",
        "sequence",
        "shipped_examples",
        "viewer",
        "web",
    ),
    ("assess", "bench", "campaign"),
    ("", "commands"),
    ("cli",),
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
    "simgl.passes.background.air_march",
    "simgl.passes.background.air_nodes",
    "simgl.passes.background.air_tables",
    "simgl.passes.background.cloud_map",
    "simgl.passes.background.discs",
    "simgl.passes.background.earth_draws",
    "simgl.passes.background.earth_maps",
    "simgl.passes.background.earth_textures",
    "simgl.passes.background.lit_earth",
    "simgl.passes.background.map_levels",
    "simgl.passes.background.planet_blocks",
    "simgl.passes.background.planet_programs",
    "simgl.passes.background.planet_variants",
    "simgl.passes.background.tile_kinds",
    "simgl.passes.background.earth_air",
    "simgl.passes.caster_bounds",
    "simgl.passes.caster_planes",
    "simgl.passes.caster_slabs",
    "simgl.passes.drawn_spacecraft",
    "simgl.passes.even_squares",
    "simgl.passes.mesh_store",
    "simgl.passes.outline_program",
    "simgl.passes.page_numbers",
    "simgl.passes.shading_points",
    "simgl.passes.shared_blocks",
    "simgl.passes.tasks_ahead",
    "simgl.passes.texture_store",
    "simgl.passes.vertex_sums",
    "simgl.passes.view_blocks",
}


def package(name: str) -> str:
    """The first name below ``simgl``."""
    return name.partition(".")[2].partition(".")[0]


def test_every_package_has_a_layer() -> None:
    without = {m.package for m in modules()} - set(LAYER)
    assert not without, "say in LAYERS where they belong"


def test_imports_only_go_down() -> None:
    upwards = [
        f"{module.name} imports {name}"
        for module in modules()
        for name in sorted(imported_modules(module))
        if module.package != package(name) and LAYER[package(name)] >= LAYER[module.package]
    ]
    assert not upwards


def test_limited_packages_keep_their_limits() -> None:
    beyond = [
        f"{module.name} imports {name}"
        for module in modules()
        for name in sorted(imported_modules(module))
        if package(name) not in LIMITED_TO.get(module.package, LAYER)
    ]
    assert not beyond


def test_passes_do_not_import_each_other() -> None:
    imported = [
        f"{module.name} imports {name}"
        for module in modules()
        for name in sorted(imported_modules(module) - SHARED_PASSES)
        if module.package == "passes" == package(name)
    ]
    assert not imported


def test_simgl_never_imports_its_bridge() -> None:
    importing = [
        m.name for m in modules() if any(name.startswith("simgl_bridge") for name in imports(m))
    ]
    assert not importing


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
