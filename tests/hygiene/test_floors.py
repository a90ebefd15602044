"""The house stands: imports only go down, and neighbours keep to themselves."""

from __future__ import annotations

import pytest

from tests.hygiene.source import Module, imported_modules, imports, modules

# Floor of each room below simgl/. The package itself is the front door, above all that it shows.
FLOORS = {
    "errors": 0,
    "assets": 0,
    "cache": 0,
    "steps": 0,
    "kept": 0,
    "physics": 1,
    "scene": 2,
    "lattice": 2,
    "sky": 2,
    "ephemerides": 3,
    "scenario": 3,
    "sensor": 3,
    "reference": 3,
    "rays": 3,
    "transport": 3,
    "levels": 3,
    "optics": 3,
    "view": 3,
    "shapes": 3,
    "images": 3,
    "false_colour": 4,
    "receiver": 4,
    "gpu": 3,
    "generate": 3,
    "passes": 4,
    "renderer": 5,
    "imager": 5,
    "progress": 6,
    "simulator": 6,
    "output": 6,
    "maps": 7,
    "assess": 7,
    "bench": 7,
    "campaign": 7,
    "crew": 7,
    "sequence": 7,
    "doctor": 7,
    "inspection": 7,
    "viewer": 7,
    "": 7,
    "cli": 8,
    "__main__": 9,
}

# Rooms of one floor that may look into each other, one way.
NEIGHBOURS = {
    ("assets", "errors"),
    ("assess", "sequence"),
    ("assess", "crew"),
    ("assess", "maps"),
    ("campaign", "crew"),
    ("campaign", "sequence"),
    ("output", "simulator"),
    ("progress", "simulator"),
    ("images", "optics"),
    ("scenario", "optics"),
    ("view", "optics"),
    ("scenario", "ephemerides"),
    ("view", "rays"),
    ("view", "transport"),
    ("transport", "rays"),
    ("levels", "rays"),
    ("shapes", "levels"),
    ("shapes", "transport"),
    ("shapes", "view"),
    ("reference", "sensor"),
    ("images", "sensor"),
}

# Where a room may look is less than its floor allows.
KEPT_APART = {
    # Knows OpenGL, not spacecraft.
    "gpu": {"errors", "assets", "kept", "gpu"},
    # Textbook formulas, whatever draws them.
    "reference": {"errors", "physics", "scene", "sensor", "reference"},
    # What the camera does besides the passes, alike for them and the references.
    "sensor": {"errors", "physics", "scene", "sensor"},
    # Runs by itself, to make the files that the others read.
    "generate": {"errors", "assets", "physics", "generate"},
}

# Shared by passes; every other pass stands alone.
SHARED_PASSES = {
    "simgl.passes.air",
    "simgl.passes.air_tables",
    "simgl.passes.blocks",
    "simgl.passes.discs",
    "simgl.passes.earth_maps",
    "simgl.passes.earth_textures",
    "simgl.passes.lobes",
    "simgl.passes.meshes",
    "simgl.passes.outline",
    "simgl.passes.planet_blocks",
    "simgl.passes.textures",
    "simgl.passes.weather",
}

each_module = pytest.mark.parametrize("module", modules(), ids=lambda m: m.name)


def room(name: str) -> str:
    """The first name below ``simgl``."""
    return name.partition(".")[2].partition(".")[0]


@each_module
def test_every_room_has_a_floor(module: Module) -> None:
    assert module.room in FLOORS, f"say in FLOORS where {module.room} stands"


@each_module
def test_imports_only_go_down(module: Module) -> None:
    for name in imported_modules(module):
        own, other = module.room, room(name)
        below = FLOORS[other] < FLOORS[own]
        message = f"{module.name} (floor {FLOORS[own]}) imports {name} (floor {FLOORS[other]})"
        assert below or own == other or (own, other) in NEIGHBOURS, message


@each_module
def test_rooms_that_are_kept_apart_stay_apart(module: Module) -> None:
    allowed = KEPT_APART.get(module.room)
    if allowed is not None:
        assert {room(name) for name in imported_modules(module)} <= allowed


@pytest.mark.parametrize(
    "module", [m for m in modules() if m.room == "passes"], ids=lambda m: m.name
)
def test_passes_do_not_import_each_other(module: Module) -> None:
    others = {name for name in imported_modules(module) if room(name) == "passes"}
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
