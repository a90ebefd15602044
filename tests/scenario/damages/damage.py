"""A valid scenario file, and one passage of it replaced by another."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from simgl.camera.presets import shipped_presets
from simgl.model_files.model_library import shipped_models

UTC = 'utc = "2026-03-20T12:00:00"'
EPOCH = f"[epoch]\n{UTC}\n"
SUNWARD = "direction_icrf = [1.0, 0.0, 0.0]"
SHAPE = 'shape = "none"'
PLACE = "position_icrf_m = [7.0e6, 0.0, 0.0]"
PLATE = "model.plate = { width_m = 1.0, height_m = 1.0, material = { reflectance = 0.5 } }"
MODEL = 'model = "cubesat_12u"'
ORBIT = "orbit = { altitude_km = 400.0, inclination_deg = 51.6 }"
PINHOLE = "position_icrf_m = [7.0e6, 0.0, 10.0]"
LOOK = 'look_at = "plate"'
SEED = "seed = 1"

VALID = f"""\
{EPOCH}
[sun]
{SUNWARD}

[earth]
{SHAPE}

[spacecraft.plate]
{PLACE}
{PLATE}

[spacecraft.chaser]
{MODEL}
{ORBIT}

[camera.nav]
{PINHOLE}
{LOOK}

[render]
{SEED}
"""

# A lamp on the chaser, put before [render].
RENDER = "[render]"
LAMP = """\
[lamp.spot]
on = "chaser"
keypoint = "docking_port"
look_at = "plate"
half_angle_deg = 10.0
power_w = 5.0
temperature_k = 3000.0

[render]"""


@dataclass(frozen=True)
class Damage:
    """One passage of the valid file replaced by another, and the complaint that must follow.

    message : after the file's name; FILE, FOLDER, MODELS and PRESETS stand for what they are here
    """

    name: str
    old: str
    new: str
    message: str

    def text(self) -> str:
        """The damaged file."""
        assert VALID.count(self.old) == 1, self.old
        return VALID.replace(self.old, self.new)

    def complaint(self, path: Path) -> str:
        """The whole line for a file at this path."""
        meanings = {
            "FILE": str(path),
            "FOLDER": str(path.parent),
            "MODELS": ", ".join(shipped_models()),
            "PRESETS": ", ".join(shipped_presets()),
        }
        rest = self.message
        for word, meaning in meanings.items():
            rest = rest.replace(word, meaning)
        return f"{path}{rest}"


def written(folder: Path, text: str, name: str = "scene.toml") -> Path:
    """A scenario file of the given text."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
