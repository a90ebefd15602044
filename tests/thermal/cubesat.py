"""A published node model of a 1U CubeSat, its temperatures, and those that it had in orbit.

FUNcube-1 as F. Meijering models it (Modular Thermal Analysis for CubeSats and PocketQubes, MSc
thesis, TU Delft, 2024; its repository is FrankMeijering/ThermalAnalysis on GitHub): 78 nodes.
Numbers are his, the geometry is ours. Faces are named as there: x+ away from the Earth, y+ along
minus the orbit's normal, z+ ahead. All temperatures are of the middle of a panel or a board.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.thermal_surface import ThermalLink, ThermalNode, ThermalPart, ThermalSurface
from simgl.simulator import Simulator
from simgl.thermal.body import ThermalBody, thermal_body
from simgl.thermal.history import thermal_history

HALF = 0.05  # [m]
ABSORPTANCE, EMISSIVITY = 0.75, 0.88
# The model's axes in those of the orbit: x along the velocity, z to the Earth.
AXES = {"x": (0.0, 0.0, -1.0), "y": (0.0, 1.0, 0.0), "z": (1.0, 0.0, 0.0)}
FACES = ("x+", "x-", "y+", "y-", "z+", "z-")
# A board of 20 g of 1100 J kg-1 K-1: half of it in the middle, an eighth at each corner [J K-1].
_MIDDLE, _CORNER = 11.0, 2.75
# From the middle to a corner: 30 W m-1 K-1 through 1.6 mm over three quarters of the way [W K-1].
_ALONG_BOARD = 30.0 * 0.0016 / 0.75
# Aluminium to aluminium, 2000 W m-2 K-1, over 10 mm2 of a spacer and 20 cm2 of a ring; battery to
# board, 50,000 W m-2 K-1 over 25 cm2; ring to rod, 130 W m-1 K-1, 25 cm2, 5 cm [W K-1].
_SPACER, _RING, _BATTERY, _ROD = 0.02, 4.0, 125.0, 6.5
# Emissivity 0.7 times 100 cm2 times the view factor of squares 2 cm and 1 cm apart [m2].
_BOARDS_FACE, _PANEL_FACES = 0.7 * 0.01 * 0.690245, 0.7 * 0.01 * 0.826995
# Of boards 1 to 5, from z- to z+ [W].
_POWERS = (0.462, 0.160, 0.303, 0.190, 0.015)

# His loads: 596 km above 6371 km, the Sun 30 deg from the plane of the orbit; the Earth's infrared
# and, at noon, what it reflects [W m-2].
RADIUS, ALTITUDE, PERIOD = 6371e3, 596e3, 5787.5
SUNLIGHT, BETA = 1327.018, np.radians(30.0)
_EARTH = {"x+": (0.3820, 0.5400), "x-": (200.2399, 283.0789)}
_SIDE = 59.7186, 84.4241

# Mean, lowest and highest of the second of two orbits [K], computed with his code; its own solver
# is good for 0.12 K, the difference to steps of 5 s at most.
PUBLISHED = {
    "x+A": (273.182, 251.424, 290.909),
    "x-A": (273.219, 254.888, 289.831),
    "y+A": (269.437, 252.414, 282.042),
    "y-A": (275.493, 252.554, 291.216),
    "z+A": (273.701, 253.922, 282.239),
    "z-A": (273.857, 253.990, 296.941),
    "board_1A": (281.441, 271.602, 291.593),
    "board_2A": (285.061, 281.854, 288.625),
    "board_3A": (286.822, 284.685, 289.161),
    "board_4A": (283.651, 280.996, 286.754),
    "board_5A": (277.409, 267.800, 284.548),
    "battery": (285.061, 281.854, 288.625),
}
# Of one orbit in flight, 13 August 2024: mean over time, lowest, highest [K], from the samples in
# his repository. It flew with z- ahead, which exchanges the names of y+ and y-.
IN_FLIGHT = {
    "x+A": (274.32, 252.73, 288.36),
    "x-A": (273.54, 253.09, 287.39),
    "y+A": (269.39, 251.39, 284.24),
    "y-A": (278.52, 255.03, 293.82),
}


def _along(face: str, across: float, upward: float) -> Array:
    """(3,) a point of a face, in units of half its width along the two other axes in order."""
    others = [AXES[axis] for axis in AXES if axis != face[0]]
    sign = 1.0 if face[1] == "+" else -1.0
    out = sign * np.array(AXES[face[0]])
    return np.asarray(HALF * (out + across * np.array(others[0]) + upward * np.array(others[1])))


def _faces() -> Mesh:
    """A box whose faces have five parts each: a square on its tip, and four corners."""
    positions: list[Array] = []
    normals: list[Array] = []
    triangles: list[list[int]] = []
    parts: list[int] = []
    tips = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]
    corners = {"B": (1.0, 1.0), "C": (-1.0, 1.0), "D": (-1.0, -1.0), "E": (1.0, -1.0)}
    for number, face in enumerate(FACES):
        out = _along(face, 0.0, 0.0) / HALF
        pieces = [(0, [tips[0], tips[1], tips[2]]), (0, [tips[0], tips[2], tips[3]])]
        for index, (a, b) in enumerate(corners.values(), start=1):
            pieces.append((index, [(a, b), (a, 0.0), (0.0, b)]))
        for index, places in pieces:
            points = np.array([_along(face, *place) for place in places])
            if np.cross(points[1] - points[0], points[2] - points[0]) @ out < 0.0:
                points = points[::-1]
            triangles.append([len(positions) + corner for corner in range(3)])
            positions.extend(points)
            normals.extend([out] * 3)
            parts.extend([5 * number + index] * 3)
    return Mesh(
        positions=np.array(positions, dtype=np.float32),
        normals=np.array(normals, dtype=np.float32),
        triangles=np.array(triangles, dtype=np.uint32),
        part=np.array(parts, dtype=np.uint32),
        material=np.zeros(len(parts), dtype=np.uint32),
    )


def _nodes() -> dict[str, ThermalNode]:
    nodes = {"battery": ThermalNode(heat_capacity=19.25)}
    for number, power in enumerate(_POWERS, start=1):
        nodes[f"board_{number}A"] = ThermalNode(heat_capacity=_MIDDLE, power=power)
        for corner in "BCDE":
            nodes[f"board_{number}{corner}"] = ThermalNode(heat_capacity=_CORNER)
    for below in range(1, len(_POWERS)):
        for corner in "BCDE":
            nodes[f"spacer_{below}{corner}"] = ThermalNode(heat_capacity=19.2)
    for name in ("ring_z-", "ring_z+", *(f"rod_{corner}" for corner in "BCDE")):
        nodes[name] = ThermalNode(heat_capacity=76.8)
    return nodes


def _conductances() -> Iterator[tuple[str, str, float]]:
    """Both ends and [W K-1]."""
    yield "battery", "board_2A", _BATTERY
    for sheet in (*FACES, *(f"board_{number}" for number in range(1, 6))):
        yield from ((f"{sheet}A", f"{sheet}{corner}", _ALONG_BOARD) for corner in "BCDE")
    for corner in "BCDE":
        for below in range(1, len(_POWERS)):
            spacer = f"spacer_{below}{corner}"
            yield f"board_{below}{corner}", spacer, _SPACER
            yield f"board_{below + 1}{corner}", spacer, _SPACER
        for ring, board in (("ring_z-", 1), ("ring_z+", 5)):
            yield ring, f"{ring[-2:]}{corner}", _RING
            yield ring, f"rod_{corner}", _ROD
            yield ring, f"board_{board}{corner}", _SPACER
    for side in ("x+", "x-", "y+", "y-"):
        yield from (("ring_z+", f"{side}{corner}", _RING) for corner in "BC")
        yield from (("ring_z-", f"{side}{corner}", _RING) for corner in "DE")


def cubesat_model() -> SpacecraftModel:
    """Panels as parts of five, all else as nodes inside."""
    parts = tuple(f"{face}{piece}" for face in FACES for piece in "ABCDE")
    # The panel is its part's structure, whose skin has next to no heat capacity of its own and
    # follows it to 1e-3 K.
    paint = ThermalSurface(
        solar_absorptance=ABSORPTANCE,
        infrared_emissivity=EMISSIVITY,
        heat_capacity=1e-3,
        conductance=1e6,
    )
    capacity = {"A": _MIDDLE}
    stack = ["z-A", *(f"board_{number}A" for number in range(1, 6)), "z+A"]
    areas = [_PANEL_FACES, *[_BOARDS_FACE] * 4, _PANEL_FACES]
    return SpacecraftModel(
        name="cubesat",
        mesh=_faces(),
        parts=parts,
        materials=(Material(name="panel", reflectance=(0.25,) * 4, thermal=paint),),
        thermal={
            name: ThermalPart(
                power=0.040 if name == "z+A" else 0.0,
                heat_capacity=capacity.get(name[-1], _CORNER),
                sheet_conductance=0.0,
            )
            for name in parts
        },
        thermal_nodes=_nodes(),
        thermal_links=(
            *(ThermalLink(between=(a, b), conductance=value) for a, b, value in _conductances()),
            *(
                ThermalLink(between=(a, b), radiative_coupling=area)
                for a, b, area in zip(stack[:-1], stack[1:], areas, strict=True)
            ),
        ),
    )


def cubesat_body() -> ThermalBody:
    """Its thermal network, a patch for each piece of a panel."""
    return thermal_body("cubesat", cubesat_model(), 30)


def node(body: ThermalBody, name: str) -> int:
    """The place of a panel's piece or a node inside among the body's nodes."""
    return body.patch_count + [*body.part_names, *body.inner_names].index(name)


def published_heat(body: ThermalBody, seconds: float) -> Array:
    """(n,) what the nodes absorb under his loads, and internal power, from noon on [W]."""
    angle = 2.0 * np.pi * seconds / PERIOD
    towards = {
        "x": np.cos(BETA) * np.cos(angle),
        "y": -np.sin(BETA),
        "z": -np.cos(BETA) * np.sin(angle),
    }
    # The shadow is a cylinder.
    height = np.cos(BETA) * np.cos(angle)
    clear = height > 0.0 or 1.0 - height**2 > (RADIUS / (RADIUS + ALTITUDE)) ** 2
    heat = body.power.copy()
    for place in range(body.patch_count):
        face = body.part_names[body.part[place]][:2]
        cosine = towards[face[0]] * (1.0 if face[1] == "+" else -1.0)
        infrared, reflected = _EARTH.get(face, _SIDE)
        light = SUNLIGHT * max(cosine, 0.0) * clear + reflected * max(np.cos(angle), 0.0)
        absorbed = ABSORPTANCE * light + EMISSIVITY * infrared
        heat[place] += body.patches.areas[place] * absorbed
    return heat


def statistics(
    body: ThermalBody, kelvin: Array, names: Mapping[str, object]
) -> dict[str, tuple[float, float, float]]:
    """Mean, lowest and highest over time of nodes [K].

    kelvin : (times, n)
    """
    of_nodes = {name: kelvin[:, node(body, name)] for name in names}
    return {n: (float(t.mean()), float(t.min()), float(t.max())) for n, t in of_nodes.items()}


def under_published_heat(
    body: ThermalBody, step: float = 5.0
) -> dict[str, tuple[float, float, float]]:
    """The statistics of the second orbit, from the steady state of the mean heat on."""
    count = round(2.0 * PERIOD / step)
    heats = np.array([published_heat(body, step * number) for number in range(count + 1)])
    kelvin = [body.network.steady(heats.mean(axis=0))]
    for before, after in pairwise(heats):
        kelvin.append(body.network.step(kelvin[-1], before, after, step))
    return statistics(body, np.array(kelvin)[count // 2 :], PUBLISHED)


def day_in_orbit() -> Scenario:
    """13 August 2024, one panel to the Earth, the Sun 30 deg from the plane of the orbit.

    Of the two such orbits of 97.7 deg the one whose day is its northward half.
    """
    # Of the Sun on that day in the axes of ICRF.
    right_ascension, declination = np.radians(142.8), np.radians(14.7)
    inclination = np.radians(97.7)
    north = np.array([np.cos(inclination), np.sin(inclination)])
    sine = (np.sin(BETA) - np.sin(declination) * north[0]) / (np.cos(declination) * north[1])
    node_at = right_ascension + np.arcsin(sine)
    orbit = {
        "semi_major_axis_km": 1e-3 * (RADIUS + ALTITUDE),
        "inclination_deg": 97.7,
        "raan_deg": float(np.degrees(node_at)),
        "j2": True,
    }
    return scenario_from_dict(
        {
            "epoch": {"utc": "2024-08-13T00:00:00"},
            "spacecraft": {"cubesat": {"model": "wedge", "orbit": orbit}},
        },
        models={"cubesat": cubesat_model()},
    )


def in_orbit(gl: moderngl.Context, step: float = 120.0) -> dict[str, tuple[float, float, float]]:
    """The same statistics of a day in simgl's own light of Sun and Earth: means over ten orbits.

    They follow five orbits from the steady state at the start, of which 0.1 K is left.
    """
    scenario, body = day_in_orbit(), cubesat_body()
    epochs = [
        scenario.epoch_tai_ns + round(1e9 * step * number)
        for number in range(round(15.0 * PERIOD / step) + 1)
    ]
    with Simulator(scenario, gl) as simulator:
        states = list(thermal_history(body, scenario, epochs, simulator.skies))
    kelvin = np.array([state.temperatures for state in states])
    orbit = np.arange(len(kelvin)) * step // PERIOD
    each = [statistics(body, kelvin[orbit == number], PUBLISHED) for number in range(5, 15)]
    means = {name: np.mean([one[name] for one in each], axis=0) for name in PUBLISHED}
    return {name: (float(m[0]), float(m[1]), float(m[2])) for name, m in means.items()}
