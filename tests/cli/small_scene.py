"""A block of 2 m before a small camera, in deep space."""

from __future__ import annotations

SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[sun]
direction_icrf = [0.0, 0.0, 1.0]
[earth]
shape = "none"
[spacecraft.block]
position_icrf_m = [7.0e6, 0.0, 0.0]
model.box = { size_m = [2.0, 2.0, 2.0], material = { reflectance = 0.5 } }
[camera.nav]
position_icrf_m = [7.0e6, 0.0, 20.0]
look_at = "block"
width_px = 48
height_px = 32
focal_length_mm = 0.6
[render]
samples_per_pixel = 5
"""
PINHOLE = "position_icrf_m = [7.0e6, 0.0, 20.0]"
