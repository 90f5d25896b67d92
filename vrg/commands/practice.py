"""The command `vrg practice`: one robot, or a team, on a map without a referee's rules."""

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import tomlkit
import typer

from vrg.commands.groups import PlayOptions, PracticeOptions
from vrg.commands.options import PoseOption, lasting
from vrg.config.targets import whole_target
from vrg.errors import ConfigError
from vrg.launch.fork_server import fork_server
from vrg.types import Pose

_STEP = 1.5
"""The distance in m between two robots, and between two places that are tried for one."""


def practice(
    options: PracticeOptions,
    strategy: Annotated[
        str | None,
        typer.Argument(
            metavar="[STRATEGY]", help="The robots' strategy, such as mine.py:Mine. Without it, you drive them."
        ),
    ] = None,
    map_: Annotated[str, typer.Option("--map", help="A map's name, or the path of its file.")] = "courtyard",
    robots: Annotated[int, typer.Option(min=1, max=32, help="How many.")] = 1,
    model: Annotated[str, typer.Option(help="The model of the robots.")] = "P2AT",
    pose: PoseOption = None,
    seconds: Annotated[float | None, lasting("How long; by default until Ctrl-C, or 60 s in one process.", 1)] = None,
) -> None:
    """Try a player on a map, without a referee's judgement. In the window TAB and the arrow keys drive a robot by hand.

    The first robot begins at --pose, or in the middle; the others stand around it.
    """
    options.check()
    wanted = not options.in_process or strategy is not None
    with fork_server(wanted=wanted) as server, tempfile.TemporaryDirectory() as folder:
        from vrg.commands.playing import play_match
        from vrg.config.loading import load_match
        from vrg.playing.trial import trial

        lasting = seconds if seconds is not None else 60.0 if options.steps else 0.0
        target = None if strategy is None else whole_target(strategy)
        file = Path(folder, "practice.toml")
        with trial(server) as tried:  # a mistake is reported before anything starts
            if target is not None:
                tried.find(target, Path.cwd())
            file.write_text(match_text(map_, robots, model, target, lasting, pose), encoding="utf-8")
            if target is not None and not options.in_process:  # there the match itself begins with that
                setup = load_match(file, base=Path.cwd())
                tried.make(setup, setup.players[0].name)
        if target is None and not options.steps and not options.headless:
            typer.echo("in the window M and the arrow keys drive the robot by hand; ? lists all keys")
        if not lasting:
            typer.echo("the practice has no time limit: Ctrl-C ends it, and --for 60 would end it after 60 s")
        play_match(str(file), PlayOptions(**vars(options)), server, base=Path.cwd())


def match_text(
    map_: str, robots: int, model: str, strategy: str | None, seconds: float, at: tuple[float, float, float] | None
) -> str:
    """The match file of a practice.

    Args:
        map_: a map's name or path. strategy: of every robot; None for one that waits.
        seconds: how long, s; 0 = endless.
        at: where the first one begins, m and degrees; None for the middle of the map.

    Raises:
        ConfigError: there is no such map or model, or no room.
    """
    from vrg.hal.models import robot_model
    from vrg.hal.sim.map import load_map

    ground = load_map(_whole(map_))
    x_min, y_min, x_max, y_max = ground.bounds.bounds
    body = robot_model(model)
    middle = ((x_min + x_max) / 2, (y_min + y_max) / 2, 0.0)
    places = []
    for pose in _around(*(at or middle), (x_min, y_min, x_max, y_max)):
        if ground.footprint_clear(pose, body.length, body.width):
            places.append(pose)
        elif at is not None and not places:
            raise ConfigError(f"--pose: expected a place on map {ground.name!r} that is free of walls, got {at}")
        if len(places) == robots:
            break
    if len(places) < robots:
        raise ConfigError(f"--robots: map {ground.name!r} has room for {len(places)}, got {robots}")
    players = [
        {
            **{"name": f"robot{number}", "role": "player", "model": model},
            **{"x": round(pose.x, 3), "y": round(pose.y, 3), "heading": round(math.degrees(pose.theta), 1)},
            **({} if strategy is None else {"strategy": strategy}),
        }
        for number, pose in enumerate(places, 1)
    ]
    rules = {"x": [x_min, x_max], "y": [y_min, y_max], "time": seconds}
    return tomlkit.dumps(
        {"name": "practice", "game": "practice", "map": _whole(map_), "rules": rules, "players": players}
    )


def _around(x: float, y: float, heading: float, bounds: tuple[float, float, float, float]) -> Iterator[Pose]:
    """A place, and those around it in squares that grow to the bounds."""
    theta = math.radians(math.remainder(heading, 360.0))
    yield Pose(x, y, theta)
    for ring in range(1, int(max(bounds[2] - bounds[0], bounds[3] - bounds[1]) / _STEP) + 1):
        for i in range(-ring, ring + 1):
            for j in range(-ring, ring + 1):
                if max(abs(i), abs(j)) == ring:
                    yield Pose(x + i * _STEP, y + j * _STEP, theta)


def _whole(map_: str) -> str:
    return str(Path(map_).resolve()) if map_.endswith(".toml") else map_
