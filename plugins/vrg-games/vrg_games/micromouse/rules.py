"""The settings and the rules: runs from the start cell to the middle, by the way of the mouse's centre."""

from collections.abc import Iterator, Sequence

from msgspec import structs
from pydantic import Field as Setting

from vrg.bus.messages import Zone
from vrg.coordinator.rulebook import NOBODY, Call, Contestant, GameState, Observation, RuleBook, Verdict, called
from vrg.errors import ConfigError, Problem
from vrg.geometry import interpolate
from vrg.regions import Rectangle
from vrg.tables import Table
from vrg.types import Pose
from vrg_games.micromouse import GAME, MOUSE
from vrg_games.micromouse.maze import CELL, START, WALL, goal_cells

SEARCH_SHARE = 30
"""A score has this part of the time of play before the run (APEC)."""


class Settings(Table):
    """The [rules] table of a match file. The maze itself is the map of the match.

    Args:
        size: the number of cells along a side of the maze, an even number.
        time: how long the mouse may search and run, s.
    """

    size: int = Setting(16, ge=4, le=32, multiple_of=2)
    time: float = Setting(600.0, gt=0, le=3600)


class State(GameState, frozen=True, kw_only=True):
    """The state of the game.

    Args:
        runs: how many runs have begun. begun: the time of play at which this run began, s; None if none is under way.
    """

    runs: int = 0
    begun: float | None = None


class Micromouse(RuleBook[State]):
    """The rule book. Points are whole numbers, and more of them are better: they are the hundredths of a second by
    which the best score is below the time.
    """

    name = GAME.name
    round_word = GAME.round_word
    state_type = State
    lineup_limit = 10.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        super().__init__(contestants)
        self.settings = settings
        self.maze = Rectangle(0.0, 0.0, settings.size * CELL, settings.size * CELL)
        goals = goal_cells(settings.size)
        self.start, self.goal = _cells(START, START), _cells(goals[0], goals[-1])
        if len(contestants) != 1:
            raise ConfigError([Problem("expected one mouse", ("players",))])
        [self.mouse] = contestants
        if not self.start.contains(self.mouse.start.x, self.mouse.start.y):
            where = "starts outside the start cell, which is x and y from 0 to 0.18 m"
            raise ConfigError([Problem(where, ("players", self.mouse.name))])

    def initial(self) -> State:
        """No run has begun."""
        return State()

    def judge(self, state: State, before: Observation, now: Observation, clock: float) -> Verdict[State]:
        """The mouse leaves or enters the start cell, enters the middle, or the time is up."""
        name, calls = self.mouse.name, list[Call]()
        if name in state.disqualified:
            forfeit = Call(rule="forfeit", text=f"{name} is disqualified", players=(name,))
            return Verdict(state, [forfeit], round_over=True)
        if name in now.poses:
            way = now.way(name, before)
            for fraction, rule in sorted(self._crossings(*way)):
                at = max(0.0, clock - (now.time - before.time) * (1.0 - fraction))
                if at <= self.settings.time:
                    state, text = self._crossed(state, rule, at)
                    calls += [called(rule, text, {name: interpolate(*way, fraction)})] if text else []
        if clock < self.settings.time:
            return Verdict(state, calls)
        return Verdict(state, [*calls, Call(rule="time_up", text="the time is up")], round_over=True)

    def _crossings(self, before: Pose, now: Pose) -> Iterator[tuple[float, str]]:
        """Where between two looks the mouse enters the middle, and enters and leaves the start cell, as fractions."""
        start, end = (before.x, before.y), (now.x, now.y)
        for region, enters, leaves in ((self.goal, "goal", ""), (self.start, "home", "run")):
            inside = region.inside(start, end)
            if inside is not None and not region.contains(*start):
                yield inside[0], enters
            if inside is not None and not region.contains(*end) and leaves:
                yield inside[1], leaves

    def _crossed(self, state: State, rule: str, at: float) -> tuple[State, str]:
        """What follows from crossing a border at a time of play, s: the state, and the text of a call if it is one."""
        if rule == "run":
            state = structs.replace(state, runs=state.runs + 1, begun=at, numbers={**state.numbers, "run": at})
            return state, f"run {state.runs} begins after {at:.2f} s"
        if state.begun is None:
            return state, ""
        numbers = {name: number for name, number in state.numbers.items() if name != "run"}
        run, score = at - state.begun, at - state.begun + state.begun / SEARCH_SHARE
        if rule == "home":
            return structs.replace(state, begun=None, numbers=numbers), f"run {state.runs} ends where it began"
        numbers["best"] = min(score, numbers.get("best", score))
        points = max(state.points.get(MOUSE, 0), round(100 * (self.settings.time - score)))
        ended = structs.replace(state, begun=None, numbers=numbers).with_points(MOUSE, points)
        return ended, f"run {state.runs}: {run:.2f} s, score {score:.2f} s"

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        """The mouse has won if a run of it is complete."""
        return Verdict(state, winner=MOUSE if state.points.get(MOUSE) else NOBODY)

    def time_limit(self, state: State) -> float:
        """The time that the mouse has, s."""
        return self.settings.time

    def team_of(self, name: str) -> str:
        """The only team."""
        return MOUSE

    def zones(self, state: State) -> list[Zone]:
        """The maze, and the floor between the walls of its start cell and of its middle."""
        regions = {"field": self.maze, "start": self.start.shrunk(0.51 * WALL), "goal": self.goal.shrunk(0.51 * WALL)}
        return [Zone(name=kind, kind=kind, region=region) for kind, region in regions.items()]


def _cells(first: tuple[int, int], last: tuple[int, int]) -> Rectangle:
    """The region of the cells from one in the south-west to one in the north-east."""
    return Rectangle(first[0] * CELL, first[1] * CELL, (last[0] + 1) * CELL, (last[1] + 1) * CELL)
