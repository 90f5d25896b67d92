"""The command `vrg run report`: what a match has shown of the robots that the fusion centre located."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from rich.markup import escape

from vrg.commands.matches import ended_run
from vrg.commands.options import JsonOption, RunArgument, make_console, print_table, write_text
from vrg.errors import ConfigError, FileError, LaunchError
from vrg.files import read_json

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup, PlayerSetup
    from vrg.fitting.report import Findings
    from vrg.hal.can.base import WheelAxis
    from vrg.hal.can.calibration import Calibration
    from vrg.hal.models import RobotModel
    from vrg.runs.run_folder import RunFolder

GOOD_FIXES: Final = 0.95
"""The share of fixes that must be used for a calibration."""
LIKE: Final = 0.04
"""The distance in m to its simulation, with all that was found, above which a robot was disturbed."""
_PLAUSIBLE: Final = {"way": (0.2, 0.02), "turn": (0.25, 0.03), "bend": (0.3, 0.05)}
"""The most that odometry can be off before something else is wrong, and half the interval that it may have, as shares,
or rad/m."""
_ROWS: Final = {
    "delay": ("delay, s", 1.0),
    "acceleration": ("acceleration, m/s^2", 1.0),
    "braking": ("braking, m/s^2", 1.0),
    "friction": ("friction, m/s^2", 1.0),
    "top": ("top speed, m/s", 1.0),
    "way": ("ways longer by, %", 100.0),
    "turn": ("turns longer by, %", 100.0),
    "bend": ("bend, degrees/m", math.degrees(1.0)),
}
"""The name of each number in the report, and the factor to its unit there."""


def report(
    run: RunArgument = None,
    player: Annotated[str, typer.Option("--calibrate", help="A player whose robot's calibration is written.")] = "",
    output: Annotated[Path | None, typer.Option(help="Its file; without it, NAME.cal.toml.")] = None,
    fitted: Annotated[
        Path | None, typer.Option(help="A match file to write: the match, with robots that move as these did.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare robots with their simulation, find the numbers that explain the difference, and write them to files.

    Of each robot with `localisation = "fusion"` it prints how it follows commands, what its odometry is off by, and how
    far from it the simulated robot ends up that is given the same commands.
    """
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
        _write_match(folder, setup, found, fitted)


def read_learned(folder: "RunFolder") -> dict[str, Any]:
    """The counts of the fusion centre of a run, and what it has learned; see `FusionCentre.counted`.

    Raises:
        LaunchError: the run had none.
    """
    file = folder.logs / "fusion.json"
    if not file.is_file():
        raise LaunchError(f'{folder.path}: expected {file.name} in logs: no player has `localisation = "fusion"`')
    try:
        told: dict[str, Any] = read_json(file)
    except (OSError, FileError) as error:
        raise LaunchError(f"{file}: cannot be read: {error}") from None
    return told


def findings_of(
    folder: "RunFolder", setup: "MatchSetup", learned: dict[str, dict[str, tuple[float, float]]]
) -> dict[str, "Findings"]:
    """The findings of a run about each robot, by name.

    Args:
        learned: what the fusion centre has learned of the odometry of each.
    """
    from vrg.fitting.report import findings
    from vrg.recording.reader import Drive, drives_of
    from vrg.recording.recorded import read_recorded

    recordings = folder.recordings()
    drives = drives_of(read_recorded(recordings)) if recordings else {}
    found: dict[str, Findings] = {}
    for name, errors in learned.items():
        drive = drives.get(name, Drive())
        _, model = as_driven(setup, setup.player(name), folder)
        found[name] = findings(model, drive.commands, drive.motions, drive.poses, errors)
    return found


def calibration_of(setup: "MatchSetup", name: str, found: "Findings", run: "RunFolder") -> "Calibration":
    """The calibration of a robot on a CAN bus, by what was found of it.

    Raises:
        ConfigError: it has no such drives.
    """
    from vrg.fitting.calibration import fitted

    entry = setup.player(name)
    if entry.backend != "can":
        raise ConfigError(
            f'--calibrate: expected a robot with `backend = "can"`, got {name}, which has {entry.backend!r}'
        )
    wheels, model = as_driven(setup, entry, run)
    errors = {what: mean for what, (mean, _) in found.errors.items()}
    return fitted(name, wheels, model.drivetrain, **errors, motion=found.motion(model))


def write_calibration(found: "Calibration", where: Path) -> None:
    """Write a calibration to its file, and print how it is used."""
    from vrg.hal.can.calibration import calibration_text

    write_text(where, calibration_text(found))
    line = f'calibration = "{where.name}"'
    make_console(stderr=True).print(
        f"Written to {escape(str(where))}. To use it, write `{escape(line)}` below "
        rf"\[backends.can.robots.{escape(found.robot)}] of the match file.", soft_wrap=True,
    )  # fmt: skip


def as_driven(setup: "MatchSetup", entry: "PlayerSetup", run: "RunFolder") -> tuple[list["WheelAxis"], "RobotModel"]:
    """The motors of a robot, and its model with the track by which its odometry was worked out; no motors without CAN.

    Raises:
        ConfigError: its calibration cannot be read.
    """
    model = entry.robot
    if entry.backend != "can":
        return [], model
    from vrg.hal.can.calibration import load_calibration
    from vrg.hal.can.settings import can_settings

    wiring, before = can_settings(setup.backends.get("can", {})).robots[entry.name], None
    if wiring.calibration:
        # The file of the match may be another one by now; its copy in the run is not.
        kept = run.path / wiring.calibration
        before = load_calibration(kept if kept.is_file() else Path(setup.base) / wiring.calibration, wiring.nodes)
        model = before.applied(model)
    return wiring.wheel_axes(model.drivetrain.axes, before), model


def doubt_of(found: "Findings", fates: dict[str, int]) -> str | None:
    """The reason why what was found of a robot is no calibration of it, in words; None if there is none.

    Args:
        fates: what became of its fixes.
    """
    used, whole = _used(fates), sum(fates.values())
    if used < GOOD_FIXES * whole:
        why = "does the source see this robot, is nothing in its way, and are the directions of its motors right?"
        if fates.get("turned"):
            why = (
                "it drives another way than it heads by them: is its tag or its body turned (write `heading`, "
                'or `prints = "apriltag"` for tags of other programs), or are the directions of its motors wrong?'
            )
        return f"{whole - used} of {whole} fixes were refused: {why}"
    if isinstance(found.fitted, str):
        return found.fitted
    if found.likeness is None:
        return "it has hardly moved"
    for name, (most, least) in _PLAUSIBLE.items():
        mean, half = found.errors[name]
        if abs(mean) > most or half > least:
            words, unit = _ROWS[name]
            return (
                f"{words} {unit * mean:.3g} +- {unit * half:.2g}, expected at most {unit * most:.3g} "
                f"+- {unit * least:.2g}: are `ratio`, wheels, and directions of motors right, and has it driven enough?"
            )
    if found.likeness.after > LIKE:
        return (
            f"with all that was found it is still {100 * found.likeness.after:.1f} cm away from where it should be: "
            "was it disturbed, or is this computer too slow?"
        )
    return None


def _used(fates: dict[str, int]) -> int:
    return fates.get("used", 0) + fates.get("moved", 0)


def print_findings(name: str, found: "Findings", fates: dict[str, int], model: "RobotModel") -> None:
    """Print what was found of a robot.

    Args:
        found: that. fates: what became of its fixes. model: of the robot in the match.
    """
    from vrg.fitting.likeness import SPAN
    from vrg.fitting.response import Response

    console, used = make_console(), _used(fates)
    console.print(f"{escape(name)}: {used} fixes used, {sum(fates.values()) - used} refused", soft_wrap=True)
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
        words, unit = _ROWS[number]
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


def _write_match(folder: "RunFolder", setup: "MatchSetup", found: dict[str, "Findings"], where: Path) -> None:
    from vrg.config.loading import load_match
    from vrg.toml_text import with_value

    if where.exists():
        raise ConfigError(f"--fitted: expected a file that is not there yet, got {where}")
    if where.resolve().parent != Path(setup.base).resolve():
        raise ConfigError(f"--fitted: expected a file in {setup.base}, as the match names files there, got {where}")
    match = load_match(Path(setup.origin), base=Path(setup.base), engine=setup.engine)
    text = match.text
    for player in setup.players:
        if (one := found.get(player.name)) is not None and (new := one.motion(player.robot)):
            motion = {**player.motion, **new}
            text = with_value(text, ("players", match.player(player.name).number, "motion"), motion)
    write_text(where, text)
    make_console(stderr=True).print(
        f"Written to {escape(str(where))}: in it these robots move as they did, also where `backend` is sim.",
        soft_wrap=True,
    )
