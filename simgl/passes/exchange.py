"""Light between the surfaces of each spacecraft, as values of its vertices."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from simgl.gpu.geometry import Values
from simgl.levels.levels import Levels, levels_of
from simgl.passes.meshes import Drawn, MeshStore, VertexLighting
from simgl.scene.joints import motion_between, moved_mesh
from simgl.scene.means import mean_materials
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.sky import SkyRadiance, cell_radiance
from simgl.transport.bake import Progress
from simgl.transport.cache import transport_of
from simgl.transport.directions import CELLS_ACROSS
from simgl.transport.gather import LitBody
from simgl.transport.response import Response
from simgl.transport.rows import VertexRows, vertex_rows
from simgl.transport.solve import (
    Reflectors,
    beside,
    earth_share,
    lamp_irradiance,
    material_light,
    reflectors,
    vertex_irradiance,
)
from simgl.transport.sunlit import SunlitPatches
from simgl.transport.transport import Floats, Transport
from simgl.transport.vertices import light_on_vertices
from simgl.transport.view import ExchangeView, Neighbour
from simgl.view.frame import CraftView

# Light between surfaces changes little over a few degrees of a joint, and tracing it takes seconds.
JOINT_STEP = np.radians(5.0)

# Meshes with joints between these steps, for poses that come back.
_TURNED_KEPT = 8

# Sets of vertices whose rows are kept, up to 15 MB each.
_ROWS_KEPT = 8

_FRONT = {"in_bounced": "4f", "in_earth_share": "1f"}
_BACK = {"in_bounced_back": "4f", "in_earth_share_back": "1f"}


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """cosines : (p,) of the Sun; exitance : (p, 4) of the patches after all bounces [W m-2]."""

    transport: Transport
    surface: Reflectors
    cosines: Floats
    exitance: Floats


class ExchangePass:
    """Solves the exchange for spacecraft with surfaces that see each other; others have none."""

    def __init__(self, ctx: moderngl.Context, meshes: MeshStore) -> None:
        self._ctx, self._meshes = ctx, meshes
        self._rows: OrderedDict[tuple[int, Drawn | None], VertexRows] = OrderedDict()
        self._transports: dict[tuple[str, bool], Transport | None] = {}
        self._surfaces: dict[tuple[object, ...], tuple[Reflectors, Response]] = {}
        self._sunlit: dict[int, SunlitPatches] = {}
        self._cosines: dict[int, tuple[bytes, Floats]] = {}
        self._buffers: dict[tuple[int, int], moderngl.Buffer] = {}
        self._levels: dict[str, Levels] = {}
        self._turned: OrderedDict[tuple[object, ...], Mesh] = OrderedDict()

    def transport(
        self, model: SpacecraftModel, progress: Progress | None = None
    ) -> Transport | None:
        """How a model's surfaces see each other; traced at the first call, if no file has it.

        Joints stand at the nearest multiple of ``JOINT_STEP``.
        """
        model = model.coarsely_posed(JOINT_STEP)
        key = model.mesh.digest, model.open_sheets
        if key not in self._transports:
            self._transports[key] = transport_of(
                model.mesh, open_sheets=model.open_sheets, progress=progress
            )
        return self._transports[key]

    def levels(
        self, model: SpacecraftModel, progress: Progress | None = None
    ) -> tuple[Mesh, Levels] | None:
        """The mesh that carries a model's light, and its levels; None where nothing sees itself.

        model : with its joints as stored
        """
        transport = self.transport(model, progress)
        if transport is None:
            return None
        key = transport.mesh.digest
        if key not in self._levels:
            values = light_on_vertices(transport)
            self._levels[key] = levels_of(transport.mesh, progress, values)
        return transport.mesh, self._levels[key]

    def draw(
        self, craft: Sequence[CraftView], skies: Sequence[SkyRadiance | None]
    ) -> list[VertexLighting | None]:
        """The values of each spacecraft; None where nothing sees itself. Valid until the next call.

        skies : what each sees around it
        """
        return [self._of_craft(c, sky) for c, sky in zip(craft, skies, strict=True)]

    def bodies(
        self, craft: Sequence[CraftView], skies: Sequence[SkyRadiance | None]
    ) -> list[list[LitBody] | None]:
        """What rays from each spacecraft meet: itself, then what is near; None where nothing is."""
        solved = {
            c.instance: self._solved(c, sky, c.exchange)
            for c, sky in zip(craft, skies, strict=True)
            if c.exchange is not None
        }
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
        own_from_here: NDArray[np.float64],
        sun_direction: NDArray[np.float64],
        sun_irradiance: Floats,
        solved: _Solved | None,
    ) -> LitBody:
        albedo, exitance = material_light(mean_materials(model))
        mesh, rest = model.mesh, None
        if solved is not None:
            mesh = self._mesh(model, solved.transport)
            sunlit = solved.surface.albedo * solved.cosines[:, None] * sun_irradiance
            rest = np.maximum(solved.exitance - sunlit, 0.0)[solved.transport.patch_of_side]
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

    def _solved(
        self, craft: CraftView, sky: SkyRadiance | None, view: ExchangeView
    ) -> _Solved | None:
        """The light on the patches of a spacecraft; None where nothing sees itself."""
        transport = self.transport(craft.model)
        if transport is None:
            return None
        return _Solved(
            transport=transport,
            surface=self._surface(craft.model, transport)[0],
            cosines=self._sun_cosines(craft.instance, transport, view),
            exitance=self._exitance(craft, transport, sky, view),
        )

    def _exitance(
        self, craft: CraftView, transport: Transport, sky: SkyRadiance | None, view: ExchangeView
    ) -> Floats:
        """(p, 4) of the patches after all bounces [W m-2]."""
        response = self._surface(craft.model, transport)[1]
        exitance = response.glow
        others = np.zeros_like(exitance)
        if view.before_sun:
            cosines = self._sun_cosines(craft.instance, transport, view)
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

    def _of_craft(self, craft: CraftView, sky: SkyRadiance | None) -> VertexLighting | None:
        if craft.exchange is None:
            return None
        transport = self.transport(craft.model)
        if transport is None:
            return None
        cells = None if sky is None else cell_radiance(sky, CELLS_ACROSS)
        drawn = self._meshes.vertices(craft.model, craft.detail)
        rows = self._rows_of(transport, drawn)
        # In the other thread while this one is busy with the bounces.
        share = beside().submit(earth_share, rows, cells)
        exitance = self._exitance(craft, transport, sky, craft.exchange)
        values = np.empty((*rows.shape, 5), dtype=np.float32)
        vertex_irradiance(rows, exitance, values)
        values[..., 4] = share.result()
        if drawn is not None:
            some, count = values, len(transport.mesh.positions)
            values = np.zeros((count, *some.shape[1:]), dtype=np.float32)
            values[drawn.vertices] = some
        buffer = self._buffer(craft.instance, values.nbytes)
        buffer.write(values)
        two_sided = transport.sides == 2
        return VertexLighting(
            mesh=self._mesh(craft.model, transport),
            values=Values(
                buffer=buffer,
                layout=_FRONT | _BACK if two_sided else _FRONT,
            ),
            defines=("EXCHANGE", "TWO_SIDED") if two_sided else ("EXCHANGE",),
        )

    def _rows_of(self, transport: Transport, drawn: Drawn | None) -> VertexRows:
        """For the vertices that are drawn: of a spacecraft far away some of them only."""
        key = id(transport), drawn
        if key not in self._rows:
            if len(self._rows) >= _ROWS_KEPT:
                self._rows.popitem(last=False)
            vertices = None if drawn is None else drawn.vertices
            self._rows[key] = vertex_rows(transport, vertices)
        self._rows.move_to_end(key)
        return self._rows[key]

    def _mesh(self, model: SpacecraftModel, transport: Transport) -> Mesh:
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

    def _surface(self, model: SpacecraftModel, transport: Transport) -> tuple[Reflectors, Response]:
        key = transport.mesh.digest, model.open_sheets, model.materials, model.textures.digest
        if key not in self._surfaces:
            surface = reflectors(transport, mean_materials(model))
            sunlit = self._patches(transport)
            self._surfaces[key] = surface, Response(transport, surface, sunlit)
        return self._surfaces[key]

    def _patches(self, transport: Transport) -> SunlitPatches:
        return self._sunlit.setdefault(id(transport), SunlitPatches(transport))

    def _sun_cosines(self, instance: int, transport: Transport, view: ExchangeView) -> Floats:
        """Traced anew only where Sun or spacecraft have moved in the body's axes."""
        key = _sun_key(transport, view)
        if self._cosines.get(instance, (b"",))[0] != key:
            blockers = [n.blocker() for n in view.before_sun]
            lit = self._patches(transport).cosines(view.sun_direction, blockers)
            self._cosines[instance] = key, lit
        return self._cosines[instance][1]

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


def _sun_key(transport: Transport, view: ExchangeView) -> bytes:
    def place(neighbour: Neighbour) -> bytes:
        return neighbour.mesh.digest.encode() + neighbour.other_from_body.tobytes()

    parts = [transport.mesh.digest.encode(), view.sun_direction.tobytes()]
    return b"".join(parts + [place(n) for n in view.before_sun])
