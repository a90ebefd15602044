"""Light that leaves the patches of spacecraft, frame by frame; what stays the same is cached."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.environment_map import SkyRadiance
from simgl.lru_cache import MANY, LruCache
from simgl.radiosity.hidden_sunlight import HiddenSunlight, TakenSunlight
from simgl.radiosity.incident_light import IncidentLight, Neighbour
from simgl.radiosity.lamp_light import LampLight, reaches_into
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.posed_transport import PosedTransport
from simgl.radiosity.precomputed_response import (
    BYTES_OF_PATCH,
    BYTES_OF_VERTEX,
    GatheredSunlight,
    PrecomputedResponse,
    SunTables,
)
from simgl.radiosity.reflection_laws import ReflectionLaws
from simgl.radiosity.solver import Reflectors, radiosity, reflectors
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.radiosity.transport_store import MAX_BYTES
from simgl.scene.mean_materials import mean_materials
from simgl.scene.spacecraft import SpacecraftModel

# Of some kilobytes each.
_MAX_COSINES = 32
# Shadows of other spacecraft are known again while those stand to the body as they do in steps of
# so much of its radius, some millimetres, and of so much of a radian, a tenth of the Sun's width.
_SHADOW_STEP = 1.0 / 1024.0


@dataclass(frozen=True, kw_only=True, eq=False)
class _Surface:
    """What stays the same of a body whose joints and materials do."""

    reflectors: Reflectors
    response: PrecomputedResponse
    sunlit: SunlitPatches
    hidden: HiddenSunlight
    lamps: LampLight


@dataclass(frozen=True, kw_only=True, eq=False)
class _FieldOfLight:
    """Light that falls on the patches alike in all bands, and how much of it there is.

    name : equal for equal light
    make : works out its irradiance (p,) of the patches, for 1 in each band
    bands : (4,) [W sr-1] of a lamp
    """

    name: Hashable
    make: Callable[[], Array32]
    bands: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class UnsummedSunlight:
    """``GatheredSunlight`` for a GPU to sum.

    taken : by other spacecraft; None where that is nothing
    """

    tables: SunTables
    taken: TakenSunlight | None


@dataclass(frozen=True, kw_only=True, eq=False)
class BesidesSky:
    """What a body gets of all lights but the sky.

    exitance : (p, 4) of the patches by lamps [W m-2]; None where there are none
    sunlight : what vertices get of surfaces in the Sun; None without a Sun
    """

    exitance: Array32 | None
    sunlight: GatheredSunlight | UnsummedSunlight | None


class PatchLight:
    """Solves for the light that leaves the patches of bodies.

    In memory: for each of the last bodies up to 40 MB besides its transport, and their sunlit
    patches of the last scenes.
    """

    def __init__(self) -> None:
        self._surfaces = LruCache[tuple[object, ...], _Surface](MANY, max_bytes=MAX_BYTES)
        self._cosines = LruCache[tuple[Hashable, ...], Array32](_MAX_COSINES)

    def reserve(self, bodies: int) -> None:
        """So many, the last ones, stay in memory whatever their size."""
        self._surfaces.reserve(bodies)

    def exitance(
        self,
        model: SpacecraftModel,
        transport: LightTransport,
        sky: SkyRadiance | None,
        incident: IncidentLight,
    ) -> Array32:
        """(p, 4) of the patches after all bounces [W m-2]."""
        cells = None if sky is None else transport.cells_of(sky)
        if isinstance(transport, PosedTransport):
            return self._solved(model, transport, cells, incident)
        surface = self._surface(model, transport)
        exitance = self._but_sunlight(surface, cells, self._of_lamps(surface, incident))
        return self.with_sunlight(model, transport, exitance, incident)

    def besides_sky(
        self,
        model: SpacecraftModel,
        transport: LightTransport,
        incident: IncidentLight,
        *,
        summed: bool = True,
    ) -> BesidesSky | None:
        """What ``at_vertices`` needs before it knows the sky; None for a pose that does not last.

        May be called from another thread.

        summed : the light of the Sun as ``GatheredSunlight``
        """
        if isinstance(transport, PosedTransport):
            return None
        surface = self._surface(model, transport)
        sunlight: GatheredSunlight | UnsummedSunlight | None = None
        if incident.sun_irradiance.any():
            sun, before = incident.sun_direction, _before_sun(transport, incident)
            if summed:
                sunlight = surface.response.of_sun_at_vertices(sun, incident.sun_irradiance)
                surface.hidden.hide(sunlight, sun, before)
            else:
                sunlight = UnsummedSunlight(
                    tables=surface.response.sun_tables(sun, incident.sun_irradiance),
                    taken=surface.hidden.taken(sun, before),
                )
        return BesidesSky(exitance=self._of_lamps(surface, incident), sunlight=sunlight)

    def at_vertices(
        self,
        model: SpacecraftModel,
        transport: LightTransport,
        cells: Array32 | None,
        incident: IncidentLight,
        besides: BesidesSky | None,
    ) -> tuple[Array32, GatheredSunlight | UnsummedSunlight | None]:
        """The exitance (p, 4) that vertices have yet to gather [W m-2], and what they get besides.

        cells : (c, 4) radiance of the sky as the transport knows it; None for a dark sky
        besides : of ``besides_sky`` for the same light
        """
        if besides is None:
            assert isinstance(transport, PosedTransport)
            return self._solved(model, transport, cells, incident), None
        surface = self._surface(model, transport)
        exitance = self._but_sunlight(surface, cells, besides.exitance)
        return exitance, besides.sunlight

    def sky_lobes(
        self, model: SpacecraftModel, transport: LightTransport, cells: Array32 | None
    ) -> Array32 | None:
        """(s, 4) what gather points of vertices get of the light of the sky more than of the
        exitance ``at_vertices``, as lobes do not send evenly [W m-2]; None where that is nothing.

        cells : as of ``at_vertices``
        """
        if cells is None or isinstance(transport, PosedTransport):
            return None
        lobes = self._surface(model, transport).response.sky_lobes
        return None if lobes is None else lobes.at_points(cells)

    def with_sunlight(
        self,
        model: SpacecraftModel,
        transport: LightTransport,
        exitance: Array32,
        incident: IncidentLight,
    ) -> Array32:
        """All of the exitance (p, 4) of which ``at_vertices`` tells what is yet to be gathered."""
        if isinstance(transport, PosedTransport) or not incident.sun_irradiance.any():
            return exitance
        surface = self._surface(model, transport)
        sunlight = surface.response.of_sun(incident.sun_direction, incident.sun_irradiance)
        before = _before_sun(transport, incident)
        left = surface.hidden.share_left(incident.sun_direction, before)
        if left is not None:
            sunlight *= left[:, None]
        return exitance + sunlight

    def _of_lamps(self, surface: _Surface, incident: IncidentLight) -> Array32 | None:
        """The exitance of ``BesidesSky``."""
        lights = _lamps(surface, incident)
        if not lights:
            return None
        solved = surface.response.of_fields({light.name: light.make for light in lights})
        exitance = np.zeros_like(surface.reflectors.albedo)
        for light in lights:
            # As wide as all patches: numpy takes four times as long over rows of four.
            bands = np.tile(light.bands.astype(np.float32), (len(exitance), 1))
            exitance += np.multiply(bands, solved[light.name], out=bands)
        return exitance

    @staticmethod
    def _but_sunlight(
        surface: _Surface, cells: Array32 | None, besides_sky: Array32 | None
    ) -> Array32:
        """(p, 4) exitance by all light but the Sun's [W m-2]."""
        exitance = surface.response.glow
        if cells is not None:
            exitance = exitance + surface.response.of_sky(cells)
        if besides_sky is not None:
            exitance = exitance + besides_sky
        return exitance

    def _solved(
        self,
        model: SpacecraftModel,
        transport: PosedTransport,
        cells: Array32 | None,
        incident: IncidentLight,
    ) -> Array32:
        """The same of a pose that does not last: all light together, solved now."""
        surface = self._surface(model, transport)
        irradiance = np.zeros_like(surface.reflectors.albedo)
        emitted = surface.reflectors.exitance.copy()
        if incident.sun_irradiance.any():
            direct = self.of_direct_sun(model, transport, incident)
            emitted += direct * incident.sun_irradiance.astype(np.float32)
        if cells is not None:
            # Rays follow the cosine: each stands for pi over their number.
            irradiance += np.float32(np.pi) * (transport.sky @ cells)
        for lamp in _lamps(surface, incident):
            irradiance += np.outer(lamp.make(), lamp.bands.astype(np.float32))
        emitted += surface.reflectors.albedo * irradiance
        return radiosity(transport, surface.reflectors, emitted)

    def reflected(
        self,
        model: SpacecraftModel,
        transport: LightTransport,
        irradiance: Array32,
        residual: float,
    ) -> Array32:
        """(p, 4) exitance by light (p, 4) from elsewhere after all bounces [W m-2].

        residual : as of ``radiosity``
        """
        surface = self._surface(model, transport).reflectors
        return radiosity(transport, surface, surface.albedo * irradiance, residual)

    def of_direct_sun(
        self, model: SpacecraftModel, transport: LightTransport, incident: IncidentLight
    ) -> Array32:
        """(p, 4) what a Sun of 1 W m-2 adds to the exitance before any bounce."""
        return self.direct_and_even(model, transport, incident)[0]

    def direct_and_even(
        self, model: SpacecraftModel, transport: LightTransport, incident: IncidentLight
    ) -> tuple[Array32, Array32]:
        """(p, 4) the same, and what would leave patches evenly of 1 W m-2 of sunlight on them."""
        surface = self._surface(model, transport)
        sunlit, direction = surface.sunlit, incident.sun_direction
        even, lobes = surface.reflectors.of_sun(sunlit.facing(direction))
        return (even + lobes) * self._sun_cosines(sunlit, transport, incident)[:, None], even

    def laws(self, model: SpacecraftModel, transport: LightTransport) -> ReflectionLaws:
        """Of the materials of a body."""
        return self._surface(model, transport).reflectors.laws

    def sun_at_samples(
        self,
        model: SpacecraftModel,
        transport: LightTransport,
        incident: IncidentLight,
        samples: IndexArray,
    ) -> Array32:
        """(n,) cosines to the Sun of sample points, by their numbers among all of the patches; 0
        where it is not seen."""
        surface, direction = self._surface(model, transport), incident.sun_direction
        cosines = surface.sunlit.cosines_of_samples(direction, samples)
        if incident.before_sun:
            free = np.maximum(surface.sunlit.cosines(direction), np.float32(1e-9))
            left = self._sun_cosines(surface.sunlit, transport, incident) / free
            cosines *= np.take(left, samples // SAMPLES)
        return cosines

    def response(self, model: SpacecraftModel, transport: LightTransport) -> PrecomputedResponse:
        """Of a body to light."""
        return self._surface(model, transport).response

    def prepare(self, model: SpacecraftModel, transport: LightTransport) -> None:
        """Precompute what the first light on a transport needs."""
        self._surface(model, transport)

    def _surface(self, model: SpacecraftModel, transport: LightTransport) -> _Surface:
        key = transport.digest, model.open_sheets, model.surface_digest

        def precomputed() -> _Surface:
            surface, sunlit = reflectors(transport, mean_materials(model)), SunlitPatches(transport)
            response = PrecomputedResponse(transport, surface, sunlit)
            return _Surface(
                reflectors=surface,
                response=response,
                sunlit=sunlit,
                hidden=HiddenSunlight(transport, surface, sunlit, response),
                lamps=LampLight(transport),
            )

        # They hold the transport, which may have left its own cache.
        size = transport.nbytes + len(transport.areas) * BYTES_OF_PATCH
        nodes = 0 if transport.grids is None else transport.grids.rows
        size += (len(transport.vertex_rows) + nodes) * BYTES_OF_VERTEX
        if isinstance(transport, PosedTransport):
            return self._surfaces.get(key, precomputed, size)
        return self._surfaces.get(key, precomputed, lambda made: size + made.response.lobe_bytes)

    def _sun_cosines(
        self, sunlit: SunlitPatches, transport: LightTransport, incident: IncidentLight
    ) -> Array32:
        """Traced again only where Sun or spacecraft have moved in the body's axes."""

        def traced() -> Array32:
            blockers = [neighbour.blocker() for neighbour in incident.before_sun]
            return sunlit.cosines(incident.sun_direction, blockers)

        return self._cosines.get(_sun_key(transport, incident), traced)


def _before_sun(transport: LightTransport, incident: IncidentLight) -> list[Neighbour]:
    """Spacecraft that may shade one from the Sun, in steps of their poses."""
    reach = transport.mesh.radius
    return [neighbour.in_steps(reach, _SHADOW_STEP) for neighbour in incident.before_sun]


def _lamps(surface: _Surface, incident: IncidentLight) -> list[_FieldOfLight]:
    """The light of each lamp."""
    lights = []
    for lamp in incident.lamps:
        gap = surface.lamps.gap(lamp)
        rounded = lamp.in_steps(gap)
        others = [other.around_lamp(lamp, rounded, gap) for other in incident.around]
        before = [other for other in others if reaches_into(other.blocker(), rounded)]
        blockers = [other.blocker() for other in before]
        lights.append(
            _FieldOfLight(
                name=(rounded.beam, *(other.key for other in before)),
                make=partial(surface.lamps.irradiance, rounded, blockers),
                bands=lamp.intensity,
            )
        )
    return lights


def _sun_key(transport: LightTransport, incident: IncidentLight) -> tuple[Hashable, ...]:
    direction = incident.sun_direction.tobytes()
    return transport.digest, direction, *(neighbour.key for neighbour in incident.before_sun)
