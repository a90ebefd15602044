"""What a notebook shows of a scenario, a state and a capture; radiance as a labelled array."""

from __future__ import annotations

import sys
from html.parser import HTMLParser

import moderngl
import numpy as np
import pytest

from simgl import Capture, ConfigError, Product, Scenario, Simulator, scenario_from_dict
from simgl.html_table import html_table


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    """A ball 300 m from a camera."""
    ball = {"sphere": {"radius_m": 1.0, "material": "white_paint"}}
    about = {"target": "ball", "azimuth_deg": 150.0, "range_m": 300.0}
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "spacecraft": {"ball": {"model": ball, "orbit": {"altitude_km": 400.0}}},
            "camera": {"cam": {"about": about, "width_px": 16, "height_px": 12}},
        }
    )


@pytest.fixture
def capture(gl: moderngl.Context, scenario: Scenario) -> Capture:
    with Simulator(scenario, ctx=gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        return simulator.capture(state, "cam", {Product.DN, Product.RADIANCE})


class Cells(HTMLParser):
    """Texts of a page's cells; fails where tags are not closed in order."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.feed(page)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "img":
            self.images.append(dict(attrs))
        else:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def test_texts_of_a_table_are_escaped() -> None:
    assert Cells(html_table("a & b", ["<i>"], [["<script>", 3]])).texts == [
        "a & b",
        "<i>",
        "<script>",
        "3",
    ]


def test_a_scenario_and_a_state_show_their_spacecraft_and_cameras(scenario: Scenario) -> None:
    texts = Cells(scenario._repr_html_()).texts
    assert {"ball", "cam", "16 x 12", "13", "4", "0.5"} <= set(texts)
    texts = Cells(scenario.at(scenario.epoch_tai_ns)._repr_html_()).texts
    # 400 km over the equator's radius; the camera stands where the scenario says.
    assert {"State at 2026-03-20T12:00:00 UTC", "6778.137", "300.000"} <= set(texts)


def test_a_capture_shows_its_image_and_its_settings(capture: Capture) -> None:
    cells = Cells(capture._repr_html_())
    assert {"0.5 ms", "16 x 12", "0, 0"} <= set(cells.texts)
    (image,) = cells.images
    assert str(image["src"]).startswith("data:image/png;base64,")
    assert image["alt"]


def test_radiance_has_labels_and_shares_its_memory(capture: Capture) -> None:
    assert capture.radiance is not None
    array = capture.radiance.to_xarray()
    assert array.dims == ("row", "column", "band")
    assert array.attrs["units"] == "W m-2 sr-1"
    assert array.attrs["epoch_utc"] == "2026-03-20T12:00:00"
    assert array.band.values.tolist() == ["R", "G", "B", "N"]
    np.testing.assert_allclose(array.band_from, [600.0, 500.0, 400.0, 700.0])
    np.testing.assert_allclose(array.band_to, [700.0, 600.0, 500.0, 1000.0])
    assert (float(array.row[0]), float(array.column[-1])) == (0.5, 15.5)
    assert np.shares_memory(array.values, capture.radiance.radiance)


def test_without_xarray_a_line_says_how_to_install_it(
    capture: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    assert capture.radiance is not None
    with pytest.raises(ConfigError, match=r'needs xarray: pip install "simgl\[xarray\]"$'):
        capture.radiance.to_xarray()
