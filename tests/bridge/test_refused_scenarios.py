"""A scenario beyond any use is answered as a bad scene, not as a fault of the server."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from unittest.mock import MagicMock

import pytest
from simgl_bridge.messages import Configure, Error
from simgl_bridge.render_process import Renderer
from simgl_bridge.render_session import RenderSession

from simgl import simulator
from simgl.errors import ConfigError
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario

EPOCH = 'utc = "2026-03-20T12:00:00"'
SCENES = {
    "deep": f"[epoch]\n{EPOCH}\n[render]\nseed = {5000 * '['}{5000 * ']'}\n",
    "dotted": f"[epoch]\n{EPOCH}\n[render]\nseed{100_000 * '.a'} = 1\n",
    "crowded": f"[epoch]\n{EPOCH}\n" + "".join(f"[camera.n{i}]\n" for i in range(2000)),
    "large": f"[epoch]\n{EPOCH}\n[earth]\nshape = 'none'\n",
}


def _opened(scenario: Scenario) -> simulator.Simulator:
    if scenario.name == "large":
        raise ConfigError("large.toml [camera.nav]", "width_px, height_px", "are too many")
    return MagicMock(spec=simulator.Simulator, renderer_name="none")


@pytest.fixture
def renderer(tmp_path: Path) -> Iterator[Renderer]:
    for name, text in SCENES.items():
        (tmp_path / f"{name}.toml").write_text(text)
    first = scenario_from_dict({"epoch": {"utc": "2026-03-20T12:00:00"}})
    with RenderSession(first, root=tmp_path, open_simulator=_opened) as session:
        yield Renderer(session=session)


@pytest.mark.parametrize("name", SCENES)
def test_a_scenario_that_is_refused_is_of_no_use_to_ask_for_again(
    renderer: Renderer, name: str
) -> None:
    report, frames = renderer.answer(Configure(id=1, scenario=name))
    assert isinstance(report, Error)
    assert (report.code, report.retryable, list(frames)) == ("BAD_SCENE", False, [])
    assert f"{name}.toml" in report.detail
    assert "\n" not in report.detail
    # The present scenario stays.
    assert renderer.session.scenario.name == "scenario"
