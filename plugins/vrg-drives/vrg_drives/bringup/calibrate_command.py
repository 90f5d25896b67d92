"""`vrg can calibrate`: how a robot's wheels really turn, with a person who measures."""

import math
import os
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Final

import typer

from vrg.commands import drives
from vrg.commands.options import GameArgument, OutputOption, PlayerArgument, lasting, write_text
from vrg.errors import ConfigError
from vrg.hal.can.calibration import calibration_text, load_calibration
from vrg.hal.can.settings import CanSettings
from vrg.hal.models import robot_model
from vrg.registry import Registry

CALIBRATIONS: Final[Registry[Callable[..., None]]] = Registry("way to calibrate", "vrg.calibrations", {})
"""The ways of other packages to calibrate a robot with motors on a CAN bus without a tape measure, with the parameters
of `calibrate`: its player, the match file, the file to write, speed, way, seconds, in_process."""


def calibrate(
    player: PlayerArgument,
    match: GameArgument,
    output: OutputOption = None,
    speed: Annotated[
        float | None, typer.Option(min=0.02, max=2, help="Highest speed, m/s; 0.2, or 0.5 with --fixes.")
    ] = None,
    way: Annotated[float, typer.Option(min=0.2, max=20, help="How far to drive straight ahead, m.")] = 1.5,
    turns: Annotated[float, typer.Option(min=0.25, max=20, help="Turns on the spot, with a tape measure.")] = 2.0,
    fixes: Annotated[
        bool, typer.Option("--fixes", help="Measure with the match's sources of fixes, such as a camera.")
    ] = False,
    seconds: Annotated[float, lasting("How long the robot drives with --fixes.", 30)] = 90.0,
    in_process: Annotated[
        bool, typer.Option("--in-process", help="With --fixes and emulated drives: run faster, in simulated time.")
    ] = False,
) -> None:
    """Find a robot's directions, gear ratios and track, with a tape measure; write its calibration file.

    With --fixes the robot drives a figure, and its ratios, its track, its delay, acceleration, braking and top speed
    follow from what the match's sources of fixes have seen; its directions must be right already.

    The file is the one that the match file names, unless --output names another.
    """
    from vrg.config.loading import match_path, read_match  # the other tools need no match file
    from vrg.hal.can.train import DriveTrain
    from vrg_drives.bringup import calibrating  # python-can is for who uses a bus

    # What the robot has been calibrated to so far, its file included, may be missing or wrong: that is to be fixed.
    file, base = read_match(match_path(match)), match_path(match).resolve().parent
    settings = CanSettings.read("can", file.backends.get("can", {}))
    if player not in settings.robots:
        known = ", ".join(settings.robots) or "none"
        raise ConfigError(f"{match}: expected a robot of [backends.can.robots] ({known}), got {player!r}")
    wiring = settings.robots[player]
    own = base / (wiring.calibration or f"{player}.cal.toml")
    where = output or own
    if not os.access(where.parent, os.W_OK) or where.is_dir():
        raise ConfigError(f"{where}: expected a place to write the calibration to, this is none")
    if fixes:
        by_fixes = CALIBRATIONS.get("fixes")
        by_fixes(player, match_path(match), where, speed=speed or 0.5, way=way, seconds=seconds, in_process=in_process)
        return
    before = load_calibration(own, wiring.nodes) if wiring.calibration and own.exists() else None
    model = robot_model(next((p.model for p in file.players if p.name == player), "P2AT"))
    # Drives that were replaced since are those that the new calibration is of.
    axes = [replace(axis, serial="") for axis in wiring.wheel_axes(model.drivetrain.axes, before)]
    unwatched = wiring.watchdog == "unsafe"
    link, spoken, own_options = settings.link(player), settings.protocol_of(player), settings.options_of(player)
    train = DriveTrain(player, drives.medium(), link, spoken, axes, model, options=own_options, unwatched=unwatched)
    plan = calibrating.Plan(speed=speed or 0.2, way=way, turn=turns * 2 * math.pi)
    typer.echo(f"Calibrating {player} ({model.name}) on {settings.link(player)}. Keep a hand at the power switch.")
    if (emulation := settings.emulation) is not None:
        (emulated,) = emulation.companions([player])
        typer.echo(f"(Its drives are emulated: `vrg {' '.join(emulated.arguments)}` must run.)")
    train.connect()
    try:
        found = calibrating.calibrate(train, model, _Asker(), plan)
    except ValueError as error:
        raise ConfigError(f"{player}: an impossible measurement: {error}") from None
    finally:
        train.close()
    write_text(where, calibration_text(found))
    typer.echo(f"Written to {where}.")
    if wiring.calibration is None or own != where:
        typer.echo(f'To use it, write `calibration = "{where.name}"` below [backends.can.robots.{player}] of {match}.')


class _Asker:
    """Asks the person who sits at the terminal."""

    def ready(self, words: str) -> None:
        """Say what is to be done, and wait for Enter."""
        typer.prompt(f"{words} Then press Enter", default="", show_default=False)

    def agrees(self, question: str) -> bool:
        """Ask a question that is answered by yes or no. Enter alone is no answer: a direction must not be guessed."""
        return typer.confirm(question, default=None)

    def measures(self, question: str, expected: float) -> float:
        """Ask for a number."""
        answer: float = typer.prompt(question, type=float, default=round(expected, 3))
        return answer

    def shows(self, words: str) -> None:
        """Print something."""
        typer.echo(words)
