"""Mono12p: bytes as the GenICam pixel format naming convention lays them out."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.mono12p import pack_mono12p, unpack_mono12p


def test_two_pixels_fill_three_bytes_low_bits_first() -> None:
    pair = np.array([[0xABC, 0x123]], dtype=np.uint16)
    assert pack_mono12p(pair) == bytes([0xBC, 0x3A, 0x12])


def test_eight_pixels_fill_three_words() -> None:
    """As 32-bit little-endian words: v0 | v1 << 12 | v2 << 24, and on."""
    v = np.random.default_rng(1).integers(0, 4096, 8).astype(np.uint32)
    words = [
        v[0] | (v[1] << 12) | (v[2] << 24),
        (v[2] >> 8) | (v[3] << 4) | (v[4] << 16) | (v[5] << 28),
        (v[5] >> 4) | (v[6] << 8) | (v[7] << 20),
    ]
    assert pack_mono12p(v.astype(np.uint16)[None]) == np.array(words, dtype="<u4").tobytes()


@pytest.mark.parametrize("shape", [(960, 1280), (3, 5), (1, 1), (1, 2)])
def test_packed_pixels_come_back(shape: tuple[int, int]) -> None:
    dn = np.random.default_rng(2).integers(0, 4096, shape).astype(np.uint16)
    data = pack_mono12p(dn)
    assert len(data) == -(-dn.size * 3 // 2)
    np.testing.assert_array_equal(unpack_mono12p(data, *shape), dn)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"Mono12p holds 0..4095, got 4096"):
        pack_mono12p(np.array([[4096]], dtype=np.uint16))
    with pytest.raises(ValueError, match=r"5 x 3 pixels take 23 bytes, got 22"):
        unpack_mono12p(bytes(22), 3, 5)
