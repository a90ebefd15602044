"""Damaged scenario files: each value replaced, and the one line that must follow."""

from __future__ import annotations

from tests.scenario.damages import cameras, files, light, missing, models, motion, pointing

BAD_VALUES = (
    *files.DAMAGES,
    *cameras.DAMAGES,
    *pointing.DAMAGES,
    *models.DAMAGES,
    *motion.DAMAGES,
    *light.DAMAGES,
)
BAD_FILES = missing.DAMAGES
