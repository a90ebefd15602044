"""The light of a spacecraft but for that of others near it, as tasks of an executor."""

from __future__ import annotations

from collections.abc import Hashable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import cached_property

from simgl.arrays import Array32
from simgl.environment_map import SkyRadiance
from simgl.radiosity.incident_light import IncidentLight
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patch_light import BesidesSky, PatchLight, UnsummedSunlight
from simgl.radiosity.precomputed_response import GatheredSunlight
from simgl.scene.spacecraft import SpacecraftModel

# Model, transport, sky and lights of a spacecraft.
MadeOf = tuple[SpacecraftModel, LightTransport, SkyRadiance | None, tuple[Hashable, ...]]


@dataclass(frozen=True, kw_only=True, eq=False)
class IsolatedLight:
    """A spacecraft and the light that it would have without others.

    instance : index in the scene, counted from 1
    exitance : (p, 4) of its patches after all bounces [W m-2]
    """

    instance: int
    model: SpacecraftModel
    transport: LightTransport
    incident: IncidentLight
    sky: SkyRadiance | None
    exitance: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class PendingLight:
    """The same, of which each part is begun when it is first asked for.

    Tasks wait only for some that were submitted before them. Parts are asked for in one thread.

    instance : index in the scene, counted from 1
    besides_sky : None for one that is not drawn
    """

    instance: int
    model: SpacecraftModel
    transport: LightTransport
    sky: SkyRadiance | None
    incident: IncidentLight
    besides_sky: Future[BesidesSky | None] | None
    light: PatchLight
    executor: Executor

    @property
    def made_of(self) -> MadeOf:
        """Equal for equal light."""
        return self.model, self.transport, self.sky, self.incident.key

    @cached_property
    def cells(self) -> Future[Array32 | None]:
        """(c, 4) radiance of the sky as the transport knows it; None for a dark sky."""
        sky, transport = self.sky, self.transport
        return self.executor.submit(lambda: None if sky is None else transport.cells_of(sky))

    @cached_property
    def at_vertices(self) -> Future[tuple[Array32, GatheredSunlight | UnsummedSunlight | None]]:
        """As of ``PatchLight.at_vertices``, for one that is drawn."""
        besides, cells = self.besides_sky, self.cells
        assert besides is not None

        def solved() -> tuple[Array32, GatheredSunlight | UnsummedSunlight | None]:
            return self.light.at_vertices(
                self.model, self.transport, cells.result(), self.incident, besides.result()
            )

        return self.executor.submit(solved)

    @cached_property
    def sky_lobes(self) -> Future[Array32 | None]:
        """As of ``PatchLight.sky_lobes``."""
        model, transport, cells = self.model, self.transport, self.cells
        return self.executor.submit(lambda: self.light.sky_lobes(model, transport, cells.result()))

    @cached_property
    def at_patches(self) -> Future[IsolatedLight]:
        """What leaves the patches."""
        at_vertices = None if self.besides_sky is None else self.at_vertices
        model, transport, sky, incident = self.model, self.transport, self.sky, self.incident
        instance = self.instance

        def solved() -> IsolatedLight:
            if at_vertices is None:
                exitance = self.light.exitance(model, transport, sky, incident)
            else:
                exitance, _ = at_vertices.result()
                exitance = self.light.with_sunlight(model, transport, exitance, incident)
            return IsolatedLight(
                instance=instance,
                model=model,
                transport=transport,
                incident=incident,
                sky=sky,
                exitance=exitance,
            )

        return self.executor.submit(solved)
