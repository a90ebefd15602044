"""Tables that depend on no scenario: computed once on a machine, the same bytes from the file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from simgl import environment_map, glossy_sky
from simgl.arrays import Array32
from simgl.disk_cache import cache_folder
from simgl.environment_map import SkyRadiance, irradiance
from simgl.glossy_sky import prefiltered
from simgl.passes import albedo_table
from simgl.physics.directional_albedo import lobe_table

MAKERS = {"_made_irradiance_operator": environment_map, "_made_lobe_operator": glossy_sky}


def _forget() -> None:
    environment_map._irradiance_operator.cache_clear()
    glossy_sky.prepare_lobes.cache_clear()


@pytest.fixture(autouse=True)
def _empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    _forget()
    yield
    _forget()


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the makers, as they are called."""
    calls: list[str] = []
    for name, module in MAKERS.items():
        make = getattr(module, name)

        def counted(*given: object, name: str = name, make: object = make) -> object:
            calls.append(name)
            return make(*given)  # type: ignore[operator]

        monkeypatch.setattr(module, name, counted)
    return calls


def light() -> tuple[Array32, Array32]:
    """Of a sky of noise, in a process that has computed nothing."""
    _forget()
    noise = np.random.default_rng(5).uniform(0.0, 9.0, (6, 64, 64, 4)).astype(np.float32)
    sky = SkyRadiance(radiance=noise)
    plane = irradiance(sky)
    return plane, prefiltered(sky, plane)


def test_earthshine_is_the_same_by_tables_from_files(computed: list[str]) -> None:
    first = light()
    assert sorted(computed) == ["_made_irradiance_operator", *["_made_lobe_operator"] * 4]
    computed.clear()
    for again, before in zip(light(), first, strict=True):
        np.testing.assert_array_equal(again, before)
    assert computed == []
    # The other size of a sky shares the lobes.
    assert len(list(cache_folder("tables").iterdir())) == 2


def test_tables_that_point_nowhere_are_computed_again(computed: list[str]) -> None:
    first = light()
    computed.clear()
    for path in cache_folder("tables").iterdir():
        with np.load(path) as file:
            arrays = dict(file)
        for name, array in arrays.items():
            if name.endswith("indices"):
                array[len(array) // 2] = 1 << 30
        with path.open("wb") as damaged:
            np.savez(damaged, **arrays)
    for again, before in zip(light(), first, strict=True):
        np.testing.assert_array_equal(again, before)
    assert len(computed) == 5


def test_the_albedo_of_lobes_is_computed_once(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, made = albedo_table.lobe_texture(gl), lobe_table()
    monkeypatch.setattr(albedo_table, "lobe_table", None)
    second = albedo_table.lobe_texture(gl)
    assert first.read() == second.read() == made.tobytes()
    first.release()
    second.release()
