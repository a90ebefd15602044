"""Light between the surfaces of each spacecraft, as values of its vertices."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.arrays import Array, Array32
from simgl.environment_map import SkyRadiance, cell_radiance
from simgl.gpu.vertex_buffers import Values
from simgl.lru_cache import LruCache
from simgl.motion.joints import motion_between
from simgl.passes.mesh_store import VertexLighting
from simgl.radiosity.final_gather import LitBody
from simgl.radiosity.gather_matrix import GatherMatrix, vertex_rows
from simgl.radiosity.hemisphere import CELLS_ACROSS
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.solver import beside, earth_share, material_light, vertex_irradiance
from simgl.radiosity.transport_store import JOINT_STEP, TransportStore
from simgl.scene.mean_materials import mean_materials
from simgl.scene.mesh import Mesh, moved_mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.frame_view import SpacecraftView

# Meshes with joints between these steps, for poses that come back.
_TURNED_KEPT = 8

# Bodies whose rows are kept, up to 15 MB each.
_ROWS_KEPT = 8

_FRONT = {"in_bounced": "4f", "in_earth_share": "1f"}
_BACK = {"in_bounced_back": "4f", "in_earth_share_back": "1f"}


@dataclass(frozen=True, kw_only=True, eq=False)
class _LitPatches:
    """The light that leaves a body with a transport.

    indirect : (p, 4) of the patches after all bounces, less the Sun's before any [W m-2]
    """

    transport: LightTransport
    indirect: Array32


class InterreflectionPass:
    """Solves the exchange for spacecraft with surfaces that see each other; others have none."""

    def __init__(self, ctx: moderngl.Context, transports: TransportStore) -> None:
        self._ctx, self._transports = ctx, transports
        self._light = PatchLight()
        self._rows = LruCache[LightTransport, GatherMatrix](_ROWS_KEPT)
        self._buffers: dict[tuple[int, int], moderngl.Buffer] = {}
        self._turned: OrderedDict[tuple[object, ...], Mesh] = OrderedDict()

    def draw(
        self, craft: Sequence[SpacecraftView], skies: Sequence[SkyRadiance | None]
    ) -> list[VertexLighting | None]:
        """The values of each spacecraft; None where nothing sees itself. Valid until the next call.

        skies : what each sees around it
        """
        return [self._of_craft(c, sky) for c, sky in zip(craft, skies, strict=True)]

    def bodies(
        self, craft: Sequence[SpacecraftView], skies: Sequence[SkyRadiance | None]
    ) -> list[list[LitBody] | None]:
        """What rays from each spacecraft meet: itself, then what is near; None where nothing is."""
        solved = {c.instance: self._patches(c, sky) for c, sky in zip(craft, skies, strict=True)}
        found: list[list[LitBody] | None] = []
        for one in craft:
            near = [] if one.exchange is None else [n for n in one.exchange.around if n.near]
            own = solved.get(one.instance)
            if one.exchange is None or (own is None and not near):
                found.append(None)
                continue
            sunlight = one.exchange.sun_irradiance.astype(np.float32)
            models = [(one.model, np.eye(4), own)]
            models += [(n.model, n.other_from_body, solved.get(n.instance)) for n in near]
            found.append(
                [
                    self._lit(
                        model, matrix, matrix[:3, :3] @ one.exchange.sun_direction, sunlight, s
                    )
                    for model, matrix, s in models
                ]
            )
        return found

    def _lit(
        self,
        model: SpacecraftModel,
        own_from_here: Array,
        sun_direction: Array,
        sun_irradiance: Array32,
        solved: _LitPatches | None,
    ) -> LitBody:
        albedo, exitance = material_light(mean_materials(model))
        mesh, rest = model.mesh, None
        if solved is not None:
            mesh = self._mesh(model, solved.transport)
            rest = solved.indirect[solved.transport.patch_of_side]
        return LitBody(
            mesh=mesh,
            own_from_here=own_from_here.astype(np.float32),
            sides=2 if model.open_sheets else 1,
            albedo=albedo,
            exitance=exitance,
            sun_direction=sun_direction.astype(np.float32),
            sun_irradiance=sun_irradiance,
            solved=rest,
        )

    def _patches(self, craft: SpacecraftView, sky: SkyRadiance | None) -> _LitPatches | None:
        """The light on a spacecraft; None where nothing sees itself, or that light is left out."""
        if craft.exchange is None:
            return None
        transport = self._transports.of(craft.model)
        if transport is None:
            return None
        lit = craft.instance, craft.model, transport
        exitance = self._light.exitance(*lit, sky, craft.exchange)
        # Of its own place: nearer to a shadow's edge than its neighbour, it sees less of the Sun.
        of_sun = self._light.of_direct_sun(*lit, craft.exchange) * craft.exchange.sun_irradiance
        indirect = np.maximum(exitance - of_sun, 0.0).astype(np.float32)
        return _LitPatches(transport=transport, indirect=indirect)

    def _of_craft(self, craft: SpacecraftView, sky: SkyRadiance | None) -> VertexLighting | None:
        if craft.exchange is None:
            return None
        transport = self._transports.of(craft.model)
        if transport is None:
            return None
        cells = None if sky is None else cell_radiance(sky, CELLS_ACROSS)
        rows = self._rows.get(transport, lambda: vertex_rows(transport))
        # In the other thread while this one is busy with the bounces.
        share = beside().submit(earth_share, rows, cells)
        exitance = self._light.exitance(craft.instance, craft.model, transport, sky, craft.exchange)
        values = np.empty((*rows.shape, 5), dtype=np.float32)
        vertex_irradiance(rows, exitance, values)
        values[..., 4] = share.result()
        buffer = self._buffer(craft.instance, values.nbytes)
        buffer.write(values)
        two_sided = transport.sides == 2
        return VertexLighting(
            mesh=self._mesh(craft.model, transport),
            values=Values(buffer=buffer, layout=_FRONT | _BACK if two_sided else _FRONT),
            defines=("EXCHANGE", "TWO_SIDED") if two_sided else ("EXCHANGE",),
        )

    def _mesh(self, model: SpacecraftModel, transport: LightTransport) -> Mesh:
        """The transport's mesh with the joints where they are."""
        coarse = model.coarsely_posed(JOINT_STEP)
        if coarse is model:
            return transport.mesh
        key = transport.mesh.digest, model.angles
        if key in self._turned:
            self._turned.move_to_end(key)
            return self._turned[key]
        there = coarse.angles or (0.0,) * len(model.joints)
        rest = motion_between(model.joints, there, model.angles)
        self._turned[key] = moved_mesh(transport.mesh, model.joints, rest)
        if len(self._turned) > _TURNED_KEPT:
            self._turned.popitem(last=False)
        return self._turned[key]

    def _buffer(self, instance: int, size: int) -> moderngl.Buffer:
        key = instance, size
        if key not in self._buffers:
            self._buffers[key] = self._ctx.buffer(reserve=size, dynamic=True)
        return self._buffers[key]

    def release(self) -> None:
        """Free everything."""
        for buffer in self._buffers.values():
            buffer.release()
        self._buffers.clear()
