"""The strategy of a player."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from vrg.agents.importing import import_object
from vrg.agents.strategy import Strategy
from vrg.blame import failure_of
from vrg.config.setup import MatchSetup, team_seed
from vrg.errors import ConfigError
from vrg.games import STRATEGIES, STRATEGY_FILES, is_strategy_file, unreadable
from vrg.hal.models import RobotModel
from vrg.modules import no_method

T = TypeVar("T")


def strategy_class(target: str, base: Path) -> type[Strategy]:
    """The class of a strategy: `module:Class`, `file.py:Class`, `policy.npz`, or the name of a registered one.

    Raises:
        ConfigError: there is none, it cannot be imported or read, or it is no strategy.
    """
    kind: object
    if is_strategy_file(target):
        if why := unreadable(target):
            raise ConfigError(why)
        kind = STRATEGY_FILES.get(Path(target).suffix[1:])(base / target)
    else:
        kind = import_object(target, base) if ":" in target else STRATEGIES.get(target)
    if not (isinstance(kind, type) and issubclass(kind, Strategy)):
        raise ConfigError(f"{target}: expected a subclass of vrg.agents.Strategy, got {kind!r}")
    if lacking := sorted(kind.__abstractmethods__):
        raise ConfigError(no_method(target, lacking[0], vars(kind)))
    return kind


def strategy_of(setup: MatchSetup, name: str) -> Strategy:
    """Import and make the strategy of a player.

    Raises:
        ConfigError: there is no such player, or its strategy cannot be imported or made, is no Strategy, or is one for
            other games.
    """
    player = setup.player(name)
    kind = strategy_class(player.strategy, Path(setup.base))
    if kind.games and setup.game not in kind.games:
        able = ", ".join(kind.games)
        raise ConfigError(f"{player.strategy}: expected a strategy for {setup.game}, got one that plays {able} alone")
    strategy = _made(player.strategy, kind, name, player.robot)
    # numpy's older generators take no more than 32 bits.
    strategy.seed = setup.draw(team_seed(player.team)) % 2**32
    return strategy


def _made(target: str, kind: Callable[[str, RobotModel], T], name: str, robot: RobotModel) -> T:
    """Make the strategy that `target` names, for a player and its robot.

    Raises:
        ConfigError: it cannot be made.
    """
    try:
        return kind(name, robot)
    except (Exception, SystemExit) as error:
        raise ConfigError(f"{target}: cannot be made: {failure_of(error)}") from error
