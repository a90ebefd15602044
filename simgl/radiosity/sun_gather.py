"""Form factors of gather points by many rays, for light that is gathered once for many frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy import sparse

from simgl.arrays import Array32, IndexArray, Mask
from simgl.radiosity.gather_points import BURIED, PLACES, GatherPoints, face_normals
from simgl.radiosity.hemisphere import cosine_directions, frames, spins
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh

# Gather points whose rays are traced together.
_AT_ONCE = 128


def point_form_factors(
    mesh: Mesh,
    tracer: RayTracer,
    points: GatherPoints,
    chosen: Mask,
    sides: int,
    patch_of_side: IndexArray,
    rays: int,
    spun: bool,
    tick: Callable[[int], None],
) -> tuple[sparse.csr_matrix, Mask]:
    """(s, p) share of the cosine-weighted hemisphere of gather points that patches cover, and (s,)
    which points are inside another part.

    chosen : (s,) which points; the rows of the others stay empty
    rays : of each point, a multiple of ``PLACES``
    spun : whether they are turned about the normal from point to point, so that what few rays miss
        evens out between neighbours
    tick : gets how many points are done
    """
    pattern = cosine_directions(rays).astype(np.float32)
    faces = face_normals(mesh)[0].astype(np.float32)
    turns = frames(points.normals)
    turns = (turns @ spins(len(turns)) if spun else turns).astype(np.float32)
    patches = int(patch_of_side.max()) + 1
    buried = np.zeros(len(chosen), dtype=np.bool_)

    def counted(part: IndexArray) -> sparse.csr_matrix:
        turn = turns[part]
        directions = np.matmul(pattern[None], np.swapaxes(turn, 1, 2)).reshape(-1, 3)
        origins = np.tile(points.origins[part].astype(np.float32), (1, rays // PLACES, 1))
        triangle, _ = tracer.hits(origins.reshape(-1, 3), directions)
        met = np.flatnonzero(triangle >= 0)
        triangle = triangle[met].astype(np.int64)
        behind = np.einsum("ij,ij->i", faces[triangle], directions[met]) > 0.0
        if sides == 1:
            share, buried[part] = _shares(met, behind, len(part), rays)
        else:
            triangle += len(faces) * behind
            share = np.ones(len(met), dtype=np.float32)
        entries = share / np.float32(rays), (met // rays, patch_of_side[triangle])
        return sparse.coo_matrix(entries, shape=(len(part), patches)).tocsr()

    rows = np.flatnonzero(chosen)
    parts = [rows[i : i + _AT_ONCE] for i in range(0, len(rows), _AT_ONCE)]
    if not parts:
        return sparse.csr_matrix((len(chosen), patches), dtype=np.float32), buried
    shares = sparse.vstack(list(_in_turn(counted, parts, tick)), format="csr")
    lengths = np.zeros(len(chosen) + 1, dtype=np.int64)
    lengths[1 + rows] = np.diff(shares.indptr)
    rows_of_all = shares.data, shares.indices, np.cumsum(lengths)
    return sparse.csr_matrix(rows_of_all, shape=(len(chosen), patches)), buried


def _shares(ray: IndexArray, behind: Mask, points: int, rays: int) -> tuple[Array32, Mask]:
    """(n,) what each ray that met a closed body counts: those of a place inside another part do not
    count, and the others of its point stand for them, as in ``gather_points.cast``. Also of which
    points (k,) no place is outside."""
    place = ray // rays * PLACES + ray % PLACES
    inside = np.bincount(place[behind], minlength=points * PLACES)
    usable = inside <= BURIED * rays / PLACES
    number = usable.reshape(-1, PLACES).sum(axis=1)
    each = np.repeat(PLACES / np.maximum(number, 1), PLACES)
    share: Array32 = np.where(usable, each, 0.0).astype(np.float32)[place]
    share[behind] = 0.0
    return share, number == 0


def _in_turn(
    counted: Callable[[IndexArray], sparse.csr_matrix],
    parts: list[IndexArray],
    tick: Callable[[int], None],
) -> Iterator[sparse.csr_matrix]:
    """The results in order, two at a time: numpy and Embree mostly release Python's lock."""
    done = 0
    with ThreadPoolExecutor(max_workers=2) as threads:
        for part, result in zip(parts, threads.map(counted, parts), strict=True):
            done += len(part)
            tick(done)
            yield result
