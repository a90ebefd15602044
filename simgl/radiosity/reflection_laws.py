"""How much of sunlight surfaces reflect, by where it comes from, and the lobes of glossy ones.

The law is that of shaders/surface/brdf.glsl: a GGX lobe over a base that is matt, under a coat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.disk_cache import Arrays, computed_once
from simgl.physics.directional_albedo import lobe_albedo
from simgl.scene.materials import Material

# Cosines between normal and light at which reflectances are known, evenly spaced, and the lowest.
_STEPS = 33
_GRAZING = 0.01
# Reflectance of clear coats at normal incidence, as in shaders/surface/material.glsl.
_COAT_F0 = 0.04
# Lobes that reflect less of a uniform light than this in each band count as even: those of cloth,
# felt and other rough paints, which are flat.
_FAINT = 0.04
# Half of the power by which widths of slopes add up, as in shaders/surface/crinkle.glsl.
_HALF_POWER = 0.635


@dataclass(frozen=True, kw_only=True, eq=False)
class ReflectionLaws:
    """The laws of some materials.

    even, lobes : (k, steps, 4) share of the light from a direction, by its cosine, that leaves
        evenly and in a lobe
    glossy : (k,) whether a lobe is to be followed, of base or coat the brighter one; others are
        among what leaves evenly
    f0 : (k, 4) reflectance of the lobe at normal incidence
    alpha2 : (k,) squared width of the lobe
    covered : (k, steps) share of the light from a direction, by its cosine, that takes part in the
        lobe: where there is a coat, or through it
    conserving : (k,) whether lobes get the light that meets several microfacets
    once : (k, steps) share of the light that leaves a lobe of f0 = 1 after one microfacet, by the
        cosine to the viewer
    """

    even: Array32
    lobes: Array32
    glossy: Mask
    f0: Array32
    alpha2: Array32
    covered: Array32
    conserving: Mask
    once: Array32

    def of_light(self, law: IndexArray, cosine: Array32) -> Array32:
        """(2, n, 4) what leaves evenly and what in a lobe of light from cosines (n,)."""
        return np.stack([_between(table, law, cosine) for table in (self.even, self.lobes)])

    @cached_property
    def part_of_lobe(self) -> Array32:
        """(k,) of what leaves of uniform light, the part in lobes."""
        lobe, even = self.lobe_albedo.max(axis=1), _uniform(self.even).max(axis=1)
        return np.asarray(lobe / np.maximum(lobe + even, 1e-9), dtype=np.float32)

    @cached_property
    def lobe_albedo(self) -> Array32:
        """(k, 4) what leaves in lobes of light that comes evenly from all around."""
        return _uniform(self.lobes).astype(np.float32)

    def taking_part(self, law: IndexArray, cosine: Array32) -> Array32:
        """(n,) of light from cosines (n,) what lobes get."""
        return _between(self.covered, law, cosine)

    def more(self, law: IndexArray, cosine: Array | Array32) -> Array32:
        """(n,) what lobes send to cosines (n,) besides, over f0, by light that met several
        microfacets (Turquin 2019)."""
        once = _between(self.once, law, cosine)
        return (1.0 - once) / once

    def towards(
        self, law: IndexArray, light: Array32, viewer: Array32, turn: Array32, min_alpha: float
    ) -> Array32:
        """(n, 4) pi times the reflectance of sunlight towards a viewer [sr-1].

        light, viewer : (n,) cosines of their directions to the normal; turn : (n,) to each other
        min_alpha : width that lobes have at least
        """
        alpha2 = np.maximum(self.alpha2[law], np.float32(min_alpha * min_alpha))
        lobe, schlick = lobe_towards(alpha2, light, viewer, turn)
        f0 = self.f0[law]
        sent = (f0 + (1.0 - f0) * schlick[:, None]) * lobe[:, None]
        sent *= 1.0 + f0 * self.more(law, viewer)[:, None]
        sent *= self.taking_part(law, light)[:, None]
        return np.asarray(_between(self.even, law, light) + sent * self.glossy[law][:, None])


# Arrays that ``lobe_in`` works in.
LOBE_ROOM = 5


def lobe_towards(
    alpha2: Array32, light: Array32, viewer: Array32, turn: Array32
) -> tuple[Array32, Array32]:
    """(n,) pi times lobes without Fresnel's term, and Schlick's power of that.

    light, viewer : (n,) cosines of their directions to the normal; turn : (n,) to each other
    """
    room = np.empty((LOBE_ROOM, *turn.shape), dtype=np.float32)
    return lobe_in(room, alpha2, light, viewer, turn)


def lobe_in(
    room: Array32, alpha2: Array32, light: Array32, viewer: Array32, turn: Array32
) -> tuple[Array32, Array32]:
    """The same in the first two of so many arrays (LOBE_ROOM, n): new ones cost as much time as
    what is worked out in them."""
    lobe, schlick, rest, one, other = room
    np.subtract(np.float32(1.0), alpha2, out=rest)
    # The half vector's squared length, and its cosines to the normal and to both ways.
    length2 = np.multiply(turn, np.float32(2.0), out=one)
    length2 += 2.0
    np.maximum(length2, np.float32(1e-6), out=length2)
    NoH2 = np.add(light, viewer, out=lobe)
    NoH2 *= NoH2
    NoH2 /= length2
    np.minimum(NoH2, np.float32(1.0), out=NoH2)
    past = np.sqrt(length2, out=length2)
    past *= -0.5
    past += 1.0
    np.multiply(past, past, out=schlick)
    schlick *= schlick
    schlick *= past
    NoH2 *= rest
    spread = np.subtract(np.float32(1.0), NoH2, out=lobe)
    spread *= spread
    masked = _masked(light, viewer, rest, alpha2, one)
    masked += _masked(viewer, light, rest, alpha2, other)
    spread *= masked
    half = np.multiply(alpha2, np.float32(0.5), out=rest)
    return np.divide(half, spread, out=lobe), schlick


def _masked(one: Array32, other: Array32, rest: Array32, alpha2: Array32, out: Array32) -> Array32:
    """(n,) the other cosine times the root of alpha2 + (1 - alpha2) cosine^2."""
    masked = np.multiply(one, one, out=out)
    masked *= rest
    masked += alpha2
    np.sqrt(masked, out=masked)
    masked *= other
    return masked


def reflection_laws(materials: Sequence[Material]) -> ReflectionLaws:
    """Of each material."""
    parts = [_parts(material) for material in materials]
    brightest = [max(lobes, key=_Lobe.albedo) for _, lobes in parts]
    even = np.stack([_all_of(base, lobes) for base, lobes in parts])
    glossy = np.array([lobe.albedo() >= _FAINT for lobe in brightest])
    lobes = np.stack([lobe.shares for lobe in brightest])
    lobes[~glossy] = 0.0
    return ReflectionLaws(
        even=(even - lobes).astype(np.float32),
        lobes=lobes.astype(np.float32),
        glossy=glossy,
        f0=np.stack([lobe.f0 for lobe in brightest]).astype(np.float32),
        alpha2=np.array([lobe.alpha2 for lobe in brightest], dtype=np.float32),
        covered=np.stack([lobe.covered for lobe in brightest]).astype(np.float32),
        conserving=np.array([material.conserving for material in materials]),
        once=np.stack([lobe.once for lobe in brightest]).astype(np.float32),
    )


def hemispherical_albedo(material: Material) -> Array:
    """(4,) reflectance of a surface under uniform light."""
    base, lobes = _parts(material)
    return _uniform(_all_of(base, lobes))


def lost_by_widening(alpha2: Array32, wider: Array32) -> Array32:
    """(n,) what lobes of squared widths reflect of uniform light, over what wider ones do.

    Light that meets a second microfacet is no part of a lobe, and of wide ones that is much.
    """
    widths, once = _once_of_widths()
    of_lobe, of_wider = (np.interp(np.sqrt(a), widths, once) for a in (alpha2, wider))
    return np.asarray(of_lobe / of_wider, dtype=np.float32)


@lru_cache(maxsize=1)
def _once_of_widths() -> tuple[Array, Array]:
    """Widths of lobes, and what those of f0 = 1 reflect of uniform light."""
    widths = np.linspace(0.02, 1.0, _STEPS)

    def made() -> Arrays:
        once = [np.sum(_lobe(float(alpha)), axis=0)[:, None] for alpha in widths]
        return {"once": _uniform(np.stack(once))[:, 0]}

    made_by = __name__, "simgl.physics.directional_albedo", "numpy"
    of_widths = computed_once(
        "tables", made_by, "once", made, lambda arrays: arrays["once"].shape == widths.shape
    )
    return widths, of_widths["once"]


def _cosines() -> Array:
    return np.linspace(_GRAZING, 1.0, _STEPS)


def _between(table: Array32, law: IndexArray, cosine: Array | Array32) -> Array32:
    """(n, ...) of a table (k, steps, ...) at cosines (n,), linear between its steps."""
    place = np.clip((cosine - _GRAZING) * ((_STEPS - 1) / (1.0 - _GRAZING)), 0.0, _STEPS - 1.001)
    step = place.astype(np.int64)
    share = (place - step).astype(np.float32).reshape(-1, *(1,) * (table.ndim - 2))
    low, high = table[law, step], table[law, step + 1]
    return np.asarray(low + share * (high - low))


def _uniform(shares: Array | Array32) -> Array:
    """(..., 4) means of (..., steps, 4) over a uniform light, weighted by its cosine."""
    cosine = _cosines()
    # The integral of what is linear between steps, times the cosine.
    ends = np.append(0.0, 0.5 * (cosine[1:] + cosine[:-1]))
    weight = np.diff(np.append(ends, 1.0) ** 2)
    return np.asarray(np.einsum("...sb,s->...b", shares, weight))


def _normal_reflectance(material: Material) -> Array:
    return 0.04 + material.metallic * (np.asarray(material.reflectance) - 0.04)


def _alpha2(material: Material) -> float:
    """Squared width of the lobe of all facets of a crumpled foil together."""
    alpha2 = 1.0 if material.roughness is None else material.roughness**4
    if material.crinkle is None:
        return alpha2
    slopes = 2.0 * material.crinkle.slope**2
    return float((alpha2**_HALF_POWER + slopes**_HALF_POWER) ** (1.0 / _HALF_POWER))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Lobe:
    """One lobe of a material; its arrays as of ``ReflectionLaws``."""

    shares: Array
    f0: Array
    alpha2: float
    covered: Array
    once: Array

    def albedo(self) -> float:
        """What it reflects of uniform light, in the band in which that is most."""
        return float(_uniform(self.shares).max())


def _all_of(base: Array, lobes: Sequence[_Lobe]) -> Array:
    """(steps, 4) of the parts of a material together."""
    return np.asarray(np.sum([base, *(lobe.shares for lobe in lobes)], axis=0))


def _parts(material: Material) -> tuple[Array, list[_Lobe]]:
    """(steps, 4) what leaves evenly, and the lobes, of base and coat."""
    cosine, base = _cosines(), np.broadcast_to(np.asarray(material.reflectance), (_STEPS, 4))
    covered, lobes = np.ones(_STEPS), []
    coat = material.coat
    if coat is not None:
        scale, bias = _lobe(coat.roughness**2)
        strength = np.full(_STEPS, coat.strength)
        lobes = [
            _Lobe(
                shares=np.tile((strength * (_COAT_F0 * scale + bias))[:, None], 4),
                f0=np.full(4, _COAT_F0),
                alpha2=coat.roughness**4,
                covered=strength,
                once=np.ones(_STEPS),
            )
        ]
        grazing = (1.0 - cosine) ** 5
        passing = 1.0 - coat.strength * (_COAT_F0 + (1.0 - _COAT_F0) * grazing)
        covered = passing * (1.0 - coat.strength * (_COAT_F0 + (1.0 - _COAT_F0) / 21.0))
    f0 = _normal_reflectance(material)
    lobe, once, alpha2 = np.zeros((_STEPS, 4)), np.ones(_STEPS), _alpha2(material)
    if material.roughness is not None:
        scale, bias = _lobe(alpha2**0.5)
        lobe = f0 * scale[:, None] + bias[:, None]
        if material.conserving:
            once = scale + bias
            lobe = lobe * (1.0 + f0 * ((1.0 - once) / once)[:, None])
        base = base * (1.0 - material.metallic) * (1.0 - f0) * _base_share(cosine)[:, None]
    shares = covered[:, None] * lobe
    lobes.append(_Lobe(shares=shares, f0=f0, alpha2=alpha2, covered=covered, once=once))
    return covered[:, None] * base, lobes


def _base_share(cosine: Array) -> Array:
    """(k,) mean of 1 - (1 - VoH)^5 over a uniform light: as in shaders/surface/albedo.glsl."""
    low = 0.0281691 - cosine * (0.0799209 - cosine * 0.0866869)
    high = 0.0439607 - cosine * 0.0091090
    return np.asarray(1.0 - low + cosine**3 * high)


@lru_cache(maxsize=128)
def _lobe(alpha: float) -> tuple[Array, Array]:
    """(steps,) scale and bias of a lobe's albedo."""
    return lobe_albedo(_cosines(), np.full(_STEPS, alpha))
