"""How the rule book of a match is made from its set-up."""

from collections.abc import Callable
from typing import Any

from vrg.config.setup import RULES, MatchSetup
from vrg.coordinator.rulebook import Contestant, RuleBook
from vrg.games import GAMES


def rulebook_of(setup: MatchSetup) -> RuleBook[Any]:
    """Make the rule book of a match.

    Raises:
        ConfigError: the rules cannot be played with this set-up.
    """
    game = GAMES.get(setup.game)
    settings = game.load_settings().model_validate(setup.rules)
    contestants = [
        Contestant(name=p.name, role=p.role, start=p.pose, size=p.robot.size, v_max=p.robot.v_max)
        for p in setup.players
    ]
    make: Callable[..., RuleBook[Any]] = game.load_rules()
    return make(settings, contestants, setup.draw(RULES))
