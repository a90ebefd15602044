"""The air's tables in files, their axes in both languages, and the tables of views."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.disk_cache import cache_folder
from simgl.passes.background import air_march, air_nodes, air_tables
from simgl.passes.background.air_nodes import HEIGHTS, NO_NODE, PARTS, SLOTS, Nodes
from simgl.passes.background.air_tables import AIR, TABLES, AirKind, make_tables, tables_of
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.atmosphere import SOURCE
from simgl.physics.skylight import Rings, table_heights, table_suns
from tests.gpu.glsl_functions import evaluate
from tests.passes.air_scenes import RADIUS, planet_view, sphere, window

KIND = AirKind(air=SOURCE, radius=RADIUS, albedo=(0.3,) * 4)


@pytest.fixture
def _quick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(air_tables, "ORDERS", 2)
    monkeypatch.setattr(air_tables, "_FIRST", Rings(3, 3, 3, 4))
    monkeypatch.setattr(air_tables, "_NEXT", Rings(3, 3, 3, 4))


@pytest.mark.usefixtures("_quick")
def test_tables_are_found_again_bit_for_bit(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[int, int]] = []
    first = tables_of(gl, KIND, lambda *done: calls.append(done))
    assert calls[-1] == (air_tables.ORDERS, air_tables.ORDERS)
    monkeypatch.setattr(air_tables, "make_tables", None)
    again = tables_of(gl, KIND)
    assert set(again) == set(TABLES)
    for name in TABLES:
        np.testing.assert_array_equal(again[name], first[name])


@pytest.mark.usefixtures("_quick")
@pytest.mark.parametrize("damage", ["half", "text", "flipped", "nan"])
def test_a_damaged_file_is_made_anew(gl: moderngl.Context, damage: str) -> None:
    whole = tables_of(gl, KIND)
    (path,) = cache_folder("air").iterdir()
    content = bytearray(path.read_bytes())
    if damage == "nan":
        bad = {**whole, "diffuse_down": np.full_like(whole["diffuse_down"], np.nan)}
        with path.open("wb") as file:
            np.savez(file, **bad)  # type: ignore[arg-type]
    elif damage == "flipped":
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
    else:
        path.write_bytes(content[: len(content) // 2] if damage == "half" else b"not arrays")
    again = tables_of(gl, KIND)
    for name in TABLES:
        np.testing.assert_array_equal(again[name], whole[name])
    assert list(cache_folder("air").iterdir()) == [path]


@pytest.mark.usefixtures("_quick")
def test_other_parameters_and_other_shaders_are_other_files(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    tables_of(gl, KIND)
    tables_of(gl, AirKind(air=SOURCE, radius=RADIUS, albedo=(0.2,) * 4))
    monkeypatch.setattr(air_tables, "_SHADERS", ("medium",))
    tables_of(gl, KIND)
    assert len(list(cache_folder("air").iterdir())) == 3


def test_the_shaders_keep_heights_and_suns_where_numpy_does(gl: moderngl.Context) -> None:
    heights, suns = table_heights() / 1e3, table_suns()
    rows = np.stack(
        [np.resize(heights, 96), suns, np.arange(96) + 0.5, np.resize(np.arange(32), 96) + 0.5],
        axis=1,
    ).astype(np.float32)
    expression = (
        "vec4(diffuse_place(in_value[0], in_value[1], vec2(96.0, 32.0)) * vec2(96.0, 32.0),"
        " table_place(0.5, 3.0), 0.0)"
    )
    # air_top is read from the block, which evaluate() leaves unset: given as a constant instead.
    got = evaluate(
        gl,
        ["air/places.glsl"],
        expression,
        rows,
        declarations=_with_air_top("air/diffuse_place.glsl"),
    )
    # A thousandth of a texel: the tables' gradients are at most some tens of per cent a texel.
    np.testing.assert_allclose(got[:, 0], rows[:, 2], atol=2e-3)
    np.testing.assert_allclose(got[:, 1], rows[:, 3], atol=2e-3)


def _with_air_top(name: str) -> str:
    text = (Path(__file__).parents[2] / "shaders" / name).read_text("utf-8")
    kept = [line for line in text.splitlines() if not line.startswith("#include")]
    return f"const float air_top = {AIR_TOP / 1e3};\n" + "\n".join(kept)


def test_no_orders_are_no_diffuse_light(gl: moderngl.Context) -> None:
    tables = make_tables(gl, KIND, orders=0)
    assert all(not tables[name].any() for name in TABLES if name.startswith("diffuse"))
    vertical = np.array(SOURCE.rayleigh) + np.array(SOURCE.aerosol)
    # The profiles end at 100 km, which takes exp(-12.5) of the depth.
    np.testing.assert_allclose(tables["transmittance_table"][0, 0], np.exp(-vertical), rtol=1e-4)
    assert AIR.dtype.itemsize % 16 == 0


def marched_nodes(nodes: Nodes) -> int:
    """Parts of tables of light that are cached."""
    return int(np.count_nonzero(nodes.cached != NO_NODE))


def at_sun(look: Any, height: float, sun_deg: float, view: np.ndarray) -> int:
    """How many parts of tables are cached after a picture from a height [m]."""
    up, north = np.eye(3)[:2]
    z = np.radians(sun_deg)
    look.ray(sphere(0.3), (RADIUS + height) * up, view, np.cos(z) * up + np.sin(z) * north)
    return sum(marched_nodes(nodes) for nodes in look.air._nodes.values())


def test_pictures_from_one_place_share_tables_and_others_do_not(gl: moderngl.Context) -> None:
    up, north = np.eye(3)[:2]
    with window(gl) as look:
        # Of two nodes at each side of the Sun.
        assert at_sun(look, 400e3, 30.0, -up) == 4 * PARTS
        assert at_sun(look, 400e3, 30.0, north - 0.5 * up) == 4 * PARTS
        # A spacecraft 20 m away sees the same air.
        assert at_sun(look, 400.02e3, 30.0, north - 0.5 * up) == 4 * PARTS
        # The Sun passes a node of every part: 8 x 2^-8 rad where it is high.
        assert at_sun(look, 400e3, 30.0 + 1.7905, -up) == 5 * PARTS
        assert at_sun(look, 402e3, 30.0, -up) == 9 * PARTS
        for index in range(12):
            at_sun(look, 400e3, 70.0 + index, -up)
        assert at_sun(look, 402e3, 30.0, -up) == (SLOTS + 4) * PARTS
        for index in range(HEIGHTS + 2):
            at_sun(look, (404 + 2 * index) * 1e3, 30.0, -up)
        assert at_sun(look, 450e3, 30.0, -up) == 4 * HEIGHTS * PARTS


# 2^-8 rad are 34 frames; where it is day somewhere in sight they are twice as many, and where the
# Sun is high over all that is seen eight times.
@pytest.mark.parametrize(
    ("sun_deg", "frames_a_node"), [(112.0, 34.0), (70.0, 2 * 34.0), (30.0, 8 * 34.0)]
)
def test_no_frame_of_an_even_motion_marches_more_than_an_eighth_of_a_table(
    gl: moderngl.Context, sun_deg: float, frames_a_node: float
) -> None:
    """0.1 s apart on the way round at 400 km; and the table is a picture's alone, whatever was
    drawn before."""
    up = np.eye(3)[0]
    with window(gl) as look:
        counts = [at_sun(look, 400e3, sun_deg + 0.0066 * frame, -up) for frame in range(24)]
        moved = look.air._views.values()[-1].read()
    marched = np.diff(counts)
    assert marched.max() <= PARTS // 8
    assert marched.sum() == pytest.approx(23 * PARTS / frames_a_node, abs=2)
    with window(gl) as look:
        at_sun(look, 400e3, sun_deg + 0.0066 * 23, -up)
        (alone,) = look.air._views.values()
        np.testing.assert_array_equal(alone.read(), moved)


def test_no_image_of_an_even_climb_marches_a_whole_table(gl: moderngl.Context) -> None:
    """Steps of 2^-8 of 400 km in 40 images each; and the table is an image's alone, whatever was
    marched before."""
    up, north = np.eye(3)[:2]
    sun = np.cos(0.5) * up + np.sin(0.5) * north
    start = air_nodes._height_of(round(air_nodes.height_place(400e3)) - 0.49)
    heights = start * np.exp(2.0**-8 * np.arange(90) / 40.0)
    marched: list[int] = []
    with window(gl) as look:
        for height in heights:
            place = (RADIUS + height) * up
            look.air.ahead(planet_view(sphere(0.3), place, -up, sun), "camera")
            look.ray(sphere(0.3), place, -up, sun)
            tables = look.air._nodes.values()
            marched.append(sum(marched_nodes(one) + len(one.transmitting) for one in tables))
        climbed = look.air._views.values()[-1].read()
    whole = 5 * PARTS
    assert marched[0] == whole
    # Three tables in all, two of them while those before serve: 1/40 in each image.
    assert marched[-1] >= 3 * whole
    assert np.diff(marched).max() <= whole // 16
    with window(gl) as look:
        look.ray(sphere(0.3), (RADIUS + heights[-1]) * up, -up, sun)
        (alone,) = look.air._views.values()
        np.testing.assert_array_equal(alone.read(), climbed)


def test_tables_of_the_next_height_are_marched_once_where_the_sun_moves_on(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Images 5 s apart, in each of which the Sun passes a node or two and of which twelve make a
    step of height: for the Sun that comes with that step, not for those before it."""
    up, north = np.eye(3)[:2]
    angles = np.radians(85.0 + 0.3255 * np.arange(80))
    heights = 400e3 * np.exp(2.0**-10 * np.arange(80) / 12.0)
    marched = 0

    def images(look: Any, *, ahead: bool) -> int:
        nonlocal marched
        marched = 0
        for height, angle in zip(heights, angles, strict=True):
            sun, place = np.cos(angle) * up + np.sin(angle) * north, (RADIUS + height) * up
            if ahead:
                look.air.ahead(planet_view(sphere(0.3), place, -up, sun), "camera")
            look.ray(sphere(0.3), place, -up, sun)
        return marched

    fill = air_march.AirMarch.fill

    def counted(self: air_march.AirMarch, *given: Any) -> None:
        nonlocal marched
        marched += 1
        fill(self, *given)

    monkeypatch.setattr(air_march.AirMarch, "fill", counted)
    with window(gl) as look:
        needed = images(look, ahead=False)
    with window(gl) as look:
        made = images(look, ahead=True)
    # Of the seventh step, which no image reaches, up to a whole table; and where the angle at which
    # a step begins is an image off, an image's nodes, two at most, in each of the other steps.
    assert needed <= made <= needed + 5 * PARTS + 6 * 2 * PARTS
    # Each of these steps takes a table.
    assert needed >= 7 * 5 * PARTS


def test_a_way_back_finds_the_same_tables(gl: moderngl.Context) -> None:
    """Nodes that were overwritten by those of a Sun far off are marched again."""
    up = np.eye(3)[0]

    def light(look: Any) -> np.ndarray:
        look.air._views.clear()
        look.air._last = None
        at_sun(look, 400e3, 75.05, -up)
        return look.air._views.values()[-1].read()

    with window(gl) as look:
        first = light(look)
        for index in range(3 * SLOTS):
            at_sun(look, 400e3, 60.0 + 0.3 * index, -up)
        np.testing.assert_array_equal(light(look), first)


@pytest.mark.parametrize("height", [2.0, 400e3, 36e6])
@pytest.mark.parametrize("sun_deg", [10.3, 47.7, 60.1, 92.1])
def test_between_two_nodes_the_light_is_that_of_the_sun_there(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, height: float, sun_deg: float
) -> None:
    mixed = _view_light(gl, height, sun_deg)
    monkeypatch.setattr("simgl.passes.background.air_nodes._NODE_STEP", 2.0**-14)
    marched = _view_light(gl, height, sun_deg)
    there = marched > 1e-3 * marched.max()
    off = np.abs(mixed[there] / marched[there] - 1.0)
    # Roots of light that falls by e in 1.5 degrees, a cubic over 0.22 degrees: less than
    # 0.01 %, and the march's own noise where the Earth's shadow crosses the ray.
    assert np.median(off) < 1e-3
    assert np.percentile(off, 99.0) < 1e-2


@pytest.mark.parametrize("height", [400e3, 36e6])
@pytest.mark.parametrize("sun_deg", [20.3, 72.4, 104.5])
def test_fewer_azimuths_nodes_and_diffuse_lights_show_nowhere(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, height: float, sun_deg: float
) -> None:
    """From space an image's table is within 1e-3 rms of its light of one that is marched at every
    azimuth, at the Sun's own angle, with the diffuse light of every cell."""
    table = _view_light(gl, height, sun_deg)
    monkeypatch.setattr(air_nodes, "_NODE_STEP", 2.0**-14)
    monkeypatch.setattr(air_nodes, "_FROM_LOW_ORBIT", air_nodes.COLUMNS)
    monkeypatch.setattr(air_march, "_DIFFUSE_CELLS", 1)
    marched = _view_light(gl, height, sun_deg)
    assert np.sqrt(np.mean((table - marched) ** 2) / np.mean(marched**2)) < 1e-3


@pytest.mark.parametrize("height", [200e3, 400e3, 36e6])
@pytest.mark.parametrize("sun_deg", [75.0, 96.0, 105.0, 111.0])
def test_half_a_step_of_height_shows_nowhere(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, height: float, sun_deg: float
) -> None:
    """Where a camera passes from one step to the next no image jumps by a thousandth.

    The light falls by e in 1.5 degrees of the Sun, and half a step moves the limb by 0.02 degrees:
    without the way to the height of the nodes, 1.4 %.
    """
    edge = air_nodes._height_of(round(air_nodes.height_place(height)) + 0.499)
    table = _view_light(gl, edge, sun_deg)
    monkeypatch.setattr(air_nodes, "_HEIGHT_STEP", 2.0**-20)
    marched = _view_light(gl, edge, sun_deg)
    assert np.sqrt(np.mean((table - marched) ** 2) / np.mean(marched**2)) < 1e-3
    assert table.sum() == pytest.approx(marched.sum(), rel=5e-4)


def _view_light(gl: moderngl.Context, height: float, sun_deg: float) -> np.ndarray:
    up, north = np.eye(3)[:2]
    z = np.radians(sun_deg)
    with window(gl) as look:
        look.ray(sphere(0.3), (RADIUS + height) * up, -up, np.cos(z) * up + np.sin(z) * north)
        (target,) = look.air._views.values()
        return target.read().astype(np.float64) ** 4


def test_light_deep_in_the_night_is_a_number(gl: moderngl.Context) -> None:
    for sun_deg in (100.0, 101.0, 105.0):
        assert np.isfinite(_view_light(gl, 2.0, sun_deg)).all()
