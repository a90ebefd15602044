"""``simgl follow``: images of the states of another simulator."""

from __future__ import annotations

from typing import Annotated

import typer

from simgl.commands.command_line import say
from simgl.errors import ConfigError
from simgl_bridge.bind_address import DEFAULT_ADDRESS


def follow(
    from_42: Annotated[
        str,
        typer.Option("--from-42", help="HOST:PORT where the simulator 42 serves its state."),
    ],
    address: Annotated[
        str, typer.Option(help="Address of the running simgl serve that renders.")
    ] = DEFAULT_ADDRESS,
    spacecraft: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=SC or NAME=SC:ORB: the scenario's spacecraft is SC[SC] of 42 and flies on "
            "Orb[ORB]. Without it the spacecraft are SC[0], SC[1] ... in the scenario's order."
        ),
    ] = None,
    centre_of_mass: Annotated[
        list[str] | None,
        typer.Option(help="NAME=X,Y,Z in metres, in the axes of the scenario's model."),
    ] = None,
    joint: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME.JOINT=G0.Ang2: an angle (or travel, Pos) of a joint of 42 moves a joint "
            "of the model."
        ),
    ] = None,
    camera: Annotated[
        list[str] | None, typer.Option(help="Camera name, once for each camera; all if not given.")
    ] = None,
    product: Annotated[
        list[str] | None,
        typer.Option(help="dn, radiance, electrons, depth, part_id; dn without it."),
    ] = None,
    period_s: Annotated[
        float,
        typer.Option(min=0.0, help="Render one state of every such interval; 0 renders each."),
    ] = 0.0,
    moving: Annotated[
        bool,
        typer.Option("--moving", help="Motion blur: spacecraft move while the shutter is open."),
    ] = False,
    patience_s: Annotated[
        float,
        typer.Option(
            min=1.0, help="Longest wait in seconds for 42 to start, and for its next state."
        ),
    ] = 600.0,
) -> None:
    """Render the states of the simulator 42, in lock-step with it.

    42 waits until the images of its state are there. Flight software takes them from the same
    server, by Client.next_images. Ends when 42 ends.

    Example: simgl follow --from-42 localhost:10001 --spacecraft target=0 --spacecraft chaser=1
    """
    from simgl_bridge.client import Client
    from simgl_bridge.client_protocol import shot_of
    from simgl_bridge.from_42.following import follow as follow_42
    from simgl_bridge.from_42.spacecraft_source import sources_of
    from simgl_bridge.from_42.text_socket import TextSocket
    from simgl_bridge.serving import stop_on_signals

    host, _, port = from_42.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise ConfigError("simgl follow", "--from-42", f"must be HOST:PORT, got {from_42}")
    with stop_on_signals() as stop, Client(address, name="simgl follow") as client:
        sources = sources_of(client.welcome, spacecraft or [], centre_of_mass or [], joint or [])
        names = camera or [description.name for description in client.welcome.cameras]
        shots = [shot_of(name, None, None, product or ["dn"]) for name in names]
        for name, source in sources.items():
            say(f"{name} is SC[{source.index}] on Orb[{source.orbit}] of 42")
        with TextSocket(host, int(port), patience_s, stop) as link:
            followed = follow_42(
                link,
                client,
                sources,
                shots,
                period_ns=round(period_s * 1e9),
                moving=moving,
            )
    say(f"{followed.states} states of 42, {followed.rendered} of them rendered")
