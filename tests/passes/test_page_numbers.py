"""Pages numbered by compute shaders: the tables, and the image, are those that the CPU makes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import AnyArray
from simgl.gpu.render_targets import Format, GrowingTarget, textures_of
from simgl.passes import page_numbers
from simgl.passes.page_numbers import PageNumbers
from simgl.passes.shading_points import ENTRIES, page_table
from simgl.simulator import Simulator
from tests.passes.test_compute_shaders import CAMERA, CRAFT
from tests.scenes import scene

# Of the byte of a block, the bits that are no number of pages.
_OTHERS = 0b1010_0000
_TEXEL = Format("u4")
# Of more than a row of pages.
SCENE = scene(
    {name: CRAFT[name] for name in ("dull", "sheet")},
    CAMERA | {"look_at": "dull", "width_px": 128, "height_px": 96, "focal_length_mm": 24.0},
    sun_direction=(0.35, 0.2, 0.91515),
)


class Tables:
    """Tables of a tile on the GPU."""

    def __init__(self, gl: moderngl.Context) -> None:
        self.numbers = PageNumbers(gl)
        self.counts = GrowingTarget(gl, [[0]], Format("u1"))
        self.entries, self.first = (GrowingTarget(gl, [[0]], _TEXEL) for _ in range(2))

    def number(self, counts: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Entries and first pages of blocks, as ``page_table`` gives them."""
        blocks = counts.shape[1], counts.shape[0]
        self.numbers.number(self.counts.written(counts), blocks, self.entries, self.first)
        (entries,), (first,) = (
            textures_of(*table.covering((1, 1))) for table in (self.entries, self.first)
        )
        pages = np.frombuffer(first.read(), dtype=np.uint32).reshape(-1, first.width)
        return self.numbers.read(entries), pages[: blocks[1], : blocks[0]]

    def release(self) -> None:
        """Free everything."""
        for owner in (self.numbers, self.counts, self.entries, self.first):
            owner.release()


@pytest.fixture
def tables(gl: moderngl.Context) -> Iterator[Tables]:
    made = Tables(gl)
    yield made
    made.release()


@pytest.mark.parametrize("shape", [(1, 1), (3, 500), (41, 67), (8192, 1), (1, 8192), (300, 700)])
def test_the_tables_are_those_of_the_cpu(tables: Tables, shape: tuple[int, int]) -> None:
    """Fewer blocks than a chunk has, and more chunks than a workgroup has threads; other tiles
    before it leave nothing behind."""
    rng = np.random.default_rng(1)
    for largest in (16, 0, 2):
        counts = rng.integers(0, largest + 1, shape).astype(np.uint8)
        byte = counts | rng.integers(0, 256, shape).astype(np.uint8) & _OTHERS
        entries, first = tables.number(byte)
        if tables.numbers.lacked_room():
            entries, first = tables.number(byte)
        assert not tables.numbers.lacked_room()
        wanted, wanted_first, _ = page_table(counts)
        np.testing.assert_array_equal(entries, wanted)
        np.testing.assert_array_equal(first, wanted_first)


def test_pages_beyond_the_room_are_left_out_and_told(tables: Tables) -> None:
    few, many = np.ones((64, 64), dtype=np.uint8), np.full((64, 64), 9, dtype=np.uint8)
    for counts in (many, few):
        entries, _ = tables.number(counts)
        room = -(-page_numbers._PER_BLOCKS * counts.size // (256 * ENTRIES))
        wanted, *_ = page_table(counts)
        assert len(entries) == min(room, len(wanted))
        np.testing.assert_array_equal(entries, wanted[:room])
    # A later tile with room enough does not hide the one that lacked it.
    assert tables.numbers.lacked_room()
    assert not tables.numbers.lacked_room()
    entries, _ = tables.number(many)
    np.testing.assert_array_equal(entries, page_table(many)[0])
    assert not tables.numbers.lacked_room()


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Of each image that is drawn, whether it lacked room."""
    lacked: list[bool] = []
    ask = PageNumbers.lacked_room

    def noted(*values: Any) -> bool:
        lacked.append(ask(*values))
        return lacked[-1]

    monkeypatch.setattr(PageNumbers, "lacked_room", noted)
    return lacked


def test_the_image_is_the_same(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, drawn: list[bool]
) -> None:
    """Bit by bit, with room enough at once and after drawing it again."""
    monkeypatch.setattr("simgl.gpu.fullscreen.prefers_compute", bool)
    monkeypatch.setattr("simgl.passes.gbuffer.prefers_compute", bool)
    with Simulator(SCENE, gl) as simulator:
        geometry = simulator._renderer._geometry

        def image() -> AnyArray:
            still = simulator._still(SCENE.at(SCENE.epoch_tai_ns), "cam")
            return still.radiance.read()

        numbers = geometry._numbers
        assert numbers is not None
        numbers._per_blocks = 1024
        by_gpu = image()
        assert drawn == [False]
        numbers._per_blocks = 1
        again = image()
        assert drawn == [False, True, False]
        geometry._numbers = None
        by_cpu = image()
        assert len(drawn) == 3
        geometry._numbers = numbers
    assert by_cpu.any(axis=-1).mean() > 0.3
    np.testing.assert_array_equal(by_gpu, by_cpu)
    np.testing.assert_array_equal(again, by_cpu)
