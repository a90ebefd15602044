"""How the surfaces of spacecraft models see each other, found once for each of their shapes."""

from __future__ import annotations

import numpy as np

from simgl.lru_cache import LruCache
from simgl.progress import ProgressCallback
from simgl.radiosity.bake_cache import transport_of
from simgl.radiosity.light_transport import LightTransport
from simgl.scene.spacecraft import SpacecraftModel

# Light between surfaces changes little over a few degrees of a joint, and tracing it takes seconds.
JOINT_STEP = np.radians(5.0)
# Shapes that are kept, up to 25 MB each: an arm on the move takes a new one with every step.
KEPT = 32


class TransportStore:
    """The transports of models by their content."""

    def __init__(self) -> None:
        self._found = LruCache[tuple[str, bool], LightTransport | None](KEPT)

    def of(
        self, model: SpacecraftModel, progress: ProgressCallback | None = None
    ) -> LightTransport | None:
        """How a model's surfaces see each other; None where none sees another.

        Traced at the first call, if no file has it. Joints stand at the nearest multiple of
        ``JOINT_STEP``.
        """
        model = model.coarsely_posed(JOINT_STEP)
        key = model.mesh.digest, model.open_sheets
        return self._found.get(
            key,
            lambda: transport_of(model.mesh, open_sheets=model.open_sheets, progress=progress),
        )
