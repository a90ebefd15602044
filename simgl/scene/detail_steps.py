"""How exactly parts of spacecraft have to be drawn: errors that far ones may have.

Allowed errors come in steps, the same for everything. So a picture is a function of the state
alone, and what was drawn for one distance serves for all within a step.
"""

from __future__ import annotations

# Errors that levels of detail are made for [m].
RUNGS = tuple(0.0032 * 2.0**k for k in range(12))


def step_below(error: float) -> float:
    """The largest of ``RUNGS`` that is no larger than an error [m]; 0 where there is none."""
    return max((rung for rung in RUNGS if rung <= error), default=0.0)
