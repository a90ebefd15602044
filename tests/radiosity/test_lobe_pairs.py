"""What lobes send is the sum over all pairs, however these are laid out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.arrays import Array, Array32
from simgl.radiosity.glossy_places import GlossyPlaces, PlacePairs
from simgl.radiosity.lobe_pairs import LightOnPatches, LobePairs, SunOnPlaces
from simgl.radiosity.reflection_laws import ReflectionLaws, lobe_towards, reflection_laws
from tests.radiosity.glossy_walls import APART, METAL, WALL, baked

# One kind of lobes each: grey, which gives back what meets several microfacets; coloured; both.
GREY = replace(METAL, reflectance=(0.8,) * 4, roughness=0.6, conserving=True)
COLOURED = replace(METAL, roughness=0.5)
CONSERVING = replace(METAL, roughness=0.8, conserving=True)


@pytest.fixture(scope="module")
def seen() -> tuple[PlacePairs, GlossyPlaces, ReflectionLaws]:
    """A plate and two walls, all glossy, as gather points see them."""
    transport = baked(WALL, APART)
    laws = reflection_laws([GREY, COLOURED, CONSERVING])
    places = GlossyPlaces(transport, laws)
    shares = transport.sun_gather.tocsr()[:, places.glossy].tocoo()
    starts = transport.start_places, transport.start_normals, transport.start_radii
    receivers = (values[: shares.shape[0]] for values in starts)
    return places.pairs(shares, *receivers), places, laws


def by_pairs(
    pairs: PlacePairs,
    f0: Array32,
    light: tuple[Array32, Array32, Array32, Array32],
    scale: Array32 | float = 1.0,
) -> Array:
    """(count, 4) by the law of each pair.

    light : of each pair its direction (3, n), the cosine (n,) of that, alpha2 (n,) and what takes
        part (n, 4)
    """
    direction, facing, alpha2, arriving = light
    turn = np.einsum("in,in->n", direction, np.stack([pairs.x, pairs.y, pairs.z])) * scale
    lobe, schlick = lobe_towards(alpha2, facing, pairs.lean, turn.astype(np.float32))
    sent = (f0 + (1.0 - f0) * schlick[:, None]) * (1.0 + f0 * pairs.more[:, None])
    sent *= (lobe * pairs.share)[:, None] * arriving
    found = np.zeros((pairs.count, 4))
    np.add.at(found, pairs.receiver, sent)
    return found


def assert_same(found: Array32, true: Array) -> None:
    """float32: 1e-7 of each of some hundred numbers, one after the other."""
    assert np.all(true.max(axis=0) > 0.0)
    np.testing.assert_allclose(found, true, rtol=3e-5, atol=1e-6 * float(true.max()))


@pytest.mark.parametrize("lit", [1.0, 0.01], ids=["all places", "one place of a hundred"])
def test_sunlight_on_some_places_goes_on_by_their_pairs(
    seen: tuple[PlacePairs, GlossyPlaces, ReflectionLaws], lit: float
) -> None:
    """Two lights at once: from the Sun, and from a way raised above the places."""
    pairs, places, laws = seen
    rng, count = np.random.default_rng(1), len(places.patch)
    sun = np.array([0.6, 0.48, 0.64], dtype=np.float32)
    facing = rng.uniform(0.02, 1.0, count).astype(np.float32)
    arriving = (rng.random((2, count)) * (rng.random((2, count)) < lit)).astype(np.float32)
    by, scale = rng.uniform(0.0, 0.2, (2, count)).astype(np.float32)
    scale += np.float32(0.7)
    lights = [
        SunOnPlaces(direction=sun, arriving=arriving[0], facing=facing, raised=None),
        SunOnPlaces(direction=sun, arriving=arriving[1], facing=facing, raised=(by, scale)),
    ]
    table = LobePairs(pairs, places, laws)
    reached = [table.reached(light) for light in lights]
    found = table.sent(list(zip(lights, reached, strict=True)))
    at, f0 = pairs.place, laws.f0[places.law[pairs.place]]
    direction = np.repeat(sun[:, None], len(at), axis=1)
    ways = np.stack([pairs.x, pairs.y, pairs.z])
    # A direction with the same cosine to each pair's as the raised one.
    raised = direction + by[at] * pairs.lean * ways
    true = by_pairs(pairs, f0, (direction, facing[at], pairs.alpha2, arriving[0, at, None]))
    true += by_pairs(
        pairs, f0, (raised, facing[at], pairs.alpha2, arriving[1, at, None]), scale[at]
    )
    assert_same(found, true)


def test_light_of_other_patches_goes_on_by_the_pairs_of_those_that_get_it(
    seen: tuple[PlacePairs, GlossyPlaces, ReflectionLaws],
) -> None:
    pairs, places, laws = seen
    rng, count = np.random.default_rng(2), places.count
    direction = rng.normal(size=(3, count))
    direction /= np.linalg.norm(direction, axis=0)
    light = LightOnPatches(
        bright=rng.random(count) < 0.3,
        direction=direction.astype(np.float32),
        facing=rng.uniform(0.02, 1.0, count).astype(np.float32),
        spread2=rng.uniform(0.0, 0.25, count).astype(np.float32),
        arriving=rng.random((count, 4)).astype(np.float32),
    )
    table = LobePairs(pairs, places, laws)
    found = table.sent([(light, table.reached(light))])
    at, f0 = places.patch[pairs.place], laws.f0[places.law[pairs.place]]
    alpha2 = np.minimum(pairs.alpha2 + light.spread2[at], np.float32(1.0))
    arriving = light.arriving[at] * light.bright[at, None]
    true = by_pairs(pairs, f0, (light.direction[:, at], light.facing[at], alpha2, arriving))
    assert_same(found, true)
