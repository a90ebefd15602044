"""A sunlit plate before black space whose edge crosses a camera's image at a slant."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.camera.detector import Mosaic
from simgl.simulator import Product, Simulator
from tests.reference.slanted_edge import Edge, edge_spread, measured_mtf, system_mtf
from tests.scenes import lambert, scene

PITCH = 3.75e-6
# Of the bands R, G, B, N [m].
BANDS = [(600e-9, 700e-9), (500e-9, 600e-9), (400e-9, 500e-9), (700e-9, 1000e-9)]
# Electrons per photon of the bands behind red, green and blue filters; a fourth without a filter.
FILTERS = {
    "R": (0.6, 0.05, 0.0, 0.3),
    "G": (0.05, 0.6, 0.05, 0.2),
    "B": (0.0, 0.05, 0.6, 0.1),
    "mono": (0.6, 0.65, 0.5, 0.3),
}
# Pixels of the image's edges, pixels of the plate's, and of the part that is looked at.
_SIZE, _PLATE, _AROUND = 384, 220.0, (40, 90)
_FOCAL, _AWAY = 16e-3, 100.0


def edge_electrons(
    gl: moderngl.Context,
    optics: dict[str, Any],
    f_number: float,
    place: tuple[float, float],
    normal: float,
    *,
    colour: bool = False,
    samples: int | None = None,
) -> tuple[Edge, Array]:
    """The edge, and (height, width) mean electrons.

    place : column and row where the edge passes [px]
    normal : from the dark to the bright side [rad]
    samples : per pixel
    """
    metre = _AWAY * PITCH / _FOCAL
    middle = np.array(place) + 0.5 * _PLATE * np.array([np.cos(normal), np.sin(normal)])
    x, y = (middle - 0.5 * _SIZE) * metre
    # The camera looks along -z with y up: rows count downwards, so the plate turns the other way.
    half = -0.5 * normal
    scenario = scene(
        {
            "plate": {
                "model": {
                    "plate": {
                        "width_m": _PLATE * metre,
                        "height_m": _PLATE * metre,
                        "material": lambert(0.5),
                    }
                },
                "position_icrf_m": [x, -y, 0.0],
                "quaternion_icrf_from_body_xyzw": [0.0, 0.0, np.sin(half), np.cos(half)],
            }
        },
        {
            "preset": "ideal",
            "width_px": _SIZE,
            "height_px": _SIZE,
            "pixel_pitch_um": 1e6 * PITCH,
            "focal_length_mm": 1e3 * _FOCAL,
            "f_number": f_number,
            "exposure_time_s": 1e-3,
            "position_icrf_m": [0.0, 0.0, _AWAY],
            "boresight": [0.0, 0.0, -1.0],
            "up": [0.0, 1.0, 0.0],
            "optics": {"vignetting": "none", **optics},
        },
        render={} if samples is None else {"samples_per_pixel": samples},
    )
    camera = scenario.cameras["cam"]
    mosaic = None
    if colour:
        mosaic = Mosaic(order="RGGB", red=FILTERS["R"], green=FILTERS["G"], blue=FILTERS["B"])
    detector = replace(camera.detector, quantum_efficiency=FILTERS["mono"], mosaic=mosaic)
    scenario = replace(scenario, cameras={"cam": replace(camera, detector=detector)})
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        frame = simulator.capture(state, "cam", {Product.ELECTRONS}).electrons
    assert frame is not None
    return Edge(place=np.array(place), normal=normal), frame.electrons.astype(np.float64)


def pixels_around(edge: Edge, electrons: Array, letter: str) -> tuple[Array, Array]:
    """Distances from the edge, and electrons of the pixels around its place under one filter."""
    rows, columns = np.mgrid[0 : electrons.shape[0], 0 : electrons.shape[1]]
    distance = edge.distance(columns, rows)
    along = np.abs(edge.place - np.stack([columns + 0.5, rows + 0.5], axis=-1)) @ np.abs(
        [np.sin(edge.normal), np.cos(edge.normal)]
    )
    chosen = (along < _AROUND[1]) & (np.abs(distance) < _AROUND[0])
    if letter != "mono":
        square = np.array([["R", "G"], ["G", "B"]])
        chosen &= square[rows % 2, columns % 2] == letter
    return distance[chosen], electrons[chosen]


def mtf_of(
    edge: Edge, electrons: Array, letter: str, f_number: float, blur: float, frequency: Array
) -> tuple[Array, Array]:
    """MTF by the formulas and by the image, both measured in the same way.

    blur : standard deviation of the lens's Gaussian [m]
    """
    distance, values = pixels_around(edge, electrons, letter)
    table = np.linspace(0.0, 6.0, 1501)
    bands = [(*band, qe) for band, qe in zip(BANDS, FILTERS[letter], strict=True)]
    truth = system_mtf(table, edge.normal, f_number=f_number, pitch=PITCH, blur=blur, bands=bands)
    wanted = edge_spread(table, truth, distance)
    return measured_mtf(distance, wanted, frequency), measured_mtf(distance, values, frequency)
