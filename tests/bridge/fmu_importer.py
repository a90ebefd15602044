"""FMUs in FMPy, with variables by their names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from simgl.arrays import Image16


class Importer:
    """An instance of an FMU.

    log : (status, category, message) of its messages
    """

    def __init__(self, path: Path, folder: Path, name: str) -> None:
        from fmpy import extract, read_model_description
        from fmpy.fmi3 import FMU3Slave

        self.description = read_model_description(str(path))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.log: list[tuple[int, str, str]] = []
        extract(str(path), str(folder))
        self._fmu = FMU3Slave(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )

        def note(environment: Any, status: int, category: bytes, message: bytes) -> None:
            del environment
            self.log.append((status, category.decode(), message.decode()))

        self._fmu.instantiate(loggingOn=True, logMessage=note)

    def start(self, **parameters: Any) -> None:
        """Set parameters and initialize."""
        for name, value in parameters.items():
            self.set(name, value)
        self._fmu.enterInitializationMode()
        self._fmu.exitInitializationMode()

    def set(self, name: str, value: Any) -> None:
        """Set a variable, row by row."""
        variable = self.variables[name]
        setter = getattr(self._fmu, f"set{variable.type}")
        values = [value] if isinstance(value, str) else np.ravel(value).tolist()
        setter([variable.valueReference], values)

    def get(self, name: str) -> Any:
        """The value of a variable; a list of an array."""
        variable = self.variables[name]
        kind = "Int64" if variable.type == "Enumeration" else variable.type
        count = int(np.prod([int(d.start) for d in variable.dimensions], dtype=np.int64))
        arguments = () if kind == "Binary" else (count,)
        values = getattr(self._fmu, f"get{kind}")([variable.valueReference], *arguments)
        value = values if variable.dimensions else values[0]
        return value.decode() if isinstance(value, bytes) and kind == "String" else value

    def image(self) -> Image16:
        """The image as an array."""
        shape = [int(d.start) for d in self.variables["image"].dimensions]
        return np.array(self.get("image"), dtype=np.uint16).reshape(shape)

    def step(self, time_s: float, step_s: float = 0.1) -> None:
        """Do a step; raises FMPy's FMICallException where it fails."""
        self._fmu.doStep(currentCommunicationPoint=time_s, communicationStepSize=step_s)

    def reset(self) -> None:
        """As newly instantiated."""
        self._fmu.reset()

    def errors(self) -> list[str]:
        """The messages of failed calls."""
        return [message for status, category, message in self.log if category == "logStatusError"]

    def close(self) -> None:
        """Free the instance."""
        self._fmu.freeInstance()


@contextmanager
def imported(path: Path, folder: Path, name: str = "camera") -> Iterator[Importer]:
    """An FMU, freed with the block."""
    importer = Importer(path, folder, name)
    try:
        yield importer
    finally:
        importer.close()
