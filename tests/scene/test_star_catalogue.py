"""The shipped catalogue holds the sky's bright stars, and a damaged one says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl import assets
from simgl.errors import AssetError
from simgl.physics.starlight import directions
from simgl.scene.star_catalogue import shipped_stars

# HIP: V of the Bright Star Catalogue. Not those that the generator takes from there.
KNOWN = {
    7588: 0.46,  # Achernar
    21421: 0.85,  # Aldebaran
    65474: 0.98,  # Spica
    37826: 1.14,  # Pollux
    62434: 1.25,  # Mimosa
    11767: 2.02,  # Polaris
    104214: 5.21,  # 61 Cygni A
    9884: 2.00,  # Hamal
}


def test_the_catalogue_holds_known_stars_at_their_magnitudes() -> None:
    stars = shipped_stars()
    # Hipparcos is complete to V 7.3 and lists 26,000 stars to 7.5.
    assert 25_000 < len(stars.hip) < 27_000
    assert stars.hip[0] == 32349  # Sirius
    assert np.all(np.diff(stars.magnitude) >= 0.0)
    np.testing.assert_allclose(np.linalg.norm(stars.direction, axis=1), 1.0, atol=1e-15)
    assert np.all(np.isfinite(stars.irradiance))
    assert np.all(stars.irradiance > 0.0)
    for hip, v in KNOWN.items():
        row = np.flatnonzero(stars.hip == hip)
        np.testing.assert_allclose(stars.magnitude[row], v, atol=0.05)


def test_polaris_stands_at_the_pole_and_vega_where_it_is() -> None:
    stars = shipped_stars()
    north = stars.direction[stars.hip == 11767][0]
    assert np.degrees(np.arccos(north[2])) < 0.75
    vega = stars.direction[stars.hip == 91262][0]
    # 18h 36m 56.3s, +38 deg 47 arcmin 1 arcsec (J2000).
    alpha, delta = np.radians(279.2347), np.radians(38.7837)
    there = [np.cos(delta) * np.cos(alpha), np.cos(delta) * np.sin(alpha), np.sin(delta)]
    np.testing.assert_allclose(vega, there, atol=2e-5)


def test_the_fast_star_61_cygni_moves_to_its_place_of_j2000() -> None:
    stars = shipped_stars()
    row = stars.hip == 104214
    years = 8.75
    moved = directions(stars.direction[row], stars.motion[row], 0.0 * stars.parallax[row], years,
                       np.zeros(3))[0]  # fmt: skip
    # SIMBAD, ICRS, epoch J2000: 21h 06m 53.9396s, +38 deg 44 arcmin 57.902 arcsec.
    alpha = np.radians(15.0 * (21.0 + 6.0 / 60.0 + 53.9396 / 3600.0))
    delta = np.radians(38.0 + 44.0 / 60.0 + 57.902 / 3600.0)
    there = [np.cos(delta) * np.cos(alpha), np.cos(delta) * np.sin(alpha), np.sin(delta)]
    # It moves 46 arcsec in that time; the two reductions of Hipparcos differ by 13 mas a year, for
    # it is a double star: 0.12 arcsec.
    np.testing.assert_allclose(moved, there, atol=0.2 * 4.848e-6)


def test_a_limit_of_magnitude_keeps_the_brighter_ones() -> None:
    bright = shipped_stars(1.5)
    assert len(bright.hip) == len(bright.direction) == len(bright.irradiance)
    assert bright.magnitude.max() <= 1.5
    # 21 of the Bright Star Catalogue with each double as one, and alpha Centauri's second star.
    assert 21 <= len(bright.hip) <= 24


def spoilt(kind: str) -> bytes:
    """The shipped file, damaged."""
    content = (assets.data() / "sky" / "hipparcos.npz").read_bytes()
    middle = len(content) // 2
    return {
        "empty": b"",
        "text": b"no catalogue at all\n",
        "cut": content[:middle],
        "a flipped byte": content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :],
    }[kind]


@pytest.mark.parametrize("kind", ["empty", "text", "cut", "a flipped byte"])
def test_a_damaged_catalogue_is_refused_in_one_line(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "hipparcos.npz"
    path.write_bytes(spoilt(kind))
    with pytest.raises(AssetError) as error:
        shipped_stars(path=path)
    assert str(error.value) == f"{path}: is not a whole star catalogue; reinstall simgl"


def test_another_file_of_arrays_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "hipparcos.npz"
    np.savez(path, hip=np.arange(3), v=np.arange(3))
    with pytest.raises(AssetError, match="is not a whole star catalogue"):
        shipped_stars(path=path)


def test_a_missing_catalogue_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none.npz"
    with pytest.raises(AssetError) as error:
        shipped_stars(path=path)
    expected = f"{path}: cannot be read (No such file or directory); reinstall simgl"
    assert str(error.value) == expected
