"""Light at vertices, summed on a GPU: what they gather of patches, sky and surfaces in the Sun.

A frame uploads what leaves the patches, some kilobytes. What stays the same is there already: the
gather matrices, and the tables of sunlight, each for one direction of the Sun.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import moderngl
import numpy as np
from scipy import sparse

from simgl.arrays import AnyArray, Array32
from simgl.gpu.compute_program import ComputeProgram
from simgl.gpu.mesh_tables import COLUMNS
from simgl.gpu.release import release_all
from simgl.lru_cache import MANY, LruCache
from simgl.passes.mesh_store import VertexLighting
from simgl.radiosity.hidden_sunlight import corners_of_nodes
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patch_light import UnsummedSunlight
from simgl.radiosity.precomputed_response import AtVertices

# Of the gather matrices of bodies, and of their tables of sunlight.
_MAX_BYTES = 512 << 20


@dataclass(frozen=True, kw_only=True, eq=False)
class SkyOfVertices:
    """The sky as the vertices of a body see it.

    cells : (c,) radiance as the transport knows it, mean of the bands
    per_free : (b,) 1 over what comes of it where no surface hides any
    """

    cells: Array32
    per_free: Array32

    @classmethod
    def of(cls, transport: LightTransport, cells: Array32 | None) -> SkyOfVertices | None:
        """Of cells (c, 4); in any thread."""
        if cells is None:
            return None
        mean = cells.mean(axis=1)
        # Not by BLAS: its threads keep the cores busy while they wait for the next product.
        free = np.einsum("bc,c->b", transport.of_vertices.all_sky, mean)
        return cls(cells=mean, per_free=np.float32(1.0) / np.maximum(free, np.float32(1e-30)))


@dataclass(frozen=True, kw_only=True, eq=False)
class VertexInputs:
    """What the light at the vertices of a body is made of.

    exitance : (p, 4) of its patches, but for what is in the tables of sunlight [W m-2]
    sky : None for a dark one
    sunlight : None without a Sun
    near : of other spacecraft, ``near_table``; None where they have no part in it
    """

    transport: LightTransport
    exitance: Array32
    sky: SkyOfVertices | None
    sunlight: UnsummedSunlight | None
    near: Array32 | None


def near_table(irradiance: Array32, hidden: Array32) -> Array32:
    """(r + r / 4, 4) what the vertices of a body get of other spacecraft, as a GPU reads it; in any
    thread.

    irradiance : (r, 4) by them [W m-2]
    hidden : (r,) share of the sky that they hide
    """
    count = len(hidden)
    rows = np.empty((count + -(-count // 4), 4), dtype=np.float32)
    rows[:count] = irradiance
    shares = rows[count:].reshape(-1)
    shares[:count], shares[count:] = hidden, 0.0
    return rows


class _Gathering:
    """What stays the same of a body, on the GPU."""

    def __init__(self, ctx: moderngl.Context, transport: LightTransport) -> None:
        matrix = transport.of_vertices
        seen, complement = matrix.open_sky
        self.points, self.rows = matrix.gather.shape[0], len(matrix.rows)
        self.patches = _sparse(ctx, matrix.gather)
        self.sky = _sparse(ctx, seen)
        self.sharpened = None if matrix.sharpened is None else _sparse(ctx, matrix.sharpened)
        self.point_of_row = _buffer(ctx, matrix.rows.astype(np.uint32))
        self.sky_row = _buffer(ctx, matrix.sky_rays_row.astype(np.uint32))
        self.complement = _buffer(ctx, complement)
        self.no_sky = _buffer(ctx, np.ones(self.points, dtype=np.float32))
        self.corners, self.nodes = None, 0
        if transport.grids is not None:
            corners = transport.vertex_rows[corners_of_nodes(transport).T]
            self.corners, self.nodes = _buffer(ctx, corners.astype(np.uint32)), len(corners)

    @property
    def _buffers(self) -> list[moderngl.Buffer]:
        corners = [] if self.corners is None else [self.corners]
        sharpened = () if self.sharpened is None else self.sharpened
        others = self.point_of_row, self.sky_row, self.complement, self.no_sky
        return [*self.patches, *self.sky, *sharpened, *others, *corners]

    @property
    def nbytes(self) -> int:
        """Of all buffers."""
        return sum(int(buffer.size) for buffer in self._buffers)

    def release(self) -> None:
        """Free them."""
        for buffer in self._buffers:
            buffer.release()


class VertexSums:
    """Fills the tables of light at the vertices and on the grids of bodies."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._gatherings = LruCache[str, _Gathering](MANY, _Gathering.release, max_bytes=_MAX_BYTES)
        self._tables = LruCache[AtVertices, moderngl.Buffer](
            MANY, moderngl.Buffer.release, max_bytes=_MAX_BYTES
        )
        self._programs: dict[tuple[str, ...], ComputeProgram] = {}
        # What lasts for one body: the drivers keep a buffer until it has been read.
        self._working: dict[str, moderngl.Buffer] = {}

    def reserve(self, bodies: int) -> None:
        """What so many bodies need stays, whatever its size."""
        self._gatherings.reserve(bodies)
        self._tables.reserve(3 * bodies)

    def write(self, inputs: VertexInputs, lighting: VertexLighting) -> None:
        """Fill the tables of a lighting."""
        transport = inputs.transport
        of_body = self._gatherings.get(
            transport.digest,
            lambda: _Gathering(self._ctx, transport),
            lambda made: made.nbytes,
        )
        light, left = self._at_points(of_body, inputs)
        share = self._sky_share(of_body, inputs)
        if of_body.sharpened is not None:
            light, share = self._sharpened(of_body, of_body.sharpened, light, share)
        tables, amounts, first_node = self._sunlight(inputs.sunlight)
        sunlit = [] if inputs.sunlight is None else ["SUNLIT"]
        near, others = self._near(inputs)
        lighting.light.bind_to_image(0)
        self._program("vertices", [*sunlit, *near], ("count", *amounts)).run(
            (lighting.light.width // 2, lighting.light.height, 1),
            (*tables, of_body.point_of_row, light, left, share, *others),
            count=of_body.rows,
            **amounts,
        )
        if lighting.grids is not None:
            assert of_body.corners is not None
            lighting.grids.light.bind_to_image(0)
            self._program("nodes", sunlit, ("first_node", "count", *amounts)).run(
                (lighting.grids.light.width, lighting.grids.light.height, 1),
                (*tables, of_body.corners, left),
                first_node=first_node,
                count=of_body.nodes,
                **amounts,
            )

    def _at_points(
        self, of_body: _Gathering, inputs: VertexInputs
    ) -> tuple[moderngl.Buffer, moderngl.Buffer]:
        """Irradiance by patches, and what others leave of the Sun's light between surfaces."""
        light = self._reserved("light", 16 * of_body.points)
        left = self._reserved("left", 4 * of_body.points)
        buffers = [*of_body.patches, self._written("exitance", inputs.exitance), light, left]
        defines = []
        if inputs.sunlight is not None and inputs.sunlight.taken is not None:
            taken = inputs.sunlight.taken
            defines.append("TAKEN")
            buffers.append(self._written("taken at patches", taken.at_patches))
            buffers.append(self._written("taken at points", taken.at_points))
        self._program("points", defines, ("points",)).run(
            _grid(of_body.points), buffers, points=of_body.points
        )
        return light, left

    def _sky_share(self, of_body: _Gathering, inputs: VertexInputs) -> moderngl.Buffer:
        if inputs.sky is None:
            return of_body.no_sky
        share = self._reserved("share", 4 * of_body.points)
        buffers = (
            *of_body.sky,
            self._written("cells", inputs.sky.cells),
            self._written("free", inputs.sky.per_free),
            of_body.sky_row,
            of_body.complement,
            share,
        )
        self._program("sky", (), ("points",)).run(
            _grid(of_body.points), buffers, points=of_body.points
        )
        return share

    def _sharpened(
        self,
        of_body: _Gathering,
        matrix: tuple[moderngl.Buffer, moderngl.Buffer],
        light: moderngl.Buffer,
        share: moderngl.Buffer,
    ) -> tuple[moderngl.Buffer, moderngl.Buffer]:
        """Irradiance and share of the sky at gather points, of what their rays found."""
        sharp_light = self._reserved("sharp light", 16 * of_body.points)
        sharp_share = self._reserved("sharp share", 4 * of_body.points)
        self._program("sharpen", (), ("points",)).run(
            _grid(of_body.points),
            (*matrix, light, share, sharp_light, sharp_share),
            points=of_body.points,
        )
        return sharp_light, sharp_share

    def _sunlight(
        self, sunlight: UnsummedSunlight | None
    ) -> tuple[list[moderngl.Buffer], dict[str, tuple[float, ...]], int]:
        """Three tables, how much of each there is, and where nodes begin in them."""
        if sunlight is None:
            # Bindings that no shader reads.
            return [self._reserved("nothing", 16)] * 3, {}, 0
        tables = [
            self._tables.get(one, partial(_buffer, self._ctx, one.rows), one.rows.nbytes)
            for one, _ in sunlight.tables.tables
        ]
        names = "of_first", "of_second", "of_third"
        amounts = {
            name: tuple(amount.tolist())
            for name, (_, amount) in zip(names, sunlight.tables.tables, strict=True)
        }
        return tables, amounts, sunlight.tables.first_node

    def _near(self, inputs: VertexInputs) -> tuple[list[str], list[moderngl.Buffer]]:
        """Of other spacecraft, where they have a part in it."""
        if inputs.near is None:
            return [], []
        return ["NEAR"], [self._written("near", inputs.near)]

    def _reserved(self, use: str, nbytes: int) -> moderngl.Buffer:
        """A buffer of at least so many bytes."""
        present = self._working.get(use)
        if present is None or present.size < nbytes:
            if present is not None:
                present.release()
            self._working[use] = self._ctx.buffer(reserve=nbytes)
        return self._working[use]

    def _written(self, use: str, values: AnyArray) -> moderngl.Buffer:
        buffer = self._reserved(use, values.nbytes)
        buffer.write(np.ascontiguousarray(values, dtype=np.float32).data)
        return buffer

    def _program(
        self, name: str, defines: Sequence[str], parameters: Sequence[str]
    ) -> ComputeProgram:
        key = name, *defines
        if key not in self._programs:
            self._programs[key] = ComputeProgram(
                self._ctx,
                f"interreflection/{name}",
                parameters=parameters,
                defines=dict.fromkeys(defines, 1),
            )
        return self._programs[key]

    def release(self) -> None:
        """Free everything."""
        self._gatherings.clear()
        self._tables.clear()
        release_all(self._ctx, *self._programs.values(), *self._working.values())
        self._programs.clear()
        self._working.clear()


def _grid(count: int) -> tuple[int, int, int]:
    """Of at least so many places, in rows as long as those of tables."""
    return COLUMNS, -(-count // COLUMNS), 1


def _buffer(ctx: moderngl.Context, values: AnyArray) -> moderngl.Buffer:
    return ctx.buffer(np.ascontiguousarray(values).tobytes())


def _sparse(
    ctx: moderngl.Context, matrix: sparse.csc_matrix
) -> tuple[moderngl.Buffer, moderngl.Buffer]:
    """Where rows begin, and their entries: column and value."""
    by_rows = matrix.tocsr()
    entries = np.empty((max(by_rows.nnz, 1), 2), dtype=np.uint32)
    entries[: by_rows.nnz, 0] = by_rows.indices
    entries[: by_rows.nnz, 1] = by_rows.data.astype(np.float32).view(np.uint32)
    return _buffer(ctx, by_rows.indptr.astype(np.uint32)), _buffer(ctx, entries)
