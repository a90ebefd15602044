"""Writes the shipped models: python -m tools.spacecraft_models [NAME ...] [--out models]."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from tools.spacecraft_models.atv_like import atv_like
from tools.spacecraft_models.cubesat_12u import cubesat_12u
from tools.spacecraft_models.debris_rocket_body import debris_rocket_body
from tools.spacecraft_models.generated_model import GeneratedModel
from tools.spacecraft_models.glb import glb_bytes
from tools.spacecraft_models.iss_like import iss_like
from tools.spacecraft_models.model_card import record_text
from tools.spacecraft_models.servicer import servicer
from tools.spacecraft_models.space_rider import space_rider
from tools.spacecraft_models.targets import calibration_board, marker_board, mirror, wedge

GENERATORS: Mapping[str, Callable[[], GeneratedModel]] = {
    "atv_like": atv_like,
    "calibration_board": calibration_board,
    "cubesat_12u": cubesat_12u,
    "debris_rocket_body": debris_rocket_body,
    "iss_like": iss_like,
    "marker_board": marker_board,
    "mirror": mirror,
    "servicer": servicer,
    "space_rider": space_rider,
    "wedge": wedge,
}


def write_model(name: str, out: Path) -> Path:
    """Writes one model's two files under `out`/`name` and returns that folder."""
    model = GENERATORS[name]()
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.glb").write_bytes(glb_bytes(model))
    (folder / "model.toml").write_text(record_text(model), encoding="utf-8", newline="\n")
    return folder


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m tools.spacecraft_models", description=__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(GENERATORS)}; default: all"
    )
    parser.add_argument("--out", type=Path, default=Path("models"), help="default: models")
    options = parser.parse_args(arguments)
    unknown = sorted(set(options.names) - set(GENERATORS))
    if unknown:
        parser.error(f"no generator for {', '.join(unknown)}; there is {', '.join(GENERATORS)}")
    for name in options.names or GENERATORS:
        print(write_model(name, options.out))


if __name__ == "__main__":
    main()
