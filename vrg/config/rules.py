"""Makes the rule book of a match from its set-up."""

from collections.abc import Callable
from typing import Any

from vrg.config.setup import RULES, MatchSetup, PlayerSetup
from vrg.coordinator.rulebook import Contestant, RuleBook
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.hal.sensors.downward import OverviewSpec
from vrg.hal.sensors.spec import Sweep
from vrg.hal.sim.config import place_problems
from vrg.types import Pose


def rulebook_of(setup: MatchSetup) -> RuleBook[Any]:
    """Make the rule book of a match.

    Raises:
        ConfigError: the rules cannot be played with this set-up.
    """
    game = GAMES.get(setup.game)
    try:
        settings = game.load_settings().model_validate(setup.rules)
    except ValueError as error:  # of a match file it was checked, but a set-up may come from anybody
        raise ConfigError(f"expected rules of {setup.game}: {error}") from None
    contestants = [
        Contestant(
            name=p.name,
            role=p.role,
            start=p.pose,
            size=p.robot.size,
            v_max=p.robot.v_max,
            sweeps=_sweeps(setup, p),
            overview=p.robot.sensor(OverviewSpec),
            team=p.team,
        )
        for p in setup.players
    ]
    make: Callable[..., RuleBook[Any]] = game.load_rules()
    book = make(settings, contestants, setup.draw(RULES))
    book.walls = setup.obstacles
    book.equip([body.setup for body in setup.bodies])
    if setup.physical:
        book.no_room = _no_room(setup)
    return book


def _sweeps(setup: MatchSetup, player: PlayerSetup) -> tuple[Sweep, ...]:
    """The sweeps of a player's range finders; those of a virtual robot may be left out of the match."""
    measure = setup.lasers or player.physical
    return tuple(spec.sweep for spec in player.robot.sensors if spec.sweep is not None and measure)


def _no_room(setup: MatchSetup) -> Callable[[str, Pose], str | None]:
    """A function that returns the reason why the map has no room for a player's robot at a pose, or None.

    Raises:
        ConfigError: the map cannot be read.
    """
    from vrg.hal.sim.map import load_map  # noqa: PLC0415 - a match of virtual robots needs no map here

    map_, robots = load_map(setup.map), {player.name: player.robot for player in setup.players}
    return lambda name, pose: place_problems(map_, name, robots[name], pose)
