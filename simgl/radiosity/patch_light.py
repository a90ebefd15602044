"""Light on the patches of spacecraft, frame by frame: what stays the same is worked out once."""

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
from simgl.radiosity.transport_store import KEPT
from simgl.scene.mean_materials import mean_materials
from simgl.scene.spacecraft import SpacecraftModel


class PatchLight:
    """Solves for the light that leaves the patches of bodies.

    A body is told from others by its ``instance`` in the scene; its transport is one that stays.
    """

    def __init__(self) -> None:
        self._surfaces = LruCache[tuple[object, ...], tuple[Reflectors, PrecomputedResponse]](KEPT)
        self._sunlit = LruCache[LightTransport, SunlitPatches](KEPT)
        self._cosines: dict[int, tuple[bytes, Array32]] = {}

    def exitance(
        self,
        instance: int,
        model: SpacecraftModel,
        transport: LightTransport,
        sky: SkyRadiance | None,
        view: IncidentLight,
    ) -> Array32:
        """(p, 4) of the patches after all bounces [W m-2]."""
        response = self._surface(model, transport)[1]
        exitance = response.glow
        others = np.zeros_like(exitance)
        if view.before_sun:
            cosines = self._sun_cosines(instance, transport, view)
            others += cosines[:, None] * view.sun_irradiance.astype(np.float32)
        else:
            exitance = exitance + response.of_sun(view.sun_direction, view.sun_irradiance)
        if sky is not None:
            exitance = exitance + response.of_sky(cell_radiance(sky, CELLS_ACROSS))
        if view.lamps:
            around = [n.blocker() for n in view.around]
            for lamp in view.lamps:
                others += lamp_irradiance(transport, lamp, around)
        return exitance + response.of_irradiance(others) if np.any(others) else exitance

    def of_direct_sun(
        self, instance: int, model: SpacecraftModel, transport: LightTransport, view: IncidentLight
    ) -> Array32:
        """(p, 4) what a Sun of 1 W m-2 adds to the exitance before any bounce."""
        cosines = self._sun_cosines(instance, transport, view)
        return self._surface(model, transport)[0].albedo * cosines[:, None]

    def _surface(
        self, model: SpacecraftModel, transport: LightTransport
    ) -> tuple[Reflectors, PrecomputedResponse]:
        key = transport.mesh.digest, model.open_sheets, model.materials, model.textures.digest

        def worked_out() -> tuple[Reflectors, PrecomputedResponse]:
            surface = reflectors(transport, mean_materials(model))
            return surface, PrecomputedResponse(transport, surface, self._patches(transport))

        return self._surfaces.get(key, worked_out)

    def _patches(self, transport: LightTransport) -> SunlitPatches:
        return self._sunlit.get(transport, lambda: SunlitPatches(transport))

    def _sun_cosines(
        self, instance: int, transport: LightTransport, view: IncidentLight
    ) -> Array32:
        """Traced anew only where Sun or spacecraft have moved in the body's axes."""
        key = _sun_key(transport, view)
        if self._cosines.get(instance, (b"",))[0] != key:
            blockers = [n.blocker() for n in view.before_sun]
            lit = self._patches(transport).cosines(view.sun_direction, blockers)
            self._cosines[instance] = key, lit
        return self._cosines[instance][1]


def _sun_key(transport: LightTransport, view: IncidentLight) -> bytes:
    def place(neighbour: Neighbour) -> bytes:
        return neighbour.model.posed_mesh.digest.encode() + neighbour.other_from_body.tobytes()

    parts = [transport.mesh.digest.encode(), view.sun_direction.tobytes()]
    return b"".join(parts + [place(n) for n in view.before_sun])
