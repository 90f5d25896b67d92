"""A thousand random games in which the rule book and the slow referee must agree on every call and every state."""

import random
from collections import Counter
from fractions import Fraction
from types import FunctionType

import pytest

from tests.games.mistakes import plant
from tests.games.roboflag.slow_referee import (
    FLAGGED,
    NORMAL,
    TAGGED,
    Ground,
    Place,
    Ruling,
    SlowReferee,
    in_order,
    near,
    squared,
)
from vrg.bus.messages import Official, OfficialAction, Stage
from vrg.coordinator.decisions import decide
from vrg.coordinator.match import Match
from vrg.coordinator.outcome import Effects
from vrg.coordinator.rulebook import Contestant, Observation
from vrg.games.roboflag import judging
from vrg.games.roboflag.rules import RoboFlag
from vrg.games.roboflag.settings import Settings, TeamHalf
from vrg.types import Pose

GAMES, CHUNKS = 1000, 20
TICK = Fraction(1, 4)
SPEEDS = (0.7, 0.7, 2.0, 5.0)
"""The top speeds of players that do not appear somewhere else at once, m/s; one for each game."""
GRID = 1 / 8
"""The raster in m at scale 1 of places where players appear, so that many are exactly at a decisive distance."""
OTHER = {"red": "blue", "blue": "red"}
RARE = {
    "both score at once",
    "two tag each other",
    "tagged by several",
    "tagged exactly at the distance",
    "tagged on the midline",
    "a carrier is tagged",
    "exactly in reach of the flag",
    "saved by a flag zone",
    "met between two looks",
}
EXPECTED = {
    "set-score",
    "set-state",
    "halts",
    "disqualifications",
    "reinstatements",
    "won: red",
    "won: blue",
    "won: draw",
    "next rounds",
} | RARE
"""What happens in every chunk of games, besides every rule."""
JUDGED = {"capture", "home", "flag", "tag", "time", "sudden_death", "flag_returns"}


def ground(rng: random.Random) -> Ground:
    """A field whose numbers are all exact in binary, so that both referees see the same ties."""
    length, width = rng.choice([4.0, 5.0, 6.0, 8.0]), rng.choice([3.0, 4.0, 5.0])
    reach = rng.choice([0.25, 0.3125, 0.5])
    homes = {team: rng.choice(["low", "high"]) for team in ("red", "blue")}
    home, zone = rng.choice([0.5, 0.625, 1.0]), max(reach, rng.choice([0.375, 0.5, 0.625]))
    flags = {team: _flag(rng, team, length, width, homes[team], home, zone) for team in ("red", "blue")}
    return Ground(
        centre=(rng.randrange(-8, 9) / 2, rng.randrange(-8, 9) / 2),
        scale=rng.choice([0.5, 0.75, 1.0, 2.0]),
        length=length,
        width=width,
        homes=homes,
        flags=flags,
        tag=rng.choice([0.25, 0.3125, 0.375, 0.625]),
        reach=reach,
        home=home,
        zone=zone,
    )


def _flag(rng: random.Random, team: str, length: float, width: float, side: str, home: float, zone: float) -> Place:
    """A random place of a flag whose zone is in its half and away from the home corner."""
    corner = (-length / 2 if team == "red" else length / 2, -width / 2 if side == "low" else width / 2)
    while True:
        x, y = rng.randrange(33) / 32 * length / 2, (rng.randrange(33) / 32 - 0.5) * width
        x, y = (-1 if team == "red" else 1) * round(x * 16) / 16, round(y * 16) / 16
        inside = zone <= abs(x) <= length / 2 - zone and abs(y) <= width / 2 - zone
        if inside and not near((x, y), corner, home + zone + 0.01):
            return x, y


class Game:
    """One random game, judged twice.

    Args:
        seed: everything in the game follows from it.

    Attributes:
        counted: how many calls of each rule both have made.
    """

    def __init__(self, seed: int) -> None:
        self.rng = rng = random.Random(seed)
        self.ground = ground(rng)
        self.names = [f"{team}{i}" for team in ("red", "blue") for i in range(rng.randint(1, 5))]
        self.teams = {name: name.rstrip("0123456789") for name in self.names}
        self.speed = rng.choice(SPEEDS)
        self.starts = {name: self._start(team) for name, team in self.teams.items()}
        long, last = rng.choice([30, 61, 100]), rng.choice([1, 9, 40])
        enough = rng.choice([1, 2, 3, 3])
        self.slow = SlowReferee(self.ground, self.teams, TICK, long * TICK, last * TICK, enough, self.speed)
        self.book = RoboFlag(self._settings(long, last, enough), self._contestants())
        self.match = Match(self.book)
        self.boldness = rng.choice([0.1, 0.4, 0.7])
        """How likely a player goes where it is useful, rather than anywhere."""
        self.jumps = rng.choice([0.02, 0.1, 0.3])
        """How likely a player appears at a decisive place."""
        self.places = dict(self.starts)
        self.time = 0.0
        self.back: set[str] = set()
        """The disqualified players that play again from the next round."""
        self.counted: Counter[str] = Counter()

    def play(self) -> None:
        """Play the game to its end."""
        for _ in range(3):
            self._overrule(0.3)
            marks = {name: (mark.x, mark.y) for name, mark in self.match.game.marks.items()}
            outcome = self._step(marks)
            assert outcome.stages == [Stage.PLAY_ROUND], self.match.waiting
            self.places = self.slow.before = marks
            while self.match.stage is Stage.PLAY_ROUND:
                self._play()
            assert self.match.stage is Stage.ROUND_OVER
            assert self.slow.round_over
            self._finish()
            if self.match.over:
                return
        raise AssertionError("expected the game to be over after the sudden death")

    def _play(self) -> None:
        rng = self.rng
        if rng.random() < 0.01:
            self._halt()
        if rng.random() < 0.01:
            carriers = [name for name in self.slow.carriers.values() if name]
            self._disqualify(rng.choice(carriers or self.names))
        self._overrule(0.02)
        if self.slow.out and rng.random() < 0.02:
            self._reinstate(rng.choice(sorted(self.slow.out)))
        self.places = {name: self._next(name) for name in self.names}
        self._meet()
        before = dict(self.slow.states)
        outcome, rulings = self._step(self.places), self.slow.play(self.places)
        self._compare(outcome, rulings)
        self.counted.update(self._special(before, rulings))
        assert (self.match.stage is Stage.ROUND_OVER) == self.slow.round_over

    def _meet(self) -> None:
        """Seldom two opponents are exactly at the tag distance from each other, or both carriers come home at once."""
        rng, g = self.rng, self.ground
        if rng.random() < 0.03:
            red, blue = (rng.choice([n for n in self.names if self.teams[n] == team]) for team in ("red", "blue"))
            one, other = rng.choice([(red, blue), (blue, red)])
            x, y = self.places[one] = self._decisive(one)
            dx, dy = rng.choice([(g.tag, 0.0), (-g.tag, 0.0), (0.0, g.tag), (0.0, -g.tag)])
            self.places[other] = (x + dx * g.scale, y + dy * g.scale)
        if rng.random() < 0.03 and all(self.slow.carriers.values()):
            for name in filter(None, self.slow.carriers.values()):
                self.places[name] = g.corner(self.teams[name])

    def _finish(self) -> None:
        """The pause after a round, and what follows it."""
        assert not self._step(self.places, 1.0), "there is a pause before the next round"
        self._overrule(0.3)
        self.slow.out -= self.back
        self.back.clear()
        outcome, rulings = self._step(self.places, 1.0), self.slow.go_on()
        self._compare(outcome, rulings)
        assert self.match.winner == self.slow.winner
        assert self.match.over == (self.slow.winner is not None)
        if not self.match.over:
            assert self.match.stage is Stage.INITIALIZE
            assert self.match.game.round == (3 if self.slow.suddenly else self.slow.round)
        self.counted[f"won: {self.match.winner}" if self.match.over else "next rounds"] += 1

    def _overrule(self, likely: float) -> None:
        """An official sets scores and states, as often as it is likely; what is impossible changes nothing."""
        rng = self.rng
        while rng.random() < likely:
            if rng.random() < 0.3:
                action, subject = OfficialAction.SET_SCORE, rng.choice(["red", "blue"])
                value = str(rng.randrange(self.slow.enough + 1))
                self.slow.captures[subject] = int(value)
            else:
                action, subject = OfficialAction.SET_STATE, rng.choice(self.names)
                value = rng.choice([NORMAL, TAGGED, FLAGGED])
                self.slow.set_state(subject, value)
            decide(self.match, Official(action=action, by="ann", subject=subject, value=value), Observation({}), [])
            self.counted[action] += 1

    def _halt(self) -> None:
        """Play is halted for some ticks in which robots are carried about; nothing of it counts."""
        self.match.halt("somebody is in the way")
        before = self.match.standing()
        for _ in range(3):
            assert not self._step({name: self._decisive(name) for name in self.names})
        assert self.match.standing() == before
        self.match.resume()
        self.slow.before = {}  # nobody knows how the robots came where they are
        self.counted["halts"] += 1

    def _disqualify(self, name: str) -> None:
        """One player fails, but never the last one."""
        if len(self.slow.out) + 1 < len(self.names) and name not in self.slow.out:
            self.match.disqualify(name, "its process has failed", Observation({}))
            self.slow.out.add(name)
            self.counted["disqualifications"] += 1

    def _reinstate(self, name: str) -> None:
        """A player that failed plays again from the next round."""
        if self.match.reinstate(name, Observation({})):
            self.back.add(name)
            self.counted["reinstatements"] += 1

    def _special(self, before: dict[str, str], rulings: list[Ruling]) -> list[str]:
        """What is seldom and decisive among the calls of one tick, given the states before it."""
        g = self.ground
        made = [rule for rule, _ in rulings]
        tagged = {players[0]: players[1:] for rule, players in rulings if rule == "tag"}
        takers = {players[0] for rule, players in rulings if rule == "flag"}
        scorers = {players[0] for rule, players in rulings if rule == "capture"}
        found = ["both score at once"] * (made.count("capture") == 2)
        found += ["two tag each other"] * any(name in tagged.get(by, ()) for name in tagged for by in tagged[name])
        found += ["tagged by several"] * any(len(by) > 1 for by in tagged.values())
        found += ["tagged exactly at the distance"] * any(
            squared(self.places[name], self.places[by]) == (g.tag * g.scale) ** 2
            for name in tagged
            for by in tagged[name]
        )
        found += ["met between two looks"] * any(
            not near(self.places[name], self.places[by], g.tag * g.scale) for name in tagged for by in tagged[name]
        )
        found += ["tagged on the midline"] * any(self.places[name][0] == g.centre[0] for name in tagged)
        found += ["a carrier is tagged"] * any(before[name] == FLAGGED for name in tagged)
        found += ["taken and lost at once"] * bool(takers & set(tagged))
        found += ["taken as it comes free"] * any(self.teams[a] == self.teams[b] for a in takers for b in scorers)
        found += ["exactly in reach of the flag"] * any(
            squared(self.places[name], g.flag(OTHER[self.teams[name]])) == (g.reach * g.scale) ** 2 for name in takers
        )
        near_by = [
            name
            for name in self.names
            if name not in self.slow.out and before[name] != TAGGED and self.slow.states[name] != TAGGED
            if g.in_a_flag_zone(self.places[name]) and self._threatened(name, before)
        ]
        return found + ["saved by a flag zone"] * bool(near_by)

    def _threatened(self, name: str, before: dict[str, str]) -> bool:
        """Whether an opponent that tags is in reach of a player that only a flag zone can protect."""
        g, place = self.ground, self.places[name]
        if self.slow.states[name] == NORMAL and not g.on_half_of(OTHER[self.teams[name]], place):
            return False
        return any(
            self.teams[other] != self.teams[name]
            and other not in self.slow.out
            and before[other] != TAGGED
            and near(place, self.places[other], g.tag * g.scale)
            for other in self.names
        )

    def _step(self, places: dict[str, Place], dt: float = float(TICK)) -> Effects:
        self.time += dt
        poses = {name: Pose(x, y, 0.0) for name, (x, y) in places.items()}
        return self.match.step(dt, Observation(poses, time=self.time), [])

    def _compare(self, outcome: Effects, rulings: list[Ruling]) -> None:
        """Both have made the same calls, in the order of the rules, and tell the same states, flags and scores."""
        told = [(call.rule, tuple(call.players)) for call in outcome.calls if call.rule != "game_over"]
        assert {rule for rule, _ in told} <= JUDGED
        assert in_order(told) == in_order(rulings)
        order = ["flag_returns", "capture", "flag", "tag", "time"]
        ranks = [order.index("capture" if rule == "home" else rule) for rule, _ in told if rule != "sudden_death"]
        assert ranks == sorted(ranks), "home, then flag, then tag"
        self.counted.update(rule for rule, _ in told)
        state, slow = self.match.game, self.slow
        playing = [name for name in self.names if name not in slow.out]
        assert {n: state.states[n] for n in playing} == {n: slow.states[n] for n in playing}
        assert {team: state.flag(team).carrier for team in OTHER} == slow.carriers
        assert self.book.score(state) == slow.captures
        driven = set(self.match.driven)
        if self.match.stage is Stage.PLAY_ROUND:
            assert driven == {name for name in playing if slow.states[name] == TAGGED}
        self.counted["states"] += len(playing)
        self.counted["ticks"] += 1

    def _settings(self, long: int, last: int, enough: int) -> Settings:
        g = self.ground
        sides = {team: TeamHalf.model_validate({"home": g.homes[team], "flag": g.flags[team]}) for team in OTHER}
        return Settings(
            centre=g.centre,
            scale=g.scale,
            red=sides["red"],
            blue=sides["blue"],
            length=g.length,
            width=g.width,
            tag_distance=g.tag,
            flag_reach=g.reach,
            home_reach=g.home,
            flag_zone=g.zone,
            round_time=float(long * TICK),
            sudden_death=float(last * TICK),
            captures=enough,
        )

    def _contestants(self) -> list[Contestant]:
        starts = {name: Pose(x, y, 0.0) for name, (x, y) in self.starts.items()}
        return [
            Contestant(name=name, role=self.teams[name], start=starts[name], size=(0.05, 0.05), v_max=self.speed)
            for name in self.names
        ]

    def _start(self, team: str) -> Place:
        """A place in the own half, a little away from the borders."""
        g, rng = self.ground, self.rng
        x = rng.uniform(0.2, g.length / 2 - 0.2) * (-1 if team == "red" else 1)
        return self._at((x, rng.uniform(0.2 - g.width / 2, g.width / 2 - 0.2)))

    def _at(self, place: Place) -> Place:
        """A place at scale 1 from the centre, in the frame of the map."""
        g = self.ground
        return g.centre[0] + place[0] * g.scale, g.centre[1] + place[1] * g.scale

    def _next(self, name: str) -> Place:
        """Where a player is at the next tick."""
        if self.rng.random() < self.jumps:
            return self._decisive(name)
        x, y = self.places[name]
        step = self.speed * float(TICK) * self.rng.random()
        goal = self._wanted(name) if self.rng.random() < self.boldness else self._anywhere()
        away = ((goal[0] - x) ** 2 + (goal[1] - y) ** 2) ** 0.5
        part = min(1.0, step / away) if away else 0.0
        return x + part * (goal[0] - x), y + part * (goal[1] - y)

    def _wanted(self, name: str) -> Place:
        """Where a player in its state would like to be."""
        team = self.teams[name]
        if self.slow.states[name] != NORMAL:
            return self.ground.corner(team)
        if self.names.index(name) % 2:
            return self.ground.flag(OTHER[team])
        return self.places[self.rng.choice([n for n in self.names if self.teams[n] != team])]

    def _anywhere(self) -> Place:
        g, rng = self.ground, self.rng
        return self._at((rng.uniform(-0.6, 0.6) * g.length, rng.uniform(-0.6, 0.6) * g.width))

    def _decisive(self, name: str) -> Place:
        """A place of the raster near the midline, a flag, the border of its zone, a home, or another player."""
        g, rng = self.ground, self.rng
        team = rng.choice(["red", "blue"])
        kind = rng.randrange(6)
        if kind == 0:
            place = (0.0, rng.uniform(-0.5, 0.5) * g.width)
        elif kind == 1:
            place = g.flags[team]
        elif kind == 2:
            x, y = g.flags[team]
            dx, dy = rng.choice([(1, 0), (-1, 0), (0, 1), (0, -1), (0.6, 0.8), (-0.8, 0.6)])
            place = (x + dx * g.zone, y + dy * g.zone)
            if abs(dx) in (0, 1):  # exactly at the border of the zone
                return self._at(place)
        elif kind == 3:
            corner = g.corner(self.teams[name])
            place = ((corner[0] - g.centre[0]) / g.scale, (corner[1] - g.centre[1]) / g.scale)
            place = rng.choice([(place[0], place[1] + g.home), (place[0] + g.home, place[1] - g.home / 2), place])
        elif kind == 4:
            place = (rng.uniform(-0.6, 0.6) * g.length, rng.uniform(-0.6, 0.6) * g.width)
        else:
            x, y = self.places[rng.choice(self.names)]
            dx, dy = rng.choice([(g.tag, 0), (-g.tag, 0), (0, g.tag), (0.6 * g.tag, -0.8 * g.tag)])
            place = ((x - g.centre[0]) / g.scale + dx, (y - g.centre[1]) / g.scale + dy)
        return self._at((round(place[0] / GRID / 0.5) * GRID * 0.5, round(place[1] / GRID / 0.5) * GRID * 0.5))


@pytest.mark.parametrize(
    "chunk", [*range(3), *(pytest.param(chunk, marks=pytest.mark.thorough) for chunk in range(3, CHUNKS))]
)
def test_both_referees_agree_at_every_tick(chunk: int) -> None:
    counted: Counter[str] = Counter()
    for number in range(GAMES // CHUNKS):
        game = Game(chunk * GAMES + number)
        game.play()
        counted += game.counted
    missing = {what for what in EXPECTED | JUDGED if not counted[what]}
    assert not missing, "every rule and every special case must have come up"


@pytest.mark.parametrize(
    ("function", "old", "new"),
    [
        (judging.judge_homes, "t.carriers[1 - team] = NO_ONE", "pass"),
        (judging.judge_flags, "if at < first or (at == first and far < nearest)", "if True"),
        (judging.judge_tags, "if t.states[n] == NORMAL:", "if True:"),
        (judging.judge_tags, "t.states[by] == TAGGED", "t.after[by] == TAGGED"),
        (judging.first_exposed, "if start - ROUNDING <= at <= end:", "if False:"),
    ],
)
def test_they_disagree_where_the_rules_are_changed(
    function: FunctionType, old: str, new: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant(monkeypatch, function, old, new)
    with pytest.raises(AssertionError):
        test_both_referees_agree_at_every_tick(0)
