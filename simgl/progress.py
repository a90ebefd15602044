"""A bar on the terminal while light between surfaces is traced."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress as Bar

from simgl.transport.bake import Progress


@contextmanager
def bake_bar(console: Console | None = None) -> Iterator[Progress]:
    """What a ``Simulator`` tells its progress to; shown on a terminal only, and only if it bakes.

    console : standard error, if not given
    """
    console = Console(stderr=True) if console is None else console
    with Bar(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = None

        def report(done: int, total: int) -> None:
            nonlocal task
            if task is None:
                task = bar.add_task("tracing light between surfaces")
            bar.update(task, completed=done, total=total)

        yield report
