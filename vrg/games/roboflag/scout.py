"""The strategy of an aerial scout of RoboFlag: its team sees with it, so it flies to where its team needs to see."""

from collections.abc import Sequence

from vrg.agents.flying import above, patrol
from vrg.agents.strategy import Action, Strategy, View
from vrg.games.roboflag.situation import Known, Memory, TeamField, situation_of
from vrg.hal.models import RobotModel
from vrg.types import STILL


class Scout(Strategy):
    """Stays above its team's carrier, or else the opponent with its team's flag, or else the team mate that is farthest
    on the opponents' half, so that this one sees who may tag it. If there is none, it flies round the middle."""

    games = ("roboflag",)
    mode = "Scout/Patrol"

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._memory = Memory()

    def act(self, view: View) -> Action:
        """Fly to where the team needs to see."""
        ground = TeamField.of(view)
        if ground is None or not view.me.may_move:
            return Action(STILL)
        if view.me.mark is not None:
            self.mode = "Scout/LineUp"
            return Action(above(view, (view.me.mark.x, view.me.mark.y)))
        s = situation_of(view, ground, self._memory, {})
        ahead = [mate for mate in s.mates if ground.beyond(mate.place[0]) > 0.0]
        farthest = max(ahead, key=lambda mate: ground.beyond(mate.place[0]), default=None)
        followed = _named(s.mates, s.carrier) or _named(s.opponents, s.thief) or farthest
        self.mode = "Scout/Patrol" if followed is None else "Scout/Follow"
        return Action(above(view, patrol(view, ground.field) if followed is None else followed.place))


def _named(known: Sequence[Known], name: str | None) -> Known | None:
    return next((one for one in known if one.name == name), None)
