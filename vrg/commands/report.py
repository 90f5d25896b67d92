"""The command `vrg run report`: what a match has shown of the robots that the fusion centre located."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from vrg.commands.matches import ended_run
from vrg.commands.options import JsonOption, RunArgument, make_console, print_table
from vrg.errors import ConfigError, LaunchError

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.hal.can.calibration import Calibration


def report(
    run: RunArgument = None,
    player: Annotated[str, typer.Option("--calibrate", help="A player whose robot's calibration is written.")] = "",
    output: Annotated[Path | None, typer.Option(help="Its file; without it, NAME.cal.toml.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Tell how far the odometry of robots was off in a match, and write a calibration that puts it right.

    The fusion centre learns that of each robot with `localisation = "fusion"`. The numbers have 95 % intervals.
    """
    folder, setup = ended_run(run)
    file = folder.logs / "fusion.json"
    if not file.is_file():
        raise LaunchError(f'{folder.path}: expected {file.name} in logs: no player has `localisation = "fusion"`')
    told = json.loads(file.read_text(encoding="utf-8"))
    if as_json:
        typer.echo(json.dumps(told, indent=2))
    else:
        console = make_console()
        heads = ("robot", "fixes used", "refused", "ways longer by, %", "turns longer by, %", "bend, degrees/m")
        rows = [_row(name, told["fixes"].get(name, {}), learned) for name, learned in told["learned"].items()]
        print_table(console, heads, rows, right=(1, 2, 3, 4, 5))
    if not player:
        return
    if player not in told["learned"]:
        known = ", ".join(told["learned"])
        raise ConfigError(f"--calibrate: expected a robot that was located ({known}), got {player!r}")
    found, where = _calibration(setup, player, told["learned"][player]), output or Path(f"{player}.cal.toml")
    from vrg.hal.can.calibration import calibration_text

    where.write_text(calibration_text(found), encoding="utf-8")
    line = f'calibration = "{where.name}"'
    make_console().print(
        f"Written to {escape(str(where))}. To use it, write `{escape(line)}` below "
        rf"\[backends.can.robots.{escape(player)}] of the match file.", soft_wrap=True,
    )  # fmt: skip


def _row(name: str, fates: dict[str, int], learned: dict[str, tuple[float, float]]) -> tuple[str, ...]:
    used = fates.get("used", 0)
    units = {"way": 100.0, "turn": 100.0, "bend": math.degrees(1.0)}
    numbers = [
        f"{unit * learned[what][0]:+.2f} +- {unit * 1.96 * learned[what][1]:.2f}" for what, unit in units.items()
    ]
    return name, str(used), str(sum(fates.values()) - used), *numbers


def _calibration(setup: "MatchSetup", name: str, learned: dict[str, Any]) -> "Calibration":
    """The calibration of a robot on a CAN bus, by what was learned of it.

    Raises:
        ConfigError: it has no such drives.
    """
    from vrg.hal.can.calibration import load_calibration
    from vrg.hal.can.settings import can_settings
    from vrg.hal.can.workshop.fitting import fitted

    entry = setup.player(name)
    if entry.backend != "can":
        raise ConfigError(
            f'--calibrate: expected a robot with `backend = "can"`, got {name}, which has {entry.backend!r}'
        )
    wiring, drivetrain = can_settings(setup.backends.get("can", {})).robots[name], entry.robot.drivetrain
    before = None
    if wiring.calibration:
        before = load_calibration(Path(setup.base) / wiring.calibration, wiring.nodes)
        drivetrain = drivetrain.with_track(before.track)
    errors = {what: mean for what, (mean, _) in learned.items()}
    return fitted(name, wiring.wheel_axes(drivetrain.axes, before), drivetrain, **errors)
