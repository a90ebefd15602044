"""Steps of a thermal network: the balance of each, and the response to a change of light."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.integrate import solve_ivp

from simgl.arrays import Array
from simgl.physics.constants import STEFAN_BOLTZMANN
from simgl.thermal.network import SPACE_TEMPERATURE, ThermalNetwork


def lumped(capacity: float = 2000.0, area: float = 0.85) -> ThermalNetwork:
    """One node that radiates to space."""
    none = sparse.csr_matrix((1, 1))
    return ThermalNetwork(
        capacity=np.array([capacity]), conduction=none, coupling=none, to_space=np.array([area])
    )


def random_network(count: int, seed: int) -> ThermalNetwork:
    """Nodes that conduct and radiate to some others."""
    rng = np.random.default_rng(seed)

    def pairs(scale: float) -> sparse.csr_matrix:
        half = sparse.random(count, count, 8.0 / count, random_state=rng) * scale
        both = sparse.csr_matrix(half + half.T)
        both.setdiag(0.0)
        both.eliminate_zeros()
        return sparse.csr_matrix(both)

    conductances = pairs(0.5)
    sums = np.asarray(conductances.sum(axis=1)).ravel()
    return ThermalNetwork(
        capacity=rng.uniform(1.0, 300.0, count),
        conduction=sparse.csr_matrix(sparse.diags_array(sums) - conductances),
        coupling=pairs(0.01),
        to_space=rng.uniform(0.0, 0.05, count),
    )


@pytest.mark.parametrize("seconds", [0.1, 10.0, 1000.0])
def test_each_implicit_step_closes_the_heat_balance(seconds: float) -> None:
    network = random_network(300, 1)
    rng = np.random.default_rng(2)
    t = rng.uniform(150.0, 400.0, 300)
    for _ in range(5):
        heat = rng.uniform(0.0, 30.0, 300)
        after = network.implicit_step(t, heat, seconds)
        stored = float(network.capacity @ (after - t)) / seconds
        fourth = STEFAN_BOLTZMANN * (after**4 - SPACE_TEMPERATURE**4)
        lost = float(network.to_space @ fourth)
        # What comes in is stored or leaves to space; exchange within cancels.
        assert abs(heat.sum() - stored - lost) < 1e-6 * (heat.sum() + lost)
        t = after


def test_a_step_is_a_pure_function() -> None:
    network, other = random_network(50, 3), random_network(50, 3)
    t, heat, more = np.full(50, 300.0), np.full(50, 5.0), np.full(50, 6.0)
    first = network.step(t, heat, more, 10.0)
    network.step(np.full(50, 270.0), heat, heat, 10.0)
    network.step(np.full(50, 200.0), heat, heat, 3.0)
    np.testing.assert_array_equal(network.step(t, heat, more, 10.0), first)
    np.testing.assert_array_equal(other.step(t, heat, more, 10.0), first)


def two_levels(time: float, period: float) -> float:
    """Sunlight for 60 % of an orbit [W]."""
    return 400.0 if time % period < 0.6 * period else 60.0


def test_a_lumped_sphere_follows_a_two_level_orbit() -> None:
    # Emission of T^4 leaves a transcendental law; an 8th-order Runge-Kutta method to 1e-9 is exact.
    network, period = lumped(), 5600.0
    start, step = 280.0, 20.0

    def rate(_: float, t: Array, heat: float) -> Array:
        fourth = STEFAN_BOLTZMANN * (t**4 - SPACE_TEMPERATURE**4)
        return (heat - network.to_space * fourth) / network.capacity

    exact, t, now = np.array([start]), np.array([start]), 0.0
    for length, heat in ((0.6 * period, 400.0), (0.4 * period, 60.0)) * 2:
        run = solve_ivp(rate, (0.0, length), exact, "DOP853", args=(heat,), rtol=1e-9, atol=1e-9)
        exact = run.y[:, -1]
        for _ in range(round(length / step)):
            assert two_levels(now, period) == heat
            t = network.step(t, np.array([heat]), np.array([heat]), step)
            now += step
        # Of the second order: the rate of at most 0.1 K s-1 changes within 100 s, so that a step
        # of 20 s is off by a fifth squared of half its change of 2 K, once.
        assert abs(float(t[0] - exact[0])) < 0.04


def test_cooling_in_the_dark_has_a_closed_form() -> None:
    network = lumped()
    network = ThermalNetwork(
        capacity=network.capacity,
        conduction=network.conduction,
        coupling=network.coupling,
        to_space=network.to_space,
        space_temperature=1e-3,
    )
    t, step, seconds = np.array([350.0]), 30.0, 3000.0
    for _ in range(round(seconds / step)):
        t = network.step(t, np.zeros(1), np.zeros(1), step)
    rate = 3.0 * STEFAN_BOLTZMANN * float(network.to_space[0] / network.capacity[0])
    exact = (350.0**-3 + rate * seconds) ** (-1.0 / 3.0)
    # As above: 0.36 K s-1 at first, which halves in 400 s.
    assert float(t[0]) == pytest.approx(exact, abs=0.05)


def test_half_a_step_has_a_quarter_of_the_error() -> None:
    network, dark = lumped(), np.zeros(1)

    def after_1200_s(step: float) -> float:
        t = np.array([350.0])
        for _ in range(round(1200.0 / step)):
            t = network.step(t, dark, dark, step)
        return float(t[0])

    full, half, quarter = (after_1200_s(step) for step in (40.0, 20.0, 10.0))
    # Between 2 (first order) and 8 (third); 1/n of the step is what the next order adds.
    assert (full - half) / (half - quarter) == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("seconds", [10.0, 30.0, 200.0, 3000.0])
@pytest.mark.parametrize(("before", "after"), [(600.0, 60.0), (60.0, 600.0)])
def test_a_foil_follows_the_light_within_a_long_step(
    before: float, after: float, seconds: float
) -> None:
    # It stores 60 J K-1: by day it follows within 20 s, at night within 140 s.
    foil, first, last = lumped(capacity=60.0), np.array([before]), np.array([after])
    start = foil.steady(first)
    exact, parts = start, 400
    for number in range(parts):
        a, b = (first + (last - first) * n / parts for n in (number, number + 1))
        exact = foil.step(exact, a, b, seconds / parts)
    off = float(foil.step(start, first, last, seconds)[0] - exact[0])
    plain = float(foil.implicit_step(start, 0.5 * (first + last), seconds)[0] - exact[0])
    # Implicit Euler lags by 11 to 95 K. What is left of it is from the curve of T^4: without it
    # two halves end in 3/4 of the change of light, the full step in 1/2, and both together in all.
    assert abs(off) < 0.3 * abs(plain)


def test_a_short_step_of_a_heavy_node_is_taken() -> None:
    # A tank of 1 MJ K-1 stores 1 GW per kelvin in a millisecond: 1e-7 W of the light on it are
    # less than the last digit of its temperature.
    tank, heat = lumped(capacity=1e6, area=0.01), np.array([0.5])
    after = tank.step(np.array([290.0]), heat, heat, 1e-3)
    assert abs(float(after[0]) - 290.0) < 1e-8


def test_the_steady_state_has_nothing_left() -> None:
    network = random_network(300, 5)
    heat = np.random.default_rng(6).uniform(0.0, 30.0, 300)
    t = network.steady(heat)
    left = network.net_heat(t, heat)
    assert np.abs(left).sum() < 1e-6 * heat.sum() * 10.0


def test_a_node_without_heat_capacity_is_refused() -> None:
    with pytest.raises(ValueError, match="heat capacity"):
        lumped(capacity=0.0)
