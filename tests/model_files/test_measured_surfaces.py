"""Spectra of surfaces: measured curves in model cards, and the forms of the shipped finishes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl.errors import SimglError
from simgl.model_files.model_library import load_model
from simgl.model_files.surface_tables import load_finish, shipped_finishes
from simgl.physics.spectrum import Bands
from simgl.scene.band_materials import model_in_bands
from simgl.scene.materials import Material
from simgl.scene.mesh import plate
from simgl.scene.spacecraft import SpacecraftModel
from tests.model_files.gltf import Document

CARD = """\
name = "board"
file = "board.glb"
unit_m = 1.0
axes = { x = "+x", y = "+y", z = "+z" }
[reflectance]
"""
R_G_B_N = Bands(names=("w", "x", "y", "z"))
EDGES = ((340e-9, 380e-9), (820e-9, 840e-9), (1640e-9, 1660e-9), (2190e-9, 2210e-9))
OTHER = Bands(names=("w", "x", "y", "z"), edges=EDGES)


def _card(folder: Path, line: str, curve: str = "nm,value\n300,0.2\n2500,0.8\n") -> Path:
    made = Document()
    points = made.accessor([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    made.json["materials"] = [{"name": "panel"}, {"name": "rest"}]
    made.json["meshes"] = [
        {
            "primitives": [
                {"attributes": {"POSITION": points}, "material": 0},
                {"attributes": {"POSITION": points}, "material": 1},
            ]
        }
    ]
    made.json["nodes"] = [{"name": "board", "mesh": 0}]
    made.json["scenes"] = [{"nodes": [0]}]
    made.write_glb(folder / "board.glb")
    (folder / "paint.csv").write_text(curve)
    path = folder / "model.toml"
    path.write_text(f"{CARD}{line}\n")
    return path


def _in(material: Material, bands: Bands) -> np.ndarray:
    model = SpacecraftModel(name="m", mesh=plate(1.0, 1.0), parts=("m",), materials=(material,))
    return np.array(model_in_bands(model, bands, 5772.0).materials[0].reflectance)


def test_a_card_gives_a_material_a_measured_curve(tmp_path: Path) -> None:
    model = load_model(str(_card(tmp_path, 'panel = "paint.csv"')))
    panel, rest = (next(m for m in model.materials if m.name == n) for n in ("panel", "rest"))
    # A straight line: its mean is at the mean wavelength, 650 nm less what blue photons shift.
    assert panel.reflectance[0] == pytest.approx(0.2 + 0.6 * 350.0 / 2200.0, rel=5e-3)
    middles = np.array([360.0, 830.0, 1650.0, 2200.0])
    np.testing.assert_allclose(_in(panel, OTHER), 0.2 + 0.6 * (middles - 300.0) / 2200.0, rtol=5e-3)
    assert rest.spectrum is None


@pytest.mark.parametrize(
    ("line", "curve", "problem"),
    [
        (
            'pannel = "paint.csv"',
            "300,0.2",
            'reflectance.pannel names no material; did you mean "panel"?',
        ),
        ('panel = "none.csv"', "300,0.2", "reflectance.panel: "),
        ('panel = "paint.csv"', "300,0.2\n400,1.2", "reflectance.panel must lie in 0..1, got 1.2"),
        (
            'panel = "paint.csv"',
            "300,0.2\n400,white",
            "line 2 must be a wavelength in nm and a value",
        ),
        ('panel = "paint.csv"', "500,0.2\n400,0.3", "wavelength_nm"),
    ],
)
def test_a_bad_curve_is_told_in_one_line(
    tmp_path: Path, line: str, curve: str, problem: str
) -> None:
    with pytest.raises(SimglError) as raised:
        load_model(str(_card(tmp_path, line, curve)))
    assert problem in str(raised.value)
    assert "\n" not in str(raised.value)
    assert str(tmp_path) in str(raised.value)


@pytest.mark.parametrize("name", shipped_finishes())
def test_a_finish_in_bands_that_are_r_g_b_n_is_itself(name: str) -> None:
    finish = load_finish(name)
    np.testing.assert_allclose(_in(finish, R_G_B_N), finish.reflectance, rtol=1e-6)
    other = _in(finish, OTHER)
    assert np.all((other >= 0.0) & (other <= 1.0))


def test_finishes_have_the_marks_of_their_kinds() -> None:
    # Zinc oxide is dark below 385 nm; aluminium dips at 830 nm and rises beyond; Kapton hides its
    # aluminium in the ultraviolet.
    white, bare, gold = (
        _in(load_finish(name), OTHER) for name in ("white_paint", "bare_aluminium", "mli_gold")
    )
    assert white[0] < 0.2 < 0.5 < white[3] < white[1]
    assert bare[1] < 0.95 * bare[2]
    # Rakic 1995: 0.868 at 830 nm and 0.977 at 1650 nm.
    assert bare[2] / bare[1] == pytest.approx(0.975 / 0.869, rel=0.02)
    assert gold[0] < 0.1 < gold[1]
