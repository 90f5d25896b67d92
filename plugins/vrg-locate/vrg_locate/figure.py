"""The match in which a robot drives a figure, while sources of fixes see what it really does."""

from collections.abc import Mapping
from typing import Any

import tomlkit
from msgspec import structs

from vrg.config.files import Machine, MatchFile
from vrg.errors import ConfigError
from vrg.hal.location import FUSION
from vrg.kinds import COORDINATOR, RECORDER, WORLD

NAME = "calibrate"
"""The name of the match in which a robot drives the figure."""
_PLACED = (WORLD.process, COORDINATOR.process, RECORDER.process, FUSION)
"""The processes that stay on their machines, besides the sources of fixes."""
FIGURE = "vrg.games.practice.figure:Figure"


def figure_match(file: MatchFile, player: str, *, speed: float, way: float, seconds: float) -> str:
    """The text of the match in which a player's robot drives the figure.

    Args:
        file: the match that the robot is to play. player: its name.
        speed: the highest speed, m/s. way: how far straight ahead, m. seconds: how long it drives, s.

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
    everybody = {other.name for other in file.players} | {body.name for body in file.bodies}
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
    """The settings of a source; in tables by players and bodies, such as their tags, those for one player alone."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        by_player = isinstance(value, Mapping) and set(value) <= everybody
        found[key] = {name: own for name, own in value.items() if name == player} if by_player else value
    return found


def _plain(machine: Machine) -> dict[str, Any]:
    """The table of a machine, without what is not given there."""
    return {key: value for key, value in structs.asdict(machine).items() if value is not None}
