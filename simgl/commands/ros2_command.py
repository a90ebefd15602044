"""``simgl ros2``: a live node on ROS 2's topics."""

from __future__ import annotations

from contextlib import closing
from threading import Event
from typing import Annotated

import typer

from simgl.cli_progress import load, opened
from simgl.commands.command_line import say, with_option_groups
from simgl.commands.render_commands import Cameras, ScenarioFile, camera_names
from simgl.errors import ConfigError
from simgl.sequence.epoch_options import EpochOptions, EventOptions

# ROS 2's domains on Linux.
_MAX_DOMAIN = 101

# Cyclone binds its receiving sockets to all interfaces and has no setting that changes it.
_OPEN_PORTS = "is needed: DDS opens its ports (7400 and up) on all networks, not on loopback alone"


@with_option_groups
def ros2(
    scenario: ScenarioFile,
    epochs: EpochOptions,
    event: EventOptions,
    play: Annotated[
        bool,
        typer.Option("--play", help="Publish the scenario's own epochs in real time."),
    ] = False,
    camera: Cameras = None,
    depth: Annotated[bool, typer.Option("--depth", help="Also depth images (32FC1).")] = False,
    all_interfaces: Annotated[
        bool,
        typer.Option("--all-interfaces", help="Agree that DDS opens its ports on all networks."),
    ] = False,
    domain: Annotated[
        int,
        typer.Option(min=0, max=_MAX_DOMAIN, envvar="ROS_DOMAIN_ID", help="DDS domain."),
    ] = 0,
) -> None:
    """Publish images on ROS 2 topics, for the poses that other nodes publish on /tf.

    Each message on /tf with a spacecraft of the scenario gets its images, with its stamp. Where
    ROS 2 is installed it is a node by rclpy; else it needs Cyclone DDS only. It is announced on
    this machine only, unless variables of ROS or CYCLONEDDS_URI say otherwise; but DDS receives on
    all networks, which --all-interfaces agrees to.

    Example: simgl ros2 examples/approach.toml --all-interfaces

    Example: simgl ros2 examples/approach.toml --all-interfaces --play --duration 60 --step 0.5
    """
    from simgl.ros2.live_run import LiveRun, open_node
    from simgl.sequence.epochs import epochs as chosen_epochs

    if not all_interfaces:
        raise ConfigError("simgl ros2", "--all-interfaces", _OPEN_PORTS)
    loaded = load(scenario)
    names = camera_names(loaded, camera)
    node = open_node(loaded, names, domain, depth=depth)
    with closing(node), opened(loaded) as simulator:
        run = LiveRun(scenario=loaded, simulator=simulator, node=node, cameras=names, depth=depth)
        if play:
            chosen = chosen_epochs(loaded, epochs, names[0], event)
            late = run.play(chosen, Event())
            say(f"{len(chosen)} epochs played, {late} of them late")
            return
        say(f"follows /tf in domain {domain} ({node.middleware}): {', '.join(names)}")
        run.follow(Event())
