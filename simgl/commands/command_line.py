"""What commands share: groups of options, and output for the person who started them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from typing import Annotated, Any, get_type_hints

import typer
from rich.console import Console

from simgl.errors import ConfigError

COMMAND_LINE = "command line"
console = Console()


def say(*lines: object) -> None:
    """Lines as they are: brackets in a path are no markup."""
    text = "\n".join(str(line) for line in lines)
    console.print(text, highlight=False, markup=False, soft_wrap=True)


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
        str | None, typer.Option("--unit", help="Of the file: m, mm, cm, in, ft or km.")
    ] = None
    unit_m: Annotated[float | None, typer.Option(help="Or metres per unit of the file.")] = None
    up_axis: Annotated[
        str | None, typer.Option("--up-axis", help="Of the file, becomes body -z: x, y, z, -x, ...")
    ] = None
    forward_axis: Annotated[
        str | None,
        typer.Option("--forward-axis", help="Of the file, becomes body x; with --up-axis."),
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
