"""The sheet of a detector's effects shows each of them."""

from __future__ import annotations

import numpy as np
import pytest

from examples.camera_effects.panels import rendered_panels
from simgl.arrays import Array, Image8


@pytest.fixture(scope="module")
def panels() -> dict[str, Image8]:
    return dict(rendered_panels(80))


def linear(panels: dict[str, Image8], start: str) -> Array:
    """The panel whose title starts like this, in linear light."""
    (picture,) = [picture for title, picture in panels.items() if title.startswith(start)]
    return (picture / 255.0) ** 2.2


def test_every_panel_differs_from_the_plain_one(panels: dict[str, Image8]) -> None:
    assert len(panels) == 16
    plain = panels["plain: shot noise alone"]
    assert plain.shape == (60, 80, 3)
    for title, picture in panels.items():
        if not title.startswith("plain"):
            assert np.mean(picture != plain) > 1e-3, title


def test_effects_look_like_their_names(panels: dict[str, Image8]) -> None:
    plain = linear(panels, "plain")
    # Faint light times the gain of the display is as bright; noise adds to it where it is cut at 0.
    assert linear(panels, "shot noise").mean() == pytest.approx(plain.mean(), rel=0.2)
    # Space above the craft: rows of one brightness.
    sky = linear(panels, "+ row noise")[:6, :20, 0]
    assert np.ptp(sky, axis=1).max() < 0.2 * max(np.ptp(sky, axis=0).max(), 0.05)
    assert linear(panels, "+ blooming").mean() > linear(panels, "full well").mean()
    # Blurred: less contrast between neighbours in a row; by squares, since shot noise is in both.
    step = np.sqrt(np.mean(np.diff(plain[..., 0], axis=1) ** 2))
    blurred = np.diff(linear(panels, "motion blur")[..., 0], axis=1)
    assert np.sqrt(np.mean(blurred**2)) < 0.8 * step
    assert np.ptp(linear(panels, "raw"), axis=-1).max() == 0.0
    assert np.ptp(linear(panels, "developed"), axis=-1).max() > 0.05
