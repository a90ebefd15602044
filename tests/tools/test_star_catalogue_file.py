"""The catalogue's generator reads the lines of hip2.dat."""

from __future__ import annotations

import numpy as np

from tools.star_catalogue import catalogue, johnson_v


def line(hip: int, hp: float, b_v: float, *, error: float = 0.01, v_i: float = 0.5) -> str:
    """A line in the columns of hip2.dat; what is not read is left blank."""
    text = [" "] * 172
    fields = {
        0: f"{hip:6d}",
        15: f"{1.5:13.10f}",
        29: f"{-0.25:13.10f}",
        43: f"{50.0:7.2f}",
        51: f"{-100.0:8.2f}",
        60: f"{200.0:8.2f}",
        129: f"{hp:7.4f}",
        152: f"{b_v:6.3f}",
        159: f"{error:5.3f}",
        165: f"{v_i:6.3f}",
    }
    for start, field in fields.items():
        text[start : start + len(field)] = field
    return "".join(text)


def test_stars_come_brightest_first_and_faint_ones_are_left_out() -> None:
    text = "\n".join([line(1, 5.0, 0.65), line(2, 9.0, 0.65), line(3, 2.0, 1.5, v_i=9.0)])
    stars = catalogue(text)
    np.testing.assert_array_equal(stars["hip"], [3, 1])
    turn = 2.0**32 / (2.0 * np.pi)
    np.testing.assert_array_equal(stars["right_ascension"], np.round([1.5 * turn] * 2))
    np.testing.assert_array_equal(stars["declination"], np.round([-0.25 * turn] * 2))
    np.testing.assert_array_equal(stars["motion_mas_per_year"], [[-100.0, 200.0]] * 2)
    np.testing.assert_array_equal(stars["parallax_mas"], [50.0] * 2)
    # The colour of a variable at its faintest is held.
    np.testing.assert_array_equal(stars["v_i"], [5000, 500])


def test_saturated_and_uncoloured_stars_take_other_values() -> None:
    stars = catalogue("\n".join([line(32349, -1.0876, 0.009), line(7, 6.0, 0.0, error=0.0)]))
    np.testing.assert_array_equal(stars["v"][0], -1460)
    np.testing.assert_array_equal(stars["b_v"], [0, 550])
    np.testing.assert_array_equal(stars["v_i"][1], 620)


def test_v_of_a_sunlike_star_is_brighter_than_hp() -> None:
    # Bessell (2000), table 2: V - Hp = -0.137 at BT-VT 0.8, B-V 0.715; Harmanec's -0.140.
    difference = johnson_v(np.array([5.0]), np.array([0.715])) - 5.0
    np.testing.assert_allclose(difference, -0.137, atol=0.01)
