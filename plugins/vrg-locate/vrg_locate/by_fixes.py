"""`vrg can calibrate --fixes`: a robot drives a figure, and its numbers follow from what sources of fixes have seen."""

from pathlib import Path

import typer

from vrg.commands.groups import PlayOptions
from vrg.commands.playing import play_match
from vrg.config.loading import read_match
from vrg.errors import ConfigError, LaunchError
from vrg.launch.fork_server import fork_server
from vrg_locate.figure import NAME, figure_match
from vrg_locate.fitting.report import doubt_of
from vrg_locate.report_command import print_findings, write_calibration
from vrg_locate.robots import as_driven, calibration_of, findings_of, read_learned

LEAST_WAY = 0.6
"""The shortest way straight ahead, m: the circles of the figure need it."""


def by_fixes(
    player: str, match: Path, where: Path, *, speed: float, way: float, seconds: float, in_process: bool
) -> None:
    """Let a robot drive the figure, and write the calibration that follows from what it did.

    Args:
        player: its name. match: the match file. where: the file to write.
        speed: the highest speed, m/s. way: how far straight ahead, m. seconds: how long it drives, s.

    Raises:
        ConfigError: the match file has no source of fixes, or other problems.
    """
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
