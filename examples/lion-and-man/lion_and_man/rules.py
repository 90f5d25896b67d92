"""The settings and the rules: the lion wins by catching the man, and the man by not being caught in time."""

from collections.abc import Sequence

from pydantic import Field as Setting
from pydantic import model_validator

from lion_and_man import GAME, LION, MAN
from vrg.bus.messages import Zone
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict
from vrg.errors import ConfigError, Problem
from vrg.geometry import interpolate
from vrg.regions import Circle, Polygon
from vrg.segments import in_disc
from vrg.tables import Table

OTHER = {LION: MAN, MAN: LION}


class Settings(Table):
    """The [rules] table of a match file. The arena is a disc about `centre`, or a convex polygon.

    Args:
        radius: of the disc, m. centre: of the disc, m.
        corners: (x, y) of the polygon, counter-clockwise, m. Without them the arena is the disc.
        capture_distance: the man is caught when the two centres are closer than this, m.
        time: how long the man must last, s.
    """

    radius: float = Setting(6.0, gt=0, le=1e4)
    centre: tuple[float, float] = (0.0, 0.0)
    corners: tuple[tuple[float, float], ...] | None = None
    capture_distance: float = Setting(1.0, gt=0, le=100)
    time: float = Setting(120.0, gt=0, le=1e6)

    @model_validator(mode="after")
    def _arena_is_convex(self) -> "Settings":
        self.arena  # noqa: B018 - it raises ValueError if the corners are none of a convex polygon
        return self

    @property
    def arena(self) -> Circle | Polygon:
        """Where both must stay."""
        return Circle(*self.centre, self.radius) if self.corners is None else Polygon(self.corners)


class LionAndMan(RuleBook[GameState]):
    """The rule book. Who has won has a point."""

    name = GAME.name
    round_word = GAME.round_word
    state_type = GameState
    lineup_limit = 30.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        super().__init__(contestants)
        self.settings = settings
        self.players = {c.role: c for c in contestants}
        if sorted(c.role for c in contestants) != [LION, MAN]:
            raise ConfigError([Problem("expected one lion and one man", ("players",))])
        outside = [c.name for c in contestants if not settings.arena.contains(c.start.x, c.start.y)]
        if outside:
            raise ConfigError([Problem("starts outside the arena", ("players", name)) for name in outside])

    def initial(self) -> GameState:
        """Nobody has won."""
        return GameState()

    def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        """One of them is disqualified, the man is caught, somebody leaves the arena, or the time is up."""
        for role, player in self.players.items():
            if player.name in state.disqualified:
                text = f"{player.name} is disqualified, which ends the chase"
                return self._won(OTHER[role], Call(rule="forfeit", text=text, players=(player.name,)), state)
        if all(player.name in now.poses for player in self.players.values()):
            verdict = self._chase(state, before, now)
            if verdict is not None:
                return verdict
        if clock >= self.settings.time:
            return self._won(MAN, Call(rule="time_up", text=f"{self.players[MAN].name} was not caught in time"), state)
        return Verdict(state)

    def _chase(self, state: GameState, before: Observation, now: Observation) -> Verdict[GameState] | None:
        """What comes first between two looks: the man is caught, or somebody leaves the arena; None if neither."""
        lion, man = self.players[LION].name, self.players[MAN].name
        ways = {role: (before.poses.get(c.name, now.poses[c.name]), now.poses[c.name]) for role, c in
                self.players.items()}  # fmt: skip
        start, end = ((ways[MAN][i].x - ways[LION][i].x, ways[MAN][i].y - ways[LION][i].y) for i in (0, 1))
        meets = in_disc(start, end, (0.0, 0.0), self.settings.capture_distance)
        leaves = {role: self.settings.arena.exit_fraction((a.x, a.y), (b.x, b.y)) for role, (a, b) in ways.items()}
        out = {role: at for role, at in leaves.items() if at is not None}
        first_out = min(out, key=lambda role: out[role], default=None)
        if meets is not None and (first_out is None or meets[0] <= out[first_out]):
            poses = tuple(interpolate(*ways[role], meets[0]) for role in (MAN, LION))
            return self._won(
                LION, Call(rule="caught", text=f"{man} is caught", players=(man, lion), poses=poses), state
            )
        if first_out is None:
            return None
        name = self.players[first_out].name
        pose = interpolate(*ways[first_out], out[first_out])
        call = Call(rule="out", text=f"{name} leaves the arena", players=(name,), poses=(pose,))
        return self._won(OTHER[first_out], call, state)

    @staticmethod
    def _won(role: str, call: Call, state: GameState) -> Verdict[GameState]:
        return Verdict(state.with_points(role, state.points.get(role, 0) + 1), [call], round_over=True)

    def time_limit(self, state: GameState) -> float:
        """The time that the man must last, s."""
        return self.settings.time

    def zones(self, state: GameState) -> list[Zone]:
        """The arena."""
        return [Zone(name="arena", kind="field", region=self.settings.arena)]

    def speed_limits(self) -> dict[str, float]:
        """Both are as fast as the slower one."""
        slower = min(c.v_max for c in self.players.values())
        return {c.name: slower for c in self.players.values()}
