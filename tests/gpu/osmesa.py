"""Whether this machine has OSMesa."""

from __future__ import annotations

import ctypes

import pytest


def _loads() -> bool:
    try:
        ctypes.CDLL("libOSMesa.so.8")
    except OSError:
        return False
    return True


needs_osmesa = pytest.mark.skipif(not _loads(), reason="libosmesa6 is not installed")
