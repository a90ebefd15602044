"""The files of the shipped models: the same bytes wherever they are generated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.tools.shipped import MODELS, NAMES, document_of, record_of, rows_of
from tools.spacecraft_models.__main__ import main, write_model
from tools.spacecraft_models.glb import R_FILE_FROM_BODY
from tools.spacecraft_models.materials import MATERIALS


@pytest.mark.parametrize("name", NAMES)
def test_generating_again_gives_the_committed_files_byte_for_byte(
    name: str, tmp_path: Path
) -> None:
    folder = write_model(name, tmp_path)
    for file in (f"{name}.glb", "model.toml"):
        assert (folder / file).read_bytes() == (MODELS / name / file).read_bytes(), file


def test_an_unknown_name_is_refused_with_the_names_there_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["soyuz"])
    assert f"no generator for soyuz; there is {', '.join(NAMES)}" in capsys.readouterr().err


@pytest.mark.parametrize("name", NAMES)
def test_accessors_state_the_bounds_of_their_positions(name: str) -> None:
    document = document_of(name)
    for mesh in document.meshes:
        for primitive in mesh.primitives:
            accessor = document.accessors[primitive.attributes.POSITION]
            positions = rows_of(document, primitive.attributes.POSITION, "<f4")
            assert accessor.min == positions.min(axis=0).tolist()
            assert accessor.max == positions.max(axis=0).tolist()


@pytest.mark.parametrize("name", NAMES)
def test_the_recorded_axes_are_the_mapping_the_file_was_written_with(name: str) -> None:
    axes = record_of(name)["axes"]
    for row, body_axis in enumerate("xyz"):
        sign, file_axis = axes[body_axis]
        expected = np.zeros(3)
        expected["xyz".index(file_axis)] = 1.0 if sign == "+" else -1.0
        np.testing.assert_array_equal(R_FILE_FROM_BODY[:, row], expected)
    assert np.linalg.det(R_FILE_FROM_BODY) == pytest.approx(1.0)


@pytest.mark.parametrize("name", NAMES)
def test_materials_reflect_between_nothing_and_everything(name: str) -> None:
    for material in document_of(name).materials:
        surface, stated = material.pbrMetallicRoughness, MATERIALS[material.name]
        numbers = [
            *surface.baseColorFactor,
            surface.metallicFactor,
            surface.roughnessFactor,
            material.extras["nir_reflectance"],
        ]
        assert numbers == [
            *stated.rgb, 1.0, stated.metallic, stated.roughness, stated.nir
        ], material.name  # fmt: skip
        assert all(0.0 <= number <= 1.0 for number in numbers), material.name
        assert material.extras.get("simgl_finish") == stated.finish, material.name
