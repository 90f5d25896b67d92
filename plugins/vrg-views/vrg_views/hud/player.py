"""The strategy of a robot that only its display drives."""

from typing import Any

from vrg.agents.charon import Agent
from vrg.games.practice.player import Waiting
from vrg_views.hud.helm import helm


class Passenger(Waiting):
    """Stands until a person drives at the display, and whenever no person does."""

    @staticmethod
    def agent() -> Agent[Any, Any]:
        """The automaton by which the display drives, for `vrg show diagram`."""
        return helm()
