"""The sheet of eight views shows all of a model, from the sides it names."""

from __future__ import annotations

from pathlib import Path

import moderngl
import numpy as np
import pytest

from simgl.arrays import Image8
from simgl.errors import AssetError
from simgl.inspection.turntable import VIEWS, turntable, write_turntable
from simgl.model_files.model_library import load_model

WIDTH, HEIGHT = 80, 60
LINE = 11  # the titles' [px]


def views(sheet: Image8) -> dict[str, Image8]:
    """Title to (HEIGHT, WIDTH, 3) view."""
    found = {}
    for number, title in enumerate(VIEWS):
        top, left = number // 4 * (HEIGHT + LINE) + LINE, number % 4 * WIDTH
        found[title] = sheet[top : top + HEIGHT, left : left + WIDTH]
    return found


@pytest.fixture
def board(gl: moderngl.Context) -> dict[str, Image8]:
    return views(turntable("calibration_board", size=(WIDTH, HEIGHT), ctx=gl))


def test_every_view_shows_the_model_whole(board: dict[str, Image8]) -> None:
    for title, picture in board.items():
        lit = picture.max(axis=-1) > 0
        assert lit.any(), title
        rim = np.concatenate([lit[0], lit[-1], lit[:, 0], lit[:, -1]])
        assert not rim.any(), title


def test_the_largest_view_fills_the_picture(board: dict[str, Image8]) -> None:
    shares = []
    for picture in board.values():
        rows, columns = np.nonzero(picture.max(axis=-1))
        shares.append(max(np.ptp(rows) / HEIGHT, np.ptp(columns) / WIDTH))
    # 0.94 of the half picture on the larger side, less what perspective takes from the other.
    assert 0.85 < max(shares) < 0.96


def test_from_ahead_the_steps_grow_brighter_from_top_left_to_bottom_right(
    board: dict[str, Image8],
) -> None:
    picture = board["from ahead (+x)"]
    rows, columns = np.nonzero(picture.max(axis=-1))
    middle = 0.5 * (rows.min() + rows.max()), 0.5 * (columns.min() + columns.max())
    pitch = np.ptp(columns) / 0.86 * 0.20  # of the steps [px]
    steps = [
        picture[round(middle[0] + (row - 1) * pitch), round(middle[1] + (column - 1.5) * pitch), 1]
        for row in range(3)
        for column in range(4)
    ]
    assert np.all(np.diff(np.array(steps, dtype=int)) > 0), steps


def test_a_sheet_takes_the_name_of_its_model(tmp_path: Path) -> None:
    path = write_turntable("wedge", tmp_path)
    assert path == tmp_path / "wedge.turntable.png"
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert [p.name for p in tmp_path.iterdir()] == ["wedge.turntable.png"]


def test_an_unknown_model_is_refused_before_anything_is_drawn(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match='no model "wegde"; did you mean "wedge"'):
        write_turntable("wegde", tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_sheet_does_not_depend_on_the_unit_of_the_file(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    path = tmp_path / "prism.obj"
    corners = [(0, 0, 0), (900, 0, 0), (0, 700, 0), (0, 0, 500)]
    faces = [(1, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4)]
    path.write_text(
        "".join("v {} {} {}\n".format(*c) for c in corners)
        + "".join("f {} {} {}\n".format(*f) for f in faces)
    )
    assert load_model(str(path), unit_m=0.001).mesh.radius < 1.0
    size = (WIDTH, HEIGHT)
    small = turntable(str(path), 0.001, size, gl).astype(int)
    large = turntable(str(path), 0.01, size, gl).astype(int)
    # float32 corners: edges may move by 1e-7 of a picture, which turns one sample of 16.
    assert np.mean(np.abs(small - large) > 0) < 0.01
