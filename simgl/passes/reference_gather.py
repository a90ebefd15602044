"""Interreflected light of every sample of a tile by rays: the reference for vertex lighting.

It takes tens of seconds where vertex lighting takes milliseconds, and is right in contacts and deep
shadows, where values of vertices are interpolated. A frame that asks for it (``gather = "pixel"``)
is drawn without vertex lighting, and this fills the G-buffer in its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
import scipy

from simgl.arrays import Array, Array32, IndexArray
from simgl.environment_map import SkyRadiance, cell_radiance
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.shading_points import ShadingPoints
from simgl.radiosity.final_gather import SKY_ACROSS, LitBody, Points, gathered, sunlight
from simgl.radiosity.gather_points import unit_rows
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.reflection_laws import reflection_laws
from simgl.radiosity.solver import material_light
from simgl.radiosity.transport_store import JointLight, TransportStore, lit_mesh
from simgl.scene.mean_materials import mean_materials
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.raster_tiles import RasterTile
from simgl.view.spacecraft_view import SpacecraftView

# Rays of a pixel, shared by its samples: so many at first, and up to so many times more where their
# mean is not certain to a share of all light there, or of the Sun's irradiance.
RAYS, MAX_TIMES = 256, 32
_CERTAIN, _CERTAIN_OF_SUN = 0.04, 1e-4
# Of the body's radius: planes this far apart are different surfaces.
_PLANE_STEP = 0.05

# Of the geometry pass's targets: place and label, normal, triangle's normal and share, others.
_POSITION, _NORMAL, _FACE_NORMAL, _INDIRECT = 0, 1, 2, 3


@dataclass(frozen=True, kw_only=True, eq=False)
class _LitPatches:
    """The light that leaves a body with a transport.

    indirect : (p, 4) of the patches after all bounces, less the Sun's before any [W m-2]
    """

    transport: LightTransport
    indirect: Array32


class ReferenceGather:
    """Fills the indirect light of the G-buffer: from other surfaces, and the Earth's share."""

    def __init__(self, transports: TransportStore, light: PatchLight) -> None:
        self._transports = transports
        self._light = light

    def lit_bodies(
        self,
        spacecraft: Sequence[SpacecraftView],
        skies: Sequence[SkyRadiance | None],
        joint_light: JointLight,
    ) -> list[tuple[LitBody, ...]]:
        """What rays from each spacecraft meet: itself, then what is near; none where
        no other surface is."""
        lit = {
            s.instance: self._lit_patches(s, sky, joint_light)
            for s, sky in zip(spacecraft, skies, strict=True)
        }
        return [self._bodies_around(s, lit) for s in spacecraft]

    def _bodies_around(
        self, viewer: SpacecraftView, lit: dict[int, _LitPatches | None]
    ) -> tuple[LitBody, ...]:
        incident, patches = viewer.incident_light, lit.get(viewer.instance)
        if incident is None:
            return ()
        near = [neighbour for neighbour in incident.around if neighbour.near]
        if patches is None and not near:
            return ()
        models = [(viewer.model, np.eye(4), patches)]
        models += [(n.model, n.other_from_body, lit.get(n.instance)) for n in near]
        irradiance = incident.sun_irradiance.astype(np.float32)
        return tuple(
            _lit_body(model, matrix, matrix[:3, :3] @ incident.sun_direction, irradiance, patches)
            for model, matrix, patches in models
        )

    def _lit_patches(
        self, spacecraft: SpacecraftView, sky: SkyRadiance | None, joint_light: JointLight
    ) -> _LitPatches | None:
        """The light on a spacecraft; None where nothing sees itself, or that light is left out."""
        if spacecraft.incident_light is None:
            return None
        transport = self._transports.of(spacecraft.model, joint_light)
        if transport is None:
            return None
        model, incident = spacecraft.model, spacecraft.incident_light
        exitance = self._light.exitance(model, transport, sky, incident)
        # The Sun's light is subtracted patch by patch: near a shadow's edge neighbours differ.
        direct_sun = self._light.of_direct_sun(model, transport, incident) * incident.sun_irradiance
        indirect = np.maximum(exitance - direct_sun, 0.0).astype(np.float32)
        return _LitPatches(transport=transport, indirect=indirect)

    def fill(
        self,
        tile: RasterTile,
        points: ShadingPoints,
        drawn: DrawnSpacecraft,
    ) -> None:
        """Overwrite what the G-buffer pass looked up of a spacecraft that has ``lit_bodies``."""
        if not drawn.lit_bodies:
            return
        textures = points.textures
        position, normal, face_normal, indirect = (
            _read(textures[target]) for target in (_POSITION, _NORMAL, _FACE_NORMAL, _INDIRECT)
        )
        columns, rows = points.size
        instance = position[..., 3].astype(np.int64) // 16384
        view = drawn.view
        of_this = (instance == view.instance) & (position[..., 3] >= 0.0)
        at = np.nonzero(of_this[:rows, :columns])
        if len(at[0]) == 0:
            return
        row, column = points.cells_of(at[0], at[1])
        seen = _points(view, position[at], normal[at], face_normal[at], _spread(row, column))
        cells = None if drawn.sky is None else cell_radiance(drawn.sky, SKY_ACROSS)
        per_edge = tile.sample_grid.cells_per_edge
        squares = _pixel_cells(per_edge, row, column)
        enough = _CERTAIN_OF_SUN * float(view.sun_irradiance.sum())
        rays = -(-RAYS // per_edge**2)
        light, share = _certain(seen, squares, drawn.lit_bodies, cells, rays, enough)
        indirect[at] = light
        face_normal[at[0], at[1], 3] = share
        for target, values in ((_FACE_NORMAL, face_normal), (_INDIRECT, indirect)):
            textures[target].write(np.ascontiguousarray(values))


def _lit_body(
    model: SpacecraftModel,
    body_from_viewer: Array,
    sun_direction: Array,
    sun_irradiance: Array32,
    patches: _LitPatches | None,
) -> LitBody:
    materials = mean_materials(model)
    albedo, exitance = material_light(materials)
    mesh, indirect = model.posed_mesh, None
    if patches is not None:
        mesh = lit_mesh(model, patches.transport)
        indirect = patches.indirect[patches.transport.patch_of_side]
    return LitBody(
        mesh=mesh,
        body_from_viewer=body_from_viewer.astype(np.float32),
        sides=2 if model.open_sheets else 1,
        albedo=albedo,
        exitance=exitance,
        laws=reflection_laws(materials),
        sun_direction=sun_direction.astype(np.float32),
        sun_irradiance=sun_irradiance,
        solved=indirect,
    )


def _read(texture: moderngl.Texture) -> Array32:
    data = np.frombuffer(texture.read(), dtype=np.float32)
    return data.reshape(texture.height, texture.width, 4).copy()


@dataclass(frozen=True, kw_only=True, eq=False)
class _Cells:
    """Squares of the raster of about a pixel's size.

    shape : rows and columns of them; of_point : (n,) the square of each point, row by row
    group : (n,) 0..3, four interleaved groups in each square
    """

    shape: tuple[int, int]
    of_point: IndexArray
    group: IndexArray


def _pixel_cells(per_edge: int, row: IndexArray, column: IndexArray) -> _Cells:
    """per_edge : shading points along the edge of a pixel"""
    edge = max(2, per_edge)
    shape = int(row.max()) // edge + 1, int(column.max()) // edge + 1
    return _Cells(
        shape=shape,
        of_point=row // edge * shape[1] + column // edge,
        group=row % 2 * 2 + column % 2,
    )


def _certain(
    points: Points,
    cells: _Cells,
    bodies: Sequence[LitBody],
    sky: Array32 | None,
    rays: int,
    enough: float,
) -> tuple[Array32, Array32]:
    """What ``gathered`` gives, with more rays in cells whose mean is uncertain.

    What is dark and uncertain even then takes the mean of the cells around.

    enough : an error that does not matter, bands together [W m-2]
    """
    light, share = gathered(points, bodies, sky, rays)
    mean, error = _means(light.sum(axis=1, dtype=np.float64), cells)
    sunlit = _means(sunlight(points, bodies).astype(np.float64), cells)[0]
    mean += sunlit
    need = error / np.maximum(_CERTAIN * mean, enough)
    if sky is not None:
        need = np.maximum(need, _means(share.astype(np.float64), cells)[1] / _CERTAIN)
    # Errors fall with the root of the number at least.
    times = np.clip(np.ceil(need**2), 1, MAX_TIMES).astype(np.int64)
    times = 2 ** np.ceil(np.log2(times)).astype(np.int64)
    for factor in np.unique(times[times > 1]).tolist():
        chosen = np.flatnonzero(times[cells.of_point] == factor)
        light[chosen], share[chosen] = gathered(points.of(chosen), bodies, sky, rays * factor)
    after, error = _means(light.sum(axis=1, dtype=np.float64), cells)
    # Where there is more light, three pixels may hold a contact or an edge.
    uncertain = (error > enough) & (_CERTAIN * (after + sunlit) < enough)
    step = _PLANE_STEP * bodies[0].mesh.radius
    return _evened(light, points, cells, np.flatnonzero(uncertain[cells.of_point]), step), share


def _evened(
    light: Array32, points: Points, cells: _Cells, uncertain: IndexArray, step: float
) -> Array32:
    """The light with that of uncertain points replaced by the mean of nine cells.

    step : points whose planes are this far apart do not count [m]

    Only what faces alike and lies in much the same plane counts: in deep shadow, where this comes
    to bear, light changes little over three pixels of a surface.
    """
    smoothed = light.copy()
    away = np.einsum("ij,ij->i", points.places, points.facets)[:, None] / np.float32(step)
    kind = np.unique(np.round(np.hstack([4.0 * points.facets, away])), axis=0, return_inverse=True)[
        1
    ].ravel()
    count = cells.shape[0] * cells.shape[1]
    for number in np.unique(kind[uncertain]).tolist():
        alike = np.flatnonzero(kind == number)
        chosen = uncertain[kind[uncertain] == number]
        values = np.column_stack([np.ones(len(alike)), light[alike]]).T
        weight, *bands = (
            scipy.ndimage.uniform_filter(
                np.bincount(cells.of_point[alike], v, minlength=count).reshape(cells.shape), 3
            ).ravel()[cells.of_point[chosen]]
            for v in values
        )
        smoothed[chosen] = np.stack(bands, axis=1) / weight[:, None]
    return smoothed


def _means(values: Array, cells: _Cells) -> tuple[Array, Array]:
    """Mean of each cell with its neighbours, and the error of one by the means of its four groups.

    Rays are spread so evenly that the mean is much surer than the scatter of single ones tells. The
    neighbours have their say, since a cell that misses a small bright surface looks certain.
    """
    count = cells.shape[0] * cells.shape[1]
    place = 4 * cells.of_point + cells.group
    number = np.bincount(place, minlength=4 * count).reshape(count, 4)
    sums = np.bincount(place, values, minlength=4 * count).reshape(count, 4)
    mean = sums.sum(axis=1) / np.maximum(number.sum(axis=1), 1)
    counted = number > 0
    deviation = np.where(counted, sums / np.maximum(number, 1) - mean[:, None], 0.0)
    groups = counted.sum(axis=1)
    square = (deviation**2).sum(axis=1) / np.maximum(groups * (groups - 1), 1)
    full = scipy.ndimage.uniform_filter((groups > 0).reshape(cells.shape).astype(np.float64), 3)
    around = np.maximum(full, 1e-9)
    mean, square = (
        (scipy.ndimage.uniform_filter(v.reshape(cells.shape), 3) / around).ravel()
        for v in (mean, square)
    )
    return mean, np.sqrt(np.maximum(square, 0.0))


def _points(
    view: SpacecraftView,
    position: Array32,
    normal: Array32,
    face_normal: Array32,
    spread: Array,
) -> Points:
    """Places and normals in body axes, normals towards the viewer."""
    camera_from_body = view.camera_from_body
    R = camera_from_body[:3, :3]
    in_camera = position[:, :3] @ R.T + camera_from_body[:3, 3]
    # Their lengths tell how normals spread (gbuffer/normal_spread.glsl).
    facets = unit_rows(face_normal[:, :3].astype(np.float64)).astype(np.float32)
    normals = unit_rows(normal[:, :3].astype(np.float64)).astype(np.float32)
    away = np.einsum("ij,ij->i", facets, in_camera) > 0.0
    facets = np.where(away[:, None], -facets, facets)
    return Points(places=position[:, :3], normals=normals @ R, facets=facets @ R, spread=spread)


def _spread(row: IndexArray, column: IndexArray) -> Array:
    """(n, 2) numbers 0..1, even over any neighbourhood of samples (as in sunlight.frag)."""
    first = 0.7548776662466927 * column + 0.5698402909980532 * row
    second = 0.8566748838545029 * column + 0.7338918566271260 * row
    return np.stack([(0.5 + first) % 1.0, (0.5 + second) % 1.0], axis=1)
