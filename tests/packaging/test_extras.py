"""What is an extra is imported by nobody who does not ask for it, and named where it is missing."""

from __future__ import annotations

import subprocess
import sys

import pytest

# Of the extras of pyproject.toml, and what only a user's own environment has.
OPTIONAL = [
    "cyclonedds",
    "dask",
    "dv_processing",
    "fmpy",
    "h5py",
    "mcap",
    "mcap_ros2",
    "rosbags",
    "spiceypy",
    "torch",
    "tornado",
    "webdataset",
    "xarray",
    "zstandard",
]


def said(program: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout.strip()


def test_neither_simgl_nor_its_bridge_imports_an_extra() -> None:
    modules = "simgl, simgl.cli, simgl_bridge, simgl_bridge.serving, simgl.campaign.run_campaign"
    program = f"import sys, {modules}\nfrom simgl.commands.application import app\n"
    names = said(f"{program}print(*{{name.partition('.')[0] for name in sys.modules}})").split()
    assert {"simgl", "simgl_bridge"} <= set(names)
    assert not set(OPTIONAL) & set(names)


@pytest.mark.parametrize(
    ("hidden", "module", "line"),
    [
        (
            "cyclonedds.core",
            "simgl.ros2.dds_node",
            'simgl ros2: needs Cyclone DDS: pip install "simgl[dds]"',
        ),
        (
            "torch",
            "simgl.campaign.torch_dataset",
            "CampaignDataset: needs PyTorch: pip install torch",
        ),
    ],
)
def test_a_missing_package_is_one_line_with_the_command(
    hidden: str, module: str, line: str
) -> None:
    program = (
        f"import sys; sys.modules[{hidden!r}] = None\n"
        "from simgl.errors import ConfigError\n"
        f"try: import {module}\n"
        "except ConfigError as error: print(error)"
    )
    assert said(program) == line
