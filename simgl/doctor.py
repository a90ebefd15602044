"""The OpenGL that this machine offers, and how to install what is missing."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

from simgl import __version__
from simgl.errors import ContextError
from simgl.gpu.context import GlReport, egl_device_count, report, temporary_context


@dataclass(frozen=True)
class Finding:
    """One backend that was tried: a report, or the error."""

    backend: str
    device_index: int
    report: GlReport | None
    error: ContextError | None


def advice(used: GlReport) -> str | None:
    """What to know before long runs with this OpenGL, in one line; None if there is nothing."""
    if "llvmpipe" not in used.renderer or os.cpu_count() == 1:
        return None
    if os.environ.get("LP_NUM_THREADS") == "0":
        return None
    return (
        "Threads of llvmpipe crash a process in rare cases. LP_NUM_THREADS=0 excludes it; "
        "frames take a little longer."
    )


def findings_document(findings: Sequence[Finding]) -> dict[str, object]:
    """The findings as ``simgl doctor --json`` prints them."""
    backends: list[dict[str, object]] = []
    for finding in findings:
        entry: dict[str, object] = {
            "backend": finding.backend,
            "device_index": finding.device_index,
            "usable": finding.report is not None,
        }
        if finding.report is not None:
            entry |= {
                "vendor": finding.report.vendor,
                "renderer": finding.report.renderer,
                "opengl": finding.report.version,
                "on_cpu": finding.report.software,
            }
        elif finding.error is not None:
            entry |= {"reason": finding.error.reason, "remedy": finding.error.remedy}
        backends.append(entry)
    usable = [finding.backend for finding in findings if finding.report is not None]
    return {"simgl": __version__, "renders_with": usable[0] if usable else None,
            "backends": backends}  # fmt: skip


def _try(backend: str, device_index: int) -> Finding:
    try:
        with temporary_context(backend, device_index) as ctx:
            return Finding(backend, device_index, report(ctx, backend), None)
    except ContextError as error:
        return Finding(backend, device_index, None, error)


def check_opengl(device_index: int | None = None) -> list[Finding]:
    """Every EGL device (or the one asked for) and OSMesa, each opened and closed again."""
    indices = range(egl_device_count() or 1) if device_index is None else (device_index,)
    return [_try("egl", index) for index in indices] + [_try("osmesa", 0)]
