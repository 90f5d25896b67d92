"""The strategy of a robot that only its display drives."""

from typing import Any

from vrg.agents.charon import Agent
from vrg.games.hud.helm import helm
from vrg.games.practice.player import Waiting


class Passenger(Waiting):
    """Stands until a person drives at the display, and whenever no person does."""

    @staticmethod
    def agent() -> Agent[Any, Any]:
        """The automaton by which the display drives, for `vrg show diagram`."""
        return helm()
