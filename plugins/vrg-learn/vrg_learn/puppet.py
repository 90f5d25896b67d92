"""The strategy of a player that a program drives from outside."""

from msgspec import structs

from vrg.agents.strategy import Action, RemoteStrategy, Strategy, View, decided
from vrg.hal.models import RobotModel
from vrg.types import STILL, Twist

TARGET = f"{__name__}:Puppet"
"""The name of this strategy in a match file, where nobody drives it, so it stands; and in the set-up of a run whose
player a program drove."""


class Puppet(RemoteStrategy):
    """Keeps what its player sees, and answers with the motion that was set.

    Attributes:
        view: what its player saw last; None before it has seen anything.
        twist: the motion to answer with.
        teller: the strategy that decides what the player tells others; None if nothing does.
    """

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self.view: View | None = None
        self.twist: Twist = STILL
        self.teller: Strategy | None = None

    @property
    def mode(self) -> str:
        """The mode, for spectators."""
        return "Learning"

    def send(self, view: View) -> None:
        """Keep the view of which `act` will be called next."""
        self.view = view

    def act(self, view: View) -> Action:
        """The motion that was set, with what the teller tells."""
        if self.teller is None:
            return Action(self.twist)
        return structs.replace(decided(self.teller, view)[0], twist=self.twist)
