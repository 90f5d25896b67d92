"""The choices for a match. The names come from the registries, so other packages' are among them."""

from collections.abc import Mapping
from dataclasses import dataclass

from vrg.games import GAMES, game_of, strategies_of
from vrg.hal.backends import BACKENDS
from vrg.hal.models import MODELS
from vrg.hal.sim.engines import ENGINES
from vrg.hal.sim.maps import MAPS
from vrg_edit.draft import Draft


@dataclass(frozen=True)
class Choices:
    """The names that fields may have.

    Args:
        maps: the paths of map files in the folder of the draft, besides the maps that are installed.
        strategies: the strategies in Python files of that folder, as `file.py:Class`.
    """

    maps: tuple[str, ...] = ()
    strategies: tuple[str, ...] = ()

    def of(self, draft: Draft, field: str) -> tuple[str, ...]:
        """Return the choices for a field of a draft; none where anything can be typed. "" stands for the default."""
        known: Mapping[str, tuple[str, ...]] = {
            "game": tuple(GAMES.names()),
            "map": (*MAPS.names(), *self.maps),
            "engine": tuple(ENGINES.names()),
            "role": game_of(draft.game).start_roles,
            "model": tuple(MODELS.names()),
            "backend": tuple(BACKENDS.names()),
            "noise": ("true", "false"),
            "lasers": ("true", "false"),
            "on_fault": ("disqualify", "halt"),
        }
        if field == "strategy":
            used = tuple(entry.strategy for entry in draft.players)
            return tuple(dict.fromkeys(("", *strategies_of(draft.game), *self.strategies, *used)))
        return known.get(field, ())
