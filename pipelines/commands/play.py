"""``racecar play``: publish a bag as if the car drove now."""

from typing import Annotated

import typer

from racecar.pipelines.commands.options import BagArgument, QuietOption


def play(
    context: typer.Context,
    bag: BagArgument,
    speed: Annotated[
        float,
        typer.Option("--speed", metavar="X", min=0.01, max=1000.0, help="Playback speed; 1 is as recorded."),
    ] = 1.0,
    topics: Annotated[
        list[str] | None,
        typer.Option("--topic", metavar="TOPIC", help="Play only this topic; may be repeated."),
    ] = None,
    clock: Annotated[
        bool, typer.Option("--clock", help="Also publish /clock, for nodes with use_sim_time.")
    ] = False,
    wait: Annotated[
        float,
        typer.Option(
            "--wait", metavar="SECONDS", min=0.0, help="How long to wait for a listener to the scans."
        ),
    ] = 3.0,
    listeners: Annotated[
        int | None,
        typer.Option(
            "--listeners",
            metavar="N",
            min=1,
            help="Begin as soon as N nodes listen to the scans; by default, when no new one has appeared "
            "for 3 s.",
        ),
    ] = None,
    quiet: QuietOption = False,
) -> None:
    """Publish a bag over ROS 2, at the speed it was recorded or another. Ctrl-C ends it.

    Example: racecar play drive.bag --speed 2

    With other topics: racecar play drive.bag --ros-args -r /vesc/odom:=/odom
    """
    from racecar.pipelines.live.ros.start import start_ros

    start_ros()

    from racecar.pipelines.commands.terminal import teller
    from racecar.pipelines.live.player import Player
    from racecar.pipelines.live.ros.run import ros_node
    from racecar.pipelines.runs.progress import progress_bar

    tell = teller(quiet=quiet)
    with ros_node("racecar_player", context.obj) as node:
        player = Player(node, bag, topics or ())
        try:
            for topic in player.left_out:
                tell(f"{topic.name} is left out: this ROS has no {topic.message_type}.")
            if clock:
                player.publish_clock()
            if not player.wait_for_listeners(wait, listeners):
                tell("No node listens to the scans yet; playing anyway.")
            with progress_bar("Playing", player.message_count, quiet=quiet) as advance_to:
                played = player.play(speed, advance_to)
        finally:
            player.close()
    tell(
        f"Played {played.messages} messages, {played.scans} of them scans; the latest was "
        f"{played.latest * 1e3:.1f} ms late."
    )
