"""Events in a file: HDF5 as in the DSEC data set, AEDAT4 of iniVation, or numpy's npz.

The layouts are on the page docs/event_camera.md. The packages of HDF5 and AEDAT4 are extras, which
are imported where such a file is written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from simgl import __version__
from simgl.camera.camera import Camera
from simgl.camera.event_pixels import Events, joined
from simgl.errors import ConfigError, OutputError
from simgl.output import complete_file

# Events in a chunk of an HDF5 data set.
_CHUNK = 1 << 16


@dataclass(frozen=True, kw_only=True)
class EventSource:
    """What a file says of its events.

    camera : with an event sensor
    start : from which they were recorded [TAI ns]
    renderer : name of the OpenGL renderer
    """

    camera: Camera
    scenario: str
    seed: int
    start: int
    renderer: str

    @property
    def attributes(self) -> dict[str, Any]:
        """By names with units."""
        camera, sensor = self.camera, self.camera.event_sensor
        assert sensor is not None
        return {
            "simgl": __version__,
            "scenario": self.scenario,
            "renderer": self.renderer,
            "seed": self.seed,
            "start_tai_ns": self.start,
            "camera": camera.name,
            "width_px": camera.detector.width,
            "height_px": camera.detector.height,
            "intrinsics": camera.intrinsics,
            "threshold_on": sensor.threshold_on,
            "threshold_off": sensor.threshold_off,
            "threshold_spread": sensor.threshold_spread,
            "refractory_us": sensor.refractory_time * 1e6,
            "leak_hz": sensor.leak_rate,
            "shot_noise_hz": sensor.shot_noise_rate,
            "dark_current_e_s": camera.detector.dark_current,
        }


def write_events(path: Path, source: EventSource, parts: Iterable[Events]) -> tuple[int, int]:
    """Write events, part by part as they come; the file gets its name when it is complete.

    path : ends in .h5, .hdf5, .aedat4 or .npz
    parts : in the order of their times
    returns : number of ON and of OFF events

    Raises ConfigError as ``check_event_file`` does, OutputError where the file cannot be written.
    """
    check_event_file(path)
    on = total = 0
    with complete_file(path) as temporary:
        try:
            with _FORMATS[path.suffix].writing(temporary, source) as write:
                for events in parts:
                    write(events)
                    on += int(np.count_nonzero(events.on))
                    total += len(events)
        except RuntimeError as error:
            # Of the libraries, such as on a full disk.
            raise OutputError(f"{path}: cannot be written ({error})") from None
    return on, total - on


def check_event_file(path: Path) -> None:
    """Raise ConfigError for a path of another ending, and where the package for it is missing."""
    if path.suffix not in _FORMATS:
        problem = f'must end in {", ".join(_FORMATS)}, got "{path.name}"'
        raise ConfigError("command line", "--out", problem)
    file_format = _FORMATS[path.suffix]
    if find_spec(file_format.package) is None:
        problem = f"with {path.suffix} needs {file_format.package}: {file_format.install}"
        raise ConfigError("command line", "--out", problem)


@contextmanager
def _hdf5(path: Path, source: EventSource) -> Iterator[Callable[[Events], None]]:
    """Data sets ``events/t``, ``x``, ``y``, ``p``, ``ms_to_idx`` and ``t_offset`` as in DSEC."""
    import h5py

    offset_us = source.start // 1000
    with h5py.File(path, "w") as file:
        file.attrs.update(source.attributes)
        file["t_offset"] = np.int64(offset_us)
        columns = {
            name: file.create_dataset(
                f"events/{name}",
                shape=(0,),
                maxshape=(None,),
                chunks=(_CHUNK,),
                dtype=dtype,
                compression="gzip",
                compression_opts=1,
                shuffle=True,
            )
            for name, dtype in (("t", "i8"), ("x", "u2"), ("y", "u2"), ("p", "u1"))
        }
        # Number of events before the end of each millisecond.
        per_ms = [np.zeros(1, dtype=np.int64)]

        def write(events: Events) -> None:
            t = events.tai_ns // 1000 - offset_us
            count = len(columns["t"])
            for name, values in (("t", t), ("x", events.x), ("y", events.y), ("p", events.on)):
                columns[name].resize(count + len(events), axis=0)
                columns[name][count:] = values
            if len(events):
                ends = np.arange(sum(map(len, per_ms)), t[-1] // 1000 + 1) * 1000
                per_ms.append(count + np.searchsorted(t, ends))

        yield write
        file["ms_to_idx"] = np.concatenate(per_ms).astype(np.uint64)


@contextmanager
def _aedat4(path: Path, source: EventSource) -> Iterator[Callable[[Events], None]]:
    """One stream of events, by the library of the format's makers."""
    import dv_processing as dv

    detector = source.camera.detector
    size = detector.width, detector.height
    config = dv.io.MonoCameraWriter.EventOnlyConfig(source.camera.name, size)
    # The library writes a file's end when its last reference goes.
    files = [dv.io.MonoCameraWriter(str(path), config)]

    def write(events: Events) -> None:
        store = dv.EventStore()
        columns = events.tai_ns // 1000, events.x, events.y, events.on
        for t, x, y, on in zip(*(column.tolist() for column in columns), strict=True):
            store.push_back(t, x, y, on)
        if len(events):
            files[0].writeEvents(store)

    yield write
    files.clear()


@contextmanager
def _npz(path: Path, source: EventSource) -> Iterator[Callable[[Events], None]]:
    """The arrays of ``Events``, and what HDF5 has as attributes."""
    parts: list[Events] = []
    yield parts.append
    events = joined(parts)
    arrays: dict[str, Any] = {"tai_ns": events.tai_ns, "x": events.x, "y": events.y, "p": events.on}
    np.savez_compressed(path, **(arrays | source.attributes))


@dataclass(frozen=True)
class _Format:
    writing: Callable[[Path, EventSource], AbstractContextManager[Callable[[Events], None]]]
    package: str
    install: str = ""


_HDF5 = _Format(_hdf5, "h5py", 'pip install "simgl[events]"')
_FORMATS = {
    ".h5": _HDF5,
    ".hdf5": _HDF5,
    ".aedat4": _Format(_aedat4, "dv_processing", 'pip install "simgl[aedat4]"'),
    ".npz": _Format(_npz, "numpy"),
}
