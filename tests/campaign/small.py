"""A small campaign: a box with a named corner or two, looked at by a camera on a CubeSat."""

from __future__ import annotations

from pathlib import Path

from simgl.campaign.campaign_file import Campaign, load_campaign

LIT_BY_LAMP = """\
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
shape = "none"
[spacecraft.target]
model = "wedge"
orbit = { altitude_km = 400.0 }
[spacecraft.chaser]
model.box = { size_m = [0.2, 0.2, 0.2], material = { reflectance = 0.5 } }
relative_to = "target"
position_lvlh_m = [-10.0, 0.0, 0.0]
point_at = { target = "target", axis_body = [1.0, 0.0, 0.0] }
[lamp.spot]
on = "chaser"
position_body_m = [0.12, 0.0, 0.0]
boresight = [1.0, 0.0, 0.0]
half_angle_deg = 20.0
power_w = 5.0
temperature_k = 3000.0
[camera.nav]
on = "chaser"
position_body_m = [0.15, 0.0, 0.0]
boresight = [1.0, 0.0, 0.0]
up = [0.0, 0.0, -1.0]
width_px = 80
height_px = 60
focal_length_mm = 1.5
"""
_RENDER = """\
[render]
seed = 3
inter_reflection = false
"""
SCENE = LIT_BY_LAMP + _RENDER
CAMPAIGN = """\
scenario = "scene.toml"
frames = 12
seed = 5
[draw]
"""
DRAW = """\
epoch_offset_s = { uniform = [0.0, 900.0] }
range_m = { log_uniform = [1.5, 12.0] }
direction = "sphere"
attitude = "uniform"
roll_deg = { uniform = [0.0, 360.0] }
exposure_time_s = { log_uniform = [1e-5, 1e-4] }
"""


def written(folder: Path, draw: str = DRAW, head: str = CAMPAIGN) -> Path:
    """The file of a campaign with such a table ``[draw]``."""
    (folder / "scene.toml").write_text(SCENE)
    path = folder / "campaign.toml"
    path.write_text(head + draw)
    return path


def small_campaign(folder: Path, draw: str = DRAW) -> Campaign:
    """The same, loaded."""
    return load_campaign(written(folder, draw))
