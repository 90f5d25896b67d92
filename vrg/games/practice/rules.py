"""The rules of practice: there are none. All robots may always move, until the time is up or a person ends it."""

from collections.abc import Sequence

from pydantic import Field as Setting
from pydantic import model_validator

from vrg.bus.messages import OfficialAction, Zone
from vrg.coordinator.rulebook import NOBODY, Contestant, GameState, Observation, RuleBook, Verdict
from vrg.errors import ConfigError
from vrg.games.practice import GAME, TEAM
from vrg.regions import Rectangle
from vrg.tables import Table
from vrg.types import Pose


class Settings(Table):
    """The [rules] table of a match file. Lengths in m, times in s.

    Args:
        x, y: the (low, high) borders of a field that players receive; without them there is none.
        time: how long it lasts; 0 means until a person ends it.
    """

    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None
    time: float = Setting(0.0, ge=0.0)

    @model_validator(mode="after")
    def _field_is_whole(self) -> "Settings":
        if (self.x is None) != (self.y is None):
            raise ValueError("x, y: expected both or neither")
        for name, borders in (("x", self.x), ("y", self.y)):
            if borders is not None and not borders[0] < borders[1]:
                raise ValueError(f"{name}: expected the low border first, got {list(borders)}")
        return self


class Practice(RuleBook[GameState]):
    """The rule book of practice.

    Args:
        settings: the [rules] table of the match file.
        contestants: the players.
        seed: the seed of the match, which changes nothing here.
    """

    name = GAME.name
    round_word = GAME.round_word
    state_type = GameState
    lineup_limit = 1.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int = 0) -> None:
        super().__init__(contestants)
        self._settings = settings

    def initial(self) -> GameState:
        """The only state that there is."""
        return GameState()

    def obstacles_to_start(self, state: GameState, now: Observation) -> dict[str, str]:
        """The players that the world has not reported yet."""
        return {name: "is not in the world" for name in self.contestants if name not in now.poses}

    def marks(self, state: GameState) -> dict[str, Pose]:
        """No player lines up."""
        return {}

    def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        """Judge nothing but the time."""
        return Verdict(state, round_over=0.0 < self._settings.time <= clock)

    def next_round(self, state: GameState, now: Observation) -> Verdict[GameState]:
        """The time is up, without a winner."""
        return Verdict(state, winner=NOBODY)

    def team_of(self, name: str) -> str:
        """The only team."""
        return TEAM

    def zones(self, state: GameState) -> list[Zone]:
        """The field, if there is one."""
        x, y = self._settings.x, self._settings.y
        if x is None or y is None:
            return []
        return [Zone(name="field", kind="field", region=Rectangle(x[0], y[0], x[1], y[1]))]

    def overrule(self, state: GameState, action: OfficialAction, subject: str, value: str) -> GameState:
        """Refuse: there is nothing to overrule.

        Raises:
            ConfigError: always.
        """
        raise ConfigError(f"{action}: {self.name} has no scores, roles or states")
