"""The part of `vrg can calibrate` in which a robot drives a figure, and sources of fixes see what it really does."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomlkit
import typer
from msgspec import structs

from vrg.commands.groups import PlayOptions
from vrg.commands.report import (
    as_driven,
    calibration_of,
    doubt_of,
    findings_of,
    print_findings,
    read_learned,
    write_calibration,
)
from vrg.errors import ConfigError, LaunchError
from vrg.hal.location import FUSION
from vrg.launch.fork_server import fork_server

if TYPE_CHECKING:
    from vrg.config.files import Machine, MatchFile

NAME = "calibrate"
"""The name of the match in which a robot drives the figure."""
_PLACED = ("world", "coordinator", "recorder", FUSION)
"""The processes that stay on their machines, besides the sources of fixes."""
LEAST_WAY = 0.6
"""The shortest way straight ahead, m: the circles of the figure need it."""
FIGURE = "vrg.games.practice.figure:Figure"


def calibrate_by_fixes(
    player: str, match: Path, where: Path, *, speed: float, way: float, seconds: float, in_process: bool
) -> None:
    """Let a robot drive the figure, and write the calibration that follows from what it did.

    Args:
        player: its name. match: the match file. where: the file to write.
        speed: the highest speed, m/s. way: how far straight ahead, m. seconds: how long it drives, s.

    Raises:
        ConfigError: the match file has no source of fixes, or other problems.
    """
    from vrg.commands.playing import play_match
    from vrg.config.loading import read_match

    if way < LEAST_WAY:
        raise ConfigError(f"--way: expected at least {LEAST_WAY:g} m for the figure, got {way:g} m")
    read = read_match(match)
    text = figure_match(read, player, speed=speed, way=way, seconds=seconds)
    entry = next(entry for entry in read.players if entry.name == player)
    typer.echo(
        f"{player} is going to drive for {seconds:g} s at up to {speed:g} m/s around ({entry.x:g}, {entry.y:g}), its "
        f"middle up to {way:g} m to all sides. Clear that place. `vrg estop` stops it, `vrg show` shows it."
    )
    file = Path("runs", f"{NAME}-{player}.toml")
    file.parent.mkdir(exist_ok=True)
    file.write_text(text, encoding="utf-8")
    with fork_server(wanted=not in_process) as server:
        options = PlayOptions(in_process=in_process, headless=True)
        played = play_match(str(file), options, server, base=match.resolve().parent)
    assert played is not None, "it was no dry run"
    folder, setup = played
    told = read_learned(folder)
    found, fates = findings_of(folder, setup, told["learned"])[player], told["fixes"].get(player, {})
    print_findings(player, found, fates, as_driven(setup, setup.player(player), folder)[1])
    if (doubt := doubt_of(found, fates)) is not None:
        raise LaunchError(f"{player}: nothing is written: {doubt}; `vrg run report {folder.path}` has more")
    write_calibration(calibration_of(setup, player, found, folder), where)


def figure_match(file: "MatchFile", player: str, *, speed: float, way: float, seconds: float) -> str:
    """The text of the match in which a player's robot drives the figure.

    Args:
        file: the match that the robot is to play. For the others see `calibrate_by_fixes`.

    Raises:
        ConfigError: the match has no such player, or nothing locates it from outside.
    """
    entry = next((entry for entry in file.players if entry.name == player), None)
    if entry is None:
        known = ", ".join(other.name for other in file.players)
        raise ConfigError(f"expected a player of the match ({known}), got {player!r}")
    if entry.localisation != FUSION:
        raise ConfigError(
            f'--fixes: expected `localisation = "fusion"` at {player}, and a source of fixes: see docs/localisation.md'
        )
    everybody = {other.name for other in file.players}
    own: dict[str, Any] = {
        "name": player,
        "role": "player",
        "model": entry.model,
        "backend": entry.backend,
        "strategy": FIGURE,
    }
    own |= {"x": entry.x, "y": entry.y, "heading": entry.heading, "localisation": FUSION}
    own |= {"machine": entry.machine, "sensors": entry.sensors}
    own["motion"] = {**entry.motion, "v_max": min(speed, entry.motion.get("v_max", speed))}
    x, y = [entry.x - way, entry.x + way], [entry.y - way, entry.y + way]
    return tomlkit.dumps(
        {
            **{"name": f"{NAME}-{player}", "game": "practice", "map": file.map, "engine": "planar"},
            "rules": {"x": x, "y": y, "time": seconds},
            "backends": file.backends,
            "machines": {name: _plain(machine) for name, machine in file.machines.items()},
            "place": {name: machine for name, machine in file.place.items() if name in {*file.localisation, *_PLACED}},
            "localisation": {name: _of(player, everybody, table) for name, table in file.localisation.items()},
            "players": [own],
        }
    )


def _of(player: str, everybody: set[str], table: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a source, in tables whose keys are players, such as their tags, those for one player alone."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        by_player = isinstance(value, Mapping) and set(value) <= everybody
        found[key] = {name: own for name, own in value.items() if name == player} if by_player else value
    return found


def _plain(machine: "Machine") -> dict[str, Any]:
    """The table of a machine, without what is not given there."""
    return {key: value for key, value in structs.asdict(machine).items() if value is not None}
