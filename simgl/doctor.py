"""What OpenGL this machine offers simgl, and the line that mends what is missing."""

from __future__ import annotations

from dataclasses import dataclass

from simgl.errors import ContextError
from simgl.gpu.context import GlReport, egl_device_count, report, temporary_context


@dataclass(frozen=True)
class Finding:
    """One backend that was tried: a report, or the error."""

    backend: str
    device_index: int
    report: GlReport | None
    error: ContextError | None


def _try(backend: str, device_index: int) -> Finding:
    try:
        with temporary_context(backend, device_index) as ctx:
            return Finding(backend, device_index, report(ctx, backend), None)
    except ContextError as error:
        return Finding(backend, device_index, None, error)


def examine(device_index: int | None = None) -> list[Finding]:
    """Every EGL device (or the one asked for) and OSMesa, each opened and closed again."""
    indices = range(egl_device_count() or 1) if device_index is None else (device_index,)
    return [_try("egl", index) for index in indices] + [_try("osmesa", 0)]
