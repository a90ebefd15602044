"""A campaign's bolometer holds what it saw before: DN trail, labels are those of the epoch."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from simgl.campaign.campaign_file import Campaign, load_campaign
from simgl.campaign.frame_scene import frame_scene
from simgl.campaign.frame_task import CampaignJob
from simgl.scene.state import SceneState
from simgl.simulator import Simulator
from tests.campaign.small import CAMPAIGN, SCENE

# Of the preset's pixel [s].
TIME_CONSTANT = 8e-3
RANGE, FOCAL_PX = 6.0, 125.0


def thermal_campaign(folder: Path, rate_deg_s: float) -> Campaign:
    """The small campaign through a bolometer that turns at a rate."""
    folder.mkdir()
    # Down to nearly the cold of space, so that no light is cut off, and with little noise.
    quiet = "range_k = [100.0, 320.0], netd_mk = 0.1"
    camera = f'thermal = {{ detector = "bolometer_lwir", {quiet} }}\n[render]'
    (folder / "scene.toml").write_text(SCENE.replace("[render]", camera, 1))
    draw = f'range_m = {RANGE}\ndirection = "sphere"\ncamera_rate_deg_s = {rate_deg_s}\n'
    head = CAMPAIGN.replace("[draw]", 'write = ["dn16"]\n[draw]')
    (folder / "campaign.toml").write_text(head + draw)
    return load_campaign(folder / "campaign.toml")


def in_the_image(state: SceneState) -> np.ndarray:
    """(2,) place of the target [px], to first order in its distance from the boresight."""
    camera, target = state.cameras["nav"], state.bodies["target"].pose
    at = camera.R_camera_from_icrf @ (target.position - camera.position)
    return FOCAL_PX * at[:2] / at[2]


def middle_of_light(png: bytes) -> np.ndarray:
    """(2,) column and row of the mean of the DN."""
    dn = np.asarray(Image.open(io.BytesIO(png))).astype(np.float64)
    rows, columns = np.indices(dn.shape)
    return np.array([(dn * columns).sum(), (dn * rows).sum()]) / dn.sum()


@pytest.mark.parametrize("frame", [0, 3])
def test_a_campaigns_bolometer_trails_by_its_time_constant(tmp_path: Path, frame: int) -> None:
    # Up to 2 px within a time constant; a camera that turns sees the same sides of the target.
    turning = float(np.degrees(2.0 / FOCAL_PX / TIME_CONSTANT))
    made = {v: thermal_campaign(tmp_path / f"{v:g}", v) for v in (0.0, turning)}
    with Simulator(made[0.0].scenario) as simulator:
        seen = {v: CampaignJob(campaign=one).render(simulator, frame) for v, one in made.items()}
    middles = {v: middle_of_light(one.files[f"dn16/{frame:06d}.png"]) for v, one in seen.items()}
    scene = frame_scene(made[turning], frame)
    assert scene.during is not None
    before = scene.during(scene.state.tai_ns - round(1e9 * TIME_CONSTANT))
    trail = in_the_image(before) - in_the_image(scene.state)
    assert np.linalg.norm(trail) > 0.5
    # In the mean the light is as old as the time constant; its fixed pattern leaves 0.03 px.
    np.testing.assert_allclose(middles[turning] - middles[0.0], trail, atol=0.05)
    labels = [json.loads(one.files[f"labels/{frame:06d}.json"]) for one in seen.values()]
    assert labels[0] == labels[1]
