"""Light that leaves the patches of spacecraft, frame by frame; what stays the same is cached."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array32
from simgl.environment_map import SkyRadiance, cell_radiance
from simgl.lru_cache import LruCache
from simgl.radiosity.hemisphere import CELLS_ACROSS
from simgl.radiosity.incident_light import IncidentLight, Neighbour
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.precomputed_response import PrecomputedResponse
from simgl.radiosity.solver import Reflectors, lamp_irradiance, reflectors
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.radiosity.transport_store import CAPACITY
from simgl.scene.mean_materials import mean_materials
from simgl.scene.spacecraft import SpacecraftModel


class PatchLight:
    """Solves for the light that leaves the patches of bodies.

    In memory: for each of the last bodies up to 20 MB, and their sunlit patches of the last scenes.
    """

    def __init__(self) -> None:
        self._surfaces = LruCache[tuple[object, ...], tuple[Reflectors, PrecomputedResponse]](
            CAPACITY
        )
        self._sunlit = LruCache[LightTransport, SunlitPatches](CAPACITY)
        self._cosines = LruCache[bytes, Array32](2 * CAPACITY)

    def exitance(
        self,
        model: SpacecraftModel,
        transport: LightTransport,
        sky: SkyRadiance | None,
        incident: IncidentLight,
    ) -> Array32:
        """(p, 4) of the patches after all bounces [W m-2]."""
        response = self._surface(model, transport)[1]
        exitance = response.glow
        irradiance = np.zeros_like(exitance)
        if incident.before_sun:
            cosines = self._sun_cosines(transport, incident)
            irradiance += cosines[:, None] * incident.sun_irradiance.astype(np.float32)
        else:
            exitance = exitance + response.of_sun(incident.sun_direction, incident.sun_irradiance)
        if sky is not None:
            exitance = exitance + response.of_sky(cell_radiance(sky, CELLS_ACROSS))
        if incident.lamps:
            blockers = [neighbour.blocker() for neighbour in incident.around]
            for lamp in incident.lamps:
                irradiance += lamp_irradiance(transport, lamp, blockers)
        return exitance + response.of_irradiance(irradiance) if np.any(irradiance) else exitance

    def of_direct_sun(
        self, model: SpacecraftModel, transport: LightTransport, incident: IncidentLight
    ) -> Array32:
        """(p, 4) what a Sun of 1 W m-2 adds to the exitance before any bounce."""
        cosines = self._sun_cosines(transport, incident)
        return self._surface(model, transport)[0].albedo * cosines[:, None]

    def _surface(
        self, model: SpacecraftModel, transport: LightTransport
    ) -> tuple[Reflectors, PrecomputedResponse]:
        key = transport.mesh.digest, model.open_sheets, model.materials, model.textures.digest

        def precomputed() -> tuple[Reflectors, PrecomputedResponse]:
            surface = reflectors(transport, mean_materials(model))
            return surface, PrecomputedResponse(transport, surface, self._patches(transport))

        return self._surfaces.get(key, precomputed)

    def _patches(self, transport: LightTransport) -> SunlitPatches:
        return self._sunlit.get(transport, lambda: SunlitPatches(transport))

    def _sun_cosines(self, transport: LightTransport, incident: IncidentLight) -> Array32:
        """Traced again only where Sun or spacecraft have moved in the body's axes."""

        def traced() -> Array32:
            blockers = [neighbour.blocker() for neighbour in incident.before_sun]
            return self._patches(transport).cosines(incident.sun_direction, blockers)

        return self._cosines.get(_sun_key(transport, incident), traced)


def _sun_key(transport: LightTransport, incident: IncidentLight) -> bytes:
    def place(neighbour: Neighbour) -> bytes:
        return neighbour.model.posed_mesh.digest.encode() + neighbour.other_from_body.tobytes()

    parts = [transport.mesh.digest.encode(), incident.sun_direction.tobytes()]
    return b"".join(parts + [place(n) for n in incident.before_sun])
