"""The thermal model of a spacecraft: its patches, their properties, and the network of both."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from simgl.arrays import Array, IndexArray
from simgl.radiosity.gather_points import face_normals
from simgl.radiosity.patches import Patches, cluster
from simgl.radiosity.reflection_laws import hemispherical_albedo
from simgl.radiosity.remesh import subdivided
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh, position_ids
from simgl.scene.posed_mesh import groups_of_parts
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.thermal_surface import ThermalPart, ThermalSurface
from simgl.thermal.inner_nodes import laplacian, linked_pairs
from simgl.thermal.network import ThermalNetwork
from simgl.thermal.view_factors import ViewFactors, radiative_coupling, view_factors

# Of the structure within a part, an estimate: 300 kg m-3 of 900 J kg-1 K-1, between a honeycomb
# panel (200) and a small satellite (1000) [J m-3 K-1]; and of a part without volume [J K-1].
STRUCTURE_HEAT_CAPACITY = 270e3
_MIN_STRUCTURE = 1.0
# Of the skin along itself, an estimate: 0.6 mm of aluminium facesheet, 0.1 W K-1.
SHEET_CONDUCTANCE = 0.1
# Of a surface that says nothing, an estimate: most paints and plastics, and bare metal.
_EMISSIVITY, _METAL_EMISSIVITY = 0.85, 0.08
_SKIN_HEAT_CAPACITY, _SKIN_CONDUCTANCE = 2000.0, 5.0
# Skin that is this poor a conductor to its structure is foil, which conducts nothing along itself.
_FOIL_CONDUCTANCE = 0.1
# The sunlight that R, G, B, N stand for, the near infrared for all beyond 700 nm (5772 K).
_SUNLIGHT = np.array([0.113, 0.128, 0.126, 0.633])


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalBody:
    """A spacecraft as a thermal network of n nodes: its p patches first, then the structures of
    its parts, then what is inside.

    mesh : its triangles as stored, subdivided
    patches : clusters of them; ``of_side`` gives the patch of each triangle's front, then back
    part : (p,) of each patch; group : (p,) the rigid group that joints move
    absorptance, emissivity : (p,) of the patches, means over their materials
    views : the view factors with all joints as stored
    power : (n,) internal [W]
    """

    name: str
    model: SpacecraftModel
    mesh: Mesh
    patches: Patches
    part: IndexArray
    group: IndexArray
    absorptance: Array
    emissivity: Array
    views: ViewFactors
    network: ThermalNetwork
    power: Array

    @property
    def patch_count(self) -> int:
        """Nodes that are patches."""
        return len(self.patches.areas)

    @property
    def sides(self) -> int:
        """Of a triangle that are patches: 2 of open sheets."""
        return len(self.patches.of_side) // len(self.mesh.triangles)

    @cached_property
    def faces(self) -> tuple[Array, Array]:
        """(m, 3) normals and (m,) areas of its triangles, as stored."""
        return face_normals(self.mesh)

    @cached_property
    def at_vertices(self) -> sparse.csr_matrix:
        """(vertices x sides, p) means of patches over the triangles about each vertex, by area.

        A vertex has one part and one material, so that nothing is mixed across their borders.
        Patches inside other parts count where there is nothing else.
        """
        count, sides = len(self.mesh.positions), self.sides
        areas = self.faces[1]
        weight = np.tile(np.maximum(areas, 1e-12 * max(float(areas.max()), 1e-30)), sides)
        weight *= np.where(self.views.covered[self.patches.of_side], 1e-6, 1.0)
        corners = np.tile(self.mesh.triangles.astype(np.int64), (sides, 1))
        side = np.repeat(np.arange(sides), len(areas))
        rows = (sides * corners + side[:, None]).ravel()
        columns = np.repeat(self.patches.of_side, 3)
        shape = sides * count, self.patch_count
        sums = sparse.csr_matrix((np.repeat(weight, 3), (rows, columns)), shape=shape)
        total = np.maximum(np.asarray(sums.sum(axis=1)).ravel(), 1e-300)
        return sparse.csr_matrix(sparse.diags_array(1.0 / total) @ sums)

    @property
    def part_names(self) -> tuple[str, ...]:
        """The parts, whose structures are the nodes behind the patches."""
        return self.model.parts

    @property
    def inner_names(self) -> tuple[str, ...]:
        """The nodes inside, behind the structures."""
        return tuple(self.model.thermal_nodes)


def thermal_surface(material: Material) -> ThermalSurface:
    """What a material gives; an estimate from its reflectance where it says nothing."""
    if material.thermal is not None:
        return material.thermal
    metal = material.metallic > 0.5 and material.coat is None
    return ThermalSurface(
        solar_absorptance=float(1.0 - _SUNLIGHT @ hemispherical_albedo(material)),
        infrared_emissivity=_METAL_EMISSIVITY if metal else _EMISSIVITY,
        heat_capacity=_SKIN_HEAT_CAPACITY,
        conductance=_SKIN_CONDUCTANCE,
    )


def thermal_body(name: str, model: SpacecraftModel, count: int = 1500) -> ThermalBody:
    """The thermal network of a model.

    count : about as many patches

    Nodes of a part conduct along its skin and to one node for its structure. Deterministic: the
    same model and count give the same network.
    """
    sides = 2 if model.open_sheets else 1
    stored = model if model.stored is None else model.stored
    area = float(face_normals(stored.mesh)[1].sum())
    mesh = subdivided(stored.mesh, 1.5 * float(np.sqrt(sides * area / count)))
    faces = len(mesh.triangles)
    patches = cluster(mesh, sides, np.ones(sides * faces), count)
    views = view_factors(mesh, sides, patches)
    part = _of_patches(patches, np.tile(mesh.part[mesh.triangles[:, 0]].astype(np.int64), sides))
    surfaces = _surfaces(model, patches, part)
    coupling, to_space = radiative_coupling(views, surfaces.infrared_emissivity)
    parts = [model.thermal.get(p, ThermalPart()) for p in model.parts]
    inner = list(model.thermal_nodes.values())
    conductances, radiative = linked_pairs(model)
    skin = patches.areas * surfaces.heat_capacity
    default = np.maximum(STRUCTURE_HEAT_CAPACITY * _volumes(mesh, len(parts)), _MIN_STRUCTURE)
    structure = [
        d if p.heat_capacity is None else p.heat_capacity
        for d, p in zip(default, parts, strict=True)
    ]
    p = len(patches.areas)
    skins = _skin_conductances(mesh, patches, part, surfaces, parts, sides)
    skins.resize(p + conductances.shape[0], p + conductances.shape[0])
    links = sparse.block_diag([sparse.csr_matrix((p, p)), conductances])
    network = ThermalNetwork(
        capacity=np.maximum(
            np.concatenate([skin, structure, [one.heat_capacity for one in inner]]), 1e-3
        ),
        conduction=laplacian(sparse.csr_matrix(skins + links)),
        coupling=sparse.csr_matrix(sparse.block_diag([coupling, radiative])),
        to_space=np.concatenate([to_space, np.zeros(conductances.shape[0])]),
    )
    groups = groups_of_parts(stored.mesh, model.joints)
    return ThermalBody(
        name=name,
        model=stored,
        mesh=mesh,
        patches=patches,
        part=part,
        group=groups[part],
        absorptance=surfaces.solar_absorptance,
        emissivity=surfaces.infrared_emissivity,
        views=views,
        network=network,
        power=np.concatenate(
            [np.zeros(p), [one.power for one in parts], [one.power for one in inner]]
        ),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _PatchSurfaces:
    """The fields of ThermalSurface for (p,) patches."""

    solar_absorptance: Array
    infrared_emissivity: Array
    heat_capacity: Array
    conductance: Array


def _of_patches(patches: Patches, of_side: IndexArray) -> IndexArray:
    """(p,) what the sides (m,) of a patch have in common."""
    result = np.zeros(len(patches.areas), dtype=np.int64)
    result[patches.of_side] = of_side
    return result


def _surfaces(model: SpacecraftModel, patches: Patches, part: IndexArray) -> _PatchSurfaces:
    used = [thermal_surface(m) for m in model.materials[: patches.materials.shape[1]]]
    names = ("solar_absorptance", "infrared_emissivity", "heat_capacity", "conductance")
    values = {
        name: np.asarray(patches.materials @ np.array([getattr(s, name) for s in used]))
        for name in names
    }
    for index, title in enumerate(model.parts):
        given = model.thermal.get(title, ThermalPart()).surface
        if given is not None:
            for name in names:
                values[name][part == index] = getattr(given, name)
    return _PatchSurfaces(**values)


def _volumes(mesh: Mesh, parts: int) -> Array:
    """(parts,) volume that the triangles of each part enclose [m3]; of open ones, about."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    part = mesh.part[mesh.triangles[:, 0]].astype(np.int64)
    count = np.maximum(np.bincount(part, minlength=parts), 1)
    middles = np.stack(
        [np.bincount(part, c, minlength=parts) / count for c in corners.mean(axis=1).T], axis=1
    )
    a, b, c = np.moveaxis(corners - middles[part, None], 1, 0)
    tetrahedra = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    return np.abs(np.bincount(part, tetrahedra, minlength=parts))


def _skin_conductances(
    mesh: Mesh,
    patches: Patches,
    part: IndexArray,
    surfaces: _PatchSurfaces,
    parts: list[ThermalPart],
    sides: int,
) -> sparse.csr_matrix:
    """(p + parts, p + parts) conductances between patches, and to the structures [W K-1]."""
    count = len(patches.areas)
    first, second, length = _shared_edges(mesh, patches, sides)
    middles = _middles(mesh, patches, sides)
    distance = np.linalg.norm(middles[first] - middles[second], axis=1)
    sheet = np.array(
        [SHEET_CONDUCTANCE if p.sheet_conductance is None else p.sheet_conductance for p in parts]
    )
    foil = surfaces.conductance < _FOIL_CONDUCTANCE
    given = np.array([p.sheet_conductance is not None for p in parts])
    conducts = ~foil | given[part]
    joined = (part[first] == part[second]) & conducts[first] & conducts[second]
    along = np.where(joined, sheet[part[first]] * length / np.maximum(distance, 1e-9), 0.0)
    through = surfaces.conductance * patches.areas
    rows = np.concatenate([first, np.arange(count)])
    columns = np.concatenate([second, count + part])
    values = np.concatenate([along, through])
    size = count + len(parts)
    pairs = sparse.csr_matrix((values, (rows, columns)), shape=(size, size))
    return sparse.csr_matrix(pairs + pairs.T)


def _middles(mesh: Mesh, patches: Patches, sides: int) -> Array:
    """(p, 3) centroids of the patches, stored mesh [m]."""
    areas = np.tile(face_normals(mesh)[1], sides)
    centroids = np.tile(mesh.positions[mesh.triangles].mean(axis=1), (sides, 1))
    count = len(patches.areas)
    total = np.maximum(np.bincount(patches.of_side, areas, count), 1e-30)
    sums = [np.bincount(patches.of_side, areas * one, count) for one in centroids.T]
    return np.stack(sums, axis=1) / total[:, None]


def _shared_edges(mesh: Mesh, patches: Patches, sides: int) -> tuple[IndexArray, IndexArray, Array]:
    """Pairs of patches that touch, each once, and the length of the edge between them [m]."""
    triangles = mesh.triangles.astype(np.int64)
    place = position_ids(mesh.positions)[triangles]
    corners = mesh.positions[triangles].astype(np.float64)
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).ravel()
    ends = np.sort(np.stack([place, np.roll(place, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    key = ends[:, 0] * (int(place.max()) + 1) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    # Neighbours in this order share an edge; of three triangles at one, two pairs.
    same = key[order][1:] == key[order][:-1]
    a, b = order[:-1][same], order[1:][same]
    firsts, seconds, edge = [], [], []
    for side in range(sides):
        of_side = patches.of_side[side * len(triangles) :]
        firsts.append(of_side[a // 3])
        seconds.append(of_side[b // 3])
        edge.append(lengths[a])
    first, second = np.concatenate(firsts), np.concatenate(seconds)
    differ = first != second
    return first[differ], second[differ], np.concatenate(edge)[differ]


def patches_met(body: ThermalBody, triangle: IndexArray, direction: Array) -> IndexArray:
    """(k,) the patch on the side that rays meet.

    triangle : (k,) of the body's mesh; -1 gives any patch
    direction : (3,) or (k, 3) of the rays, in the axes of the stored mesh
    """
    index = np.maximum(triangle, 0).astype(np.int64)
    normals, areas = body.faces
    if len(body.patches.of_side) > len(areas):
        away = np.einsum("ij,ij->i", normals[index], np.broadcast_to(direction, (len(index), 3)))
        index = index + len(areas) * (away > 0.0)
    return body.patches.of_side[index]
