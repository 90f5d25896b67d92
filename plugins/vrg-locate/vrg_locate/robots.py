"""The findings of a run about the robots that the fusion centre located, and what follows from them."""

import re
from pathlib import Path
from typing import Any

from vrg.config.setup import MatchSetup, PlayerSetup
from vrg.errors import ConfigError, FileError, LaunchError
from vrg.files import read_json, read_text
from vrg.hal.can.base import WheelAxis
from vrg.hal.can.calibration import Calibration, load_calibration
from vrg.hal.can.settings import CanSettings
from vrg.hal.models import RobotModel
from vrg.recording.recorded import RecordedMatch, read_recorded
from vrg.runs.keeping import FILES
from vrg.runs.run_folder import RunFolder
from vrg.toml_text import quoted, with_value
from vrg_locate.fitting.calibration import fitted
from vrg_locate.fitting.report import Findings, findings


def read_learned(folder: RunFolder) -> dict[str, Any]:
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
    folder: RunFolder, setup: MatchSetup, learned: dict[str, dict[str, tuple[float, float]]]
) -> dict[str, Findings]:
    """The findings of a run about each robot, by name.

    Args:
        learned: what the fusion centre has learned of the odometry of each.
    """
    recordings = folder.recordings()
    seen = read_recorded(recordings) if recordings else RecordedMatch()
    found: dict[str, Findings] = {}
    for name, errors in learned.items():
        _, model = as_driven(setup, setup.player(name), folder)
        motions = [(stamp, motion.odometry, motion.twist) for stamp, motion in seen.motions.get(name, ())]
        poses = [(stamp, measured.pose) for stamp, measured in seen.measured.get(name, ())]
        found[name] = findings(model, seen.commands.get(name, ()), motions, poses, errors)
    return found


def calibration_of(setup: MatchSetup, name: str, found: Findings, run: RunFolder) -> Calibration:
    """The calibration of a robot on a CAN bus, by what was found of it.

    Raises:
        ConfigError: it has no such drives.
    """
    entry = setup.player(name)
    if entry.backend != "can":
        raise ConfigError(
            f'--calibrate: expected a robot with `backend = "can"`, got {name}, which has {entry.backend!r}'
        )
    wheels, model = as_driven(setup, entry, run)
    errors = {what: mean for what, (mean, _) in found.errors.items()}
    return fitted(name, wheels, model.drivetrain, **errors, motion=found.motion(model))


def as_driven(setup: MatchSetup, entry: PlayerSetup, run: RunFolder) -> tuple[list[WheelAxis], RobotModel]:
    """The motors of a robot, and its model with the track by which its odometry was worked out; no motors without CAN.

    Raises:
        ConfigError: its calibration cannot be read.
    """
    model = entry.robot
    if entry.backend != "can":
        return [], model
    wiring, before = CanSettings.read("can", setup.backends.get("can", {})).robots[entry.name], None
    if wiring.calibration:
        # The file of the match may be another one by now; its copy in the run is not.
        kept = run.path / wiring.calibration
        before = load_calibration(kept if kept.is_file() else Path(setup.base) / wiring.calibration, wiring.nodes)
        model = before.applied(model)
    return wiring.wheel_axes(model.drivetrain.axes, before), model


def fitted_match(setup: MatchSetup, found: dict[str, Findings], run: RunFolder) -> str:
    """The text of the match as it was played, with robots that move in simulation as these did, by name.

    It is for a file beside the one that was played. Files from elsewhere it names where their copies are.

    Raises:
        LaunchError: the match file of the run cannot be read.
    """
    try:
        text = read_text(run.match_file)
    except (OSError, FileError) as error:
        raise LaunchError(f"{run.match_file}: cannot be read: {error}") from None
    place = run.path.resolve().as_posix()
    text = re.sub(rf"""(["']){FILES}/[^"'\n]*\1""", lambda found: quoted(f"{place}/{found[0][1:-1]}"), text)
    for player in setup.players:
        if (one := found.get(player.name)) is not None and (new := one.motion(player.robot)):
            text = with_value(text, ("players", player.number, "motion"), {**player.motion, **new})
    return text
