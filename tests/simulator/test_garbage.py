"""Native objects end where they are closed: none is left to the garbage collector.

That runs in whichever thread happens to allocate, and OpenGL is bound to its thread.
"""

from __future__ import annotations

import gc
import tomllib
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from weakref import WeakSet, ref

import pytest

from simgl import (
    ALL_PRODUCTS,
    Scenario,
    Simulator,
    garbage_collection,
    load_model,
    load_scenario,
    scenario_from_dict,
)
from simgl.errors import ConfigError
from simgl.gpu.context import temporary_context
from simgl.rays import RayTracer
from tests.campaign.small import SCENE as LAMP_SCENE

# Modules whose objects are native, or own native ones.
_NATIVE = ("moderngl", "_moderngl", "glcontext", "embreex")
_OWNERS = ("simgl.gpu", "simgl.passes", "simgl.rays", "simgl.rendering.renderer", "simgl.simulator")
# An even Earth with air, and stars.
_ORBIT = """\
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
shape = "sphere"
radius_km = 6371.0
albedo = 0.3
atmosphere = "standard"
[spacecraft.target]
model = "wedge"
orbit = { altitude_km = 400.0 }
[camera.nav]
about = { target = "target", azimuth_deg = 30.0, range_m = 12.0 }
width_px = 64
height_px = 48
"""


@contextmanager
def collected() -> Iterator[Counter[str]]:
    """Counts, by type, what the collector finds in cycles that the block has left behind."""
    found: Counter[str] = Counter()
    gc.collect()
    gc.disable()
    flags = gc.get_debug()
    gc.set_debug(gc.DEBUG_SAVEALL)
    try:
        yield found
        gc.collect()
        found.update(f"{type(o).__module__}.{type(o).__qualname__}" for o in gc.garbage)
    finally:
        gc.set_debug(flags)
        gc.garbage.clear()
        gc.enable()


def native(found: Counter[str]) -> dict[str, int]:
    """The native objects, and the owners of such, among what was found."""
    return {name: n for name, n in found.items() if name.split(".")[0] in _NATIVE
            or name.startswith(_OWNERS)}  # fmt: skip


def run(scenario: Scenario) -> None:
    """Open a simulator, draw everything, close it."""
    with Simulator(scenario) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        simulator.capture(state, "nav", ALL_PRODUCTS)


@pytest.mark.parametrize("text", [_ORBIT, LAMP_SCENE], ids=["orbit", "lamp"])
def test_a_closed_simulator_leaves_no_native_object_to_the_collector(
    text: str, tmp_path: Path
) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(text)
    scenario = load_scenario(path)
    # What a process does once may leave cycles of its own.
    run(scenario)
    with collected() as found:
        run(scenario)
    assert not native(found)


def test_a_simulator_that_fails_leaves_no_native_object(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(LAMP_SCENE)
    scenario = load_scenario(path)
    nav = scenario.cameras["nav"]
    too_large = replace(nav, detector=replace(nav.detector, width=10**6, height=10**6))
    refused = replace(scenario, cameras={"nav": too_large})
    with collected() as found, pytest.raises(ConfigError):
        Simulator(refused)
    assert not native(found)


def test_a_ray_tracer_ends_with_its_last_user() -> None:
    mesh = load_model("wedge").mesh
    with collected() as found:
        assert RayTracer(mesh).occluded([[0.0, 0.0, -9.0]], [[0.0, 0.0, 1.0]]).shape == (1,)
    assert not native(found)


def test_a_context_is_closed_without_the_collector() -> None:
    with collected() as found, temporary_context() as ctx:
        ctx.buffer(reserve=16).release()
        del ctx
    assert not native(found)


class Holder:
    pass


def passed_over(thing: object) -> bool:
    """Whether full collections do not look at an object."""
    return all(thing is not known for known in gc.get_objects())


def test_full_collections_pass_over_what_simulators_need(monkeypatch: pytest.MonkeyPatch) -> None:
    # Other tests of this process may have simulators open.
    monkeypatch.setattr(garbage_collection, "_HOLDERS", WeakSet())
    scene = scenario_from_dict(tomllib.loads(LAMP_SCENE))
    gc.unfreeze()
    assert not passed_over(scene)
    with Simulator(scene):
        with Simulator(scene):
            assert passed_over(scene)
        assert passed_over(scene)
    assert not passed_over(scene)


def test_cycles_that_a_holder_kept_from_the_collector_end_after_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(garbage_collection, "_HOLDERS", WeakSet())
    cycle, holder = Holder(), Holder()
    cycle.itself = cycle  # type: ignore[attr-defined]
    ended = ref(cycle)
    garbage_collection.leave_out_of_collections(holder)
    del cycle
    gc.collect()
    assert ended() is not None
    garbage_collection.collect_again(holder)
    garbage_collection.collect_again(holder)
    gc.collect()
    assert ended() is None
