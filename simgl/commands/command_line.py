"""What commands share: groups of options, and output for the person who started them."""

from __future__ import annotations

import inspect
import json
import math
import os
import signal
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, NoReturn, get_type_hints

import typer
from rich.console import Console, RenderableType

from simgl import interruption
from simgl.cli_progress import set_quiet
from simgl.errors import ConfigError, OutputError

COMMAND_LINE = "command line"

Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON document instead of text; see the docs.")
]


def say(*lines: object) -> None:
    """Print lines as they are: brackets in a path are no markup."""
    _print("\n".join(str(line) for line in lines))


def say_rich(*parts: RenderableType) -> None:
    """Print tables and text with markup, coloured in a terminal."""
    console = Console()
    with console.capture() as capture:
        for part in parts:
            console.print(part, highlight=False, soft_wrap=isinstance(part, str))
    _print(capture.get(), end="")


def say_json(document: Mapping[str, Any]) -> None:
    """Print a document; numbers that JSON does not have become null."""
    _print(json.dumps(_json_value(document), indent=1, ensure_ascii=False))


def _json_value(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _json_value(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_json_value(item) for item in value]
    # Of numpy.
    value = value.item() if hasattr(value, "item") else value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def _print(text: str, end: str = "\n") -> None:
    try:
        print(text, end=end, flush=True)
    except BrokenPipeError:
        end_without_reader()
    except OSError as error:
        _drop_rest_of_stdout()
        raise OutputError(f"standard output: cannot be written ({error.strerror})") from None


def end_without_reader() -> NoReturn:
    """End the command: the reader of stdout has closed it."""
    _drop_rest_of_stdout()
    interruption.receive(signal.SIGPIPE)


def _drop_rest_of_stdout() -> None:
    """What is left in the buffer must not fail again when Python ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def resumable(folder: Path, total: int, rows: str) -> None:
    """A signal's line says from now on how much of a run is in its folder.

    total : rows of the complete run
    rows : what a row is, in the plural
    """
    from simgl.sequence.journal import rows_written

    def describe() -> str:
        written = rows_written(folder)
        if written == 0:
            return f"none of {total} {rows} was complete"
        return (
            f"{written} of {total} {rows} are kept in {folder}, the same command goes on from there"
        )

    interruption.set_result_so_far(describe)


def _refuse_no_numbers(values: Mapping[str, object]) -> None:
    """Raises ConfigError for an option that Python reads as a float and that is no number."""
    for name, value in values.items():
        if isinstance(value, float) and not math.isfinite(value):
            option = f"--{name.replace('_', '-')}"
            raise ConfigError(COMMAND_LINE, option, f"must be finite, got {value}")


def with_quiet(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the option ``--quiet``, and with finite numbers alone."""
    quiet = inspect.Parameter(
        "quiet",
        inspect.Parameter.KEYWORD_ONLY,
        default=False,
        annotation=Annotated[bool, typer.Option("--quiet", help="Show no progress.")],
    )
    signature = inspect.signature(command, eval_str=True)
    given = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in signature.parameters.values()]

    def run(**values: Any) -> None:
        set_quiet(values.pop("quiet"))
        try:
            _refuse_no_numbers(values)
            command(**values)
        finally:
            set_quiet(False)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__signature__ = inspect.Signature([*given, quiet])  # type: ignore[attr-defined]
    return run


def with_option_groups(command: Callable[..., None]) -> Callable[..., None]:
    """The command with each parameter that is a dataclass replaced by its fields, as options."""
    parameters: list[inspect.Parameter] = []
    groups: dict[str, Any] = {}
    for name, parameter in inspect.signature(command, eval_str=True).parameters.items():
        if not is_dataclass(parameter.annotation):
            parameters.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY))
            continue
        groups[name] = parameter.annotation
        hints = get_type_hints(parameter.annotation, include_extras=True)
        parameters += [
            inspect.Parameter(
                field.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=field.default,
                annotation=hints[field.name],
            )
            for field in fields(parameter.annotation)
        ]

    def run(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field in fields(group)})
        command(**values)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return run


@dataclass(frozen=True, kw_only=True)
class WorkerOptions:
    """Who renders: processes on this machine, or those of a Dask scheduler."""

    workers: Annotated[
        int | None,
        typer.Option(min=1, max=1024, help="Processes on this machine; more than 1 need Dask."),
    ] = None
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, instead of --workers.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class FileFrameOptions:
    """Unit and axes of a model file."""

    unit: Annotated[
        str | None, typer.Option("--unit", help="Unit of the file: m, mm, cm, in, ft or km.")
    ] = None
    unit_m: Annotated[
        float | None, typer.Option(help="Metres per unit of the file, instead of --unit.")
    ] = None
    up_axis: Annotated[
        str | None,
        typer.Option(
            "--up-axis", help="Axis of the file that points up (body -z): x, y, z, -x, ..."
        ),
    ] = None
    forward_axis: Annotated[
        str | None,
        typer.Option(
            "--forward-axis",
            help="Axis of the file that points forward (body x); requires --up-axis.",
        ),
    ] = None

    def metres_and_axes(self) -> tuple[float | None, str | None, str | None]:
        """Metres per unit, axis up, axis forward; raises ConfigError."""
        from simgl.model_files.model_library import AXES, UNITS, body_from_file

        where, unit_m = COMMAND_LINE, self.unit_m
        if self.unit is not None and self.unit not in UNITS:
            problem = f'must be one of {", ".join(UNITS)}, got "{self.unit}"'
            raise ConfigError(where, "--unit", problem)
        if self.unit is not None and unit_m is not None:
            raise ConfigError(where, "--unit-m", "contradicts --unit; give one of them")
        if unit_m is not None and not 0.0 < unit_m < float("inf"):
            raise ConfigError(where, "--unit-m", f"must be positive, got {unit_m:g}")
        for option, axis in (("--up-axis", self.up_axis), ("--forward-axis", self.forward_axis)):
            if axis is not None and axis not in AXES:
                raise ConfigError(where, option, f'must be one of {", ".join(AXES)}, got "{axis}"')
        try:
            body_from_file(1.0, self.up_axis, self.forward_axis)
        except ValueError as error:
            raise ConfigError(where, "--forward-axis", str(error)) from None
        return (unit_m if self.unit is None else UNITS[self.unit]), self.up_axis, self.forward_axis
