"""The command `vrg run report`: what a match has shown of the robots that the fusion centre located."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from vrg.commands.matches import ended_run
from vrg.commands.options import JsonOption, RunArgument, make_console, print_table, write_text
from vrg.errors import ConfigError

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.hal.can.calibration import Calibration
    from vrg.hal.models import RobotModel
    from vrg.runs.run_folder import RunFolder
    from vrg_locate.fitting.report import Findings


def report(
    run: RunArgument = None,
    player: Annotated[str, typer.Option("--calibrate", help="Write the calibration of this player's robot.")] = "",
    output: Annotated[Path | None, typer.Option(help="The calibration file; the default is NAME.cal.toml.")] = None,
    fitted: Annotated[
        Path | None, typer.Option(help="A match file to write: the match, with robots that move as these did.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare robots with their simulation, find the numbers that explain the difference, and write them to files.

    For each robot with `localisation = "fusion"` it prints how the robot follows commands, how far its odometry is off,
    and how far away a simulated robot ends up with the same commands.
    """
    from vrg_locate.robots import as_driven, calibration_of, findings_of, read_learned

    folder, setup = ended_run(run)
    told = read_learned(folder)
    learned: dict[str, dict[str, tuple[float, float]]] = told["learned"]
    if player and player not in learned:
        raise ConfigError(f"--calibrate: expected a robot that was located ({', '.join(learned)}), got {player!r}")
    found = findings_of(folder, setup, learned)
    if as_json:
        robots = {name: _plain(one) for name, one in found.items()}
        typer.echo(json.dumps(told | {"robots": robots}, indent=2))
    else:
        for name, one in found.items():
            print_findings(name, one, told["fixes"].get(name, {}), as_driven(setup, setup.player(name), folder)[1])
    if player:
        write_calibration(calibration_of(setup, player, found[player], folder), output or Path(f"{player}.cal.toml"))
    if fitted is not None:
        _write_match(setup, found, fitted, folder)


def write_calibration(found: "Calibration", where: Path) -> None:
    """Write a calibration to its file, and print how it is used."""
    from vrg.hal.can.calibration import calibration_text

    write_text(where, calibration_text(found))
    line = f'calibration = "{where.name}"'
    make_console(stderr=True).print(
        f"Written to {escape(str(where))}. To use it, write `{escape(line)}` below "
        rf"\[backends.can.robots.{escape(found.robot)}] of the match file.", soft_wrap=True,
    )  # fmt: skip


def print_findings(name: str, found: "Findings", fates: dict[str, int], model: "RobotModel") -> None:
    """Print what was found of a robot.

    Args:
        found: that. fates: what became of its fixes. model: of the robot in the match.
    """
    from vrg_locate.fitting.likeness import SPAN
    from vrg_locate.fitting.report import ROWS, used
    from vrg_locate.fitting.response import Response

    console, taken = make_console(), used(fates)
    console.print(f"{escape(name)}: {taken} fixes used, {sum(fates.values()) - taken} refused", soft_wrap=True)
    if isinstance(found.fitted, str):
        console.print(f"How it follows commands is not known: {escape(found.fitted)}", soft_wrap=True)
    like = found.likeness
    if like is not None:
        console.print(
            f"{like.spans} times, {SPAN:g} s after the same start with the same commands, its simulation is "
            f"{100 * like.before:.1f} cm away from it (rms); with the numbers below, {100 * like.after:.1f} cm.",
            soft_wrap=True,
        )
    plain = asdict(Response.of(model))
    rows = []
    for number, (mean, half) in found.numbers.items():
        words, unit = ROWS[number]
        seen = math.isfinite(half)
        without = None if like is None or not seen else like.without.get(number)
        rows.append(
            (
                words,
                f"{unit * plain.get(number, 0.0):.3g}",
                f"{unit * mean:.3f} +- {unit * half:.3f}" if seen else "not seen",
                "" if without is None else f"{100 * without:.1f} cm",
            )
        )
    print_table(console, ("number", "simulation", "robot, 95 %", "apart if only this stays"), rows, right=(1, 2, 3))


def _plain(found: "Findings") -> dict[str, Any]:
    numbers = {name: [mean, half if math.isfinite(half) else None] for name, (mean, half) in found.numbers.items()}
    return {"numbers": numbers, "likeness": None if found.likeness is None else asdict(found.likeness)}


def _write_match(setup: "MatchSetup", found: dict[str, "Findings"], where: Path, run: "RunFolder") -> None:
    from vrg_locate.robots import fitted_match

    if where.exists():
        raise ConfigError(f"--fitted: expected a file that is not there yet, got {where}")
    if where.resolve().parent != Path(setup.base).resolve():
        raise ConfigError(f"--fitted: expected a file in {setup.base}, as the match names files there, got {where}")
    write_text(where, fitted_match(setup, found, run))
    make_console(stderr=True).print(
        f"Written to {escape(str(where))}: in it these robots move as they did, also where `backend` is sim.",
        soft_wrap=True,
    )
