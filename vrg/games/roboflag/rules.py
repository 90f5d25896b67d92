"""The rules of RoboFlag (thesis 4.4, Algorithm 4.3): capture the flag, with two halves, two homes and two flags."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace

from msgspec import structs

from vrg.bus.messages import Auction, FieldObject, Zone
from vrg.coordinator.auctions import closed, opened
from vrg.coordinator.look import NO_ONE, Look
from vrg.coordinator.placing import assigned
from vrg.coordinator.rulebook import DRAW, Call, Contestant, GameState, Observation, RuleBook, Verdict
from vrg.errors import ConfigError
from vrg.games.roboflag import (
    FLAG,
    FLAGGED,
    GAME,
    NORMAL,
    SCOUTING,
    SCOUTS,
    TAG_DISTANCE,
    TAGGED,
    TEAMS,
    attack_of,
    flag_of,
    judging,
    other,
)
from vrg.games.roboflag.layout import FieldLayout, problems_of
from vrg.games.roboflag.settings import Settings
from vrg.types import Pose

STATES = (NORMAL, TAGGED, FLAGGED)
"""The states by their numbers in `judging`."""


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. The flags are among its `objects`.

    A team has a point for each flag that it has captured.

    Args:
        marks: where each player lines up for this round: at one of the starts of its team.
    """

    marks: Mapping[str, Pose]

    def flag(self, team: str) -> FieldObject:
        """The flag of a team."""
        return next(thing for thing in self.objects if thing.name == flag_of(team))

    def with_carrier(self, team: str, carrier: str | None) -> "State":
        """The same, but with this player as the carrier of the team's flag; None puts the flag back to its place."""
        changed = structs.replace(self.flag(team), carrier=carrier)
        return structs.replace(self, objects=tuple(changed if t.name == changed.name else t for t in self.objects))


class RoboFlag(RuleBook[State]):
    """The rule book of RoboFlag.

    Args:
        settings: the [rules] table of the match file.
        contestants: the players. Teams may be of different sizes, and have scouts, whom the rules ignore.
        seed: the seed of the match; nothing in these rules is drawn.

    Raises:
        ConfigError: the match cannot be played; see `problems_of`. The error lists all reasons.
    """

    name = GAME.name
    round_word = GAME.round_word
    rounds = judging.ROUNDS
    state_type = State

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int = 0) -> None:
        if problems := problems_of(settings, contestants):
            raise ConfigError(problems)
        super().__init__(contestants)
        self.settings = settings
        self.layout = FieldLayout(settings)
        self.teams = {name: self.team_of(name) for name in self.contestants}
        # A robot that is released at the border of the field would turn beyond it.
        self._driven_to = {team: self.layout.home(team).shrunk(self.layout.home_reach / 4) for team in TEAMS}
        self.lineup_limit = settings.patience
        self._names = sorted(c.name for c in contestants if c.role not in SCOUTS.values())
        self._setting = SimpleNamespace(
            sides=[TEAMS.index(self.teams[name]) for name in self._names],
            order=range(len(self._names)),
            captures=settings.captures,
            round_time=settings.round_time,
            sudden_death=settings.sudden_death,
            **self.layout.numbers(),
        )

    def initial(self) -> State:
        """The state in which every player is normal, both flags are in their places, and no team has scored."""
        flags = tuple(
            FieldObject(name=flag_of(team), kind=FLAG, x=place[0], y=place[1], team=team)
            for team in TEAMS
            for place in [self.layout.flag(team)]
        )
        return State(
            states=dict.fromkeys(self.contestants, SCOUTING) | dict.fromkeys(self._names, NORMAL),
            points=dict.fromkeys(TEAMS, 0),
            objects=flags,
            numbers={TAG_DISTANCE: self.layout.tag_distance},
            marks={name: contestant.start for name, contestant in self.contestants.items()},
        )

    def marks(self, state: State) -> Mapping[str, Pose]:
        """The mark of each player in this round."""
        return state.marks

    def judge(self, state: State, before: Observation, now: Observation, clock: float) -> Verdict[State]:
        """Judge the ways between two instants: homes, flags, tags, then who bids, and the end of the round."""
        state, calls = self._returned(state)
        look = Look(self._names, before, now, 2 * len(self._names) + len(TEAMS) + 1)
        carriers = [state.flag(team).carrier for team in TEAMS]
        standing = SimpleNamespace(
            states=[STATES.index(state.states[name]) for name in self._names],
            here=[here and name not in state.disqualified for name, here in zip(self._names, look.here, strict=True)],
            carriers=[NO_ONE if name is None else self._names.index(name) for name in carriers],
            points=[state.points[team] for team in TEAMS],
            after=[judging.NORMAL] * len(self._names),
        )
        over = judging.judge(self._setting, standing, look, look.before, look.now, state.round, clock)
        calls += self._calls(state, look)
        state = self._driven_home(self._auctions(self._after(state, standing), clock))
        return Verdict(structs.replace(state, auctions={}, driven={}) if over else state, calls, round_over=over)

    def _calls(self, state: State, look: Look) -> list[Call]:
        """What was called at a look, from the state before it."""
        calls, points, carried = [], dict(state.points), set(state.in_state(FLAGGED))
        for rule, players, poses in look.noted():
            name, *taggers = players or ("",)
            opponents = other(self.teams.get(name, ""))
            match rule:
                case judging.HOME:
                    text = f"{name} is at home and plays again"
                case judging.CAPTURE:
                    team = self.teams[name]
                    points[team] += 1
                    carried.discard(name)
                    text = f"{name} captures the flag of {opponents}: {points[team]} to {points[opponents]} for {team}"
                case judging.FLAG:
                    carried.add(name)
                    text = f"{name} takes the flag of {opponents}"
                case judging.TAG:
                    text = f"{name} is tagged by {' and '.join(taggers)}"
                    text += f", and the flag of {opponents} returns" if name in carried else ""
                case _:
                    text = f"the time of round {state.round} is up"
            calls.append(Call(rule=judging.RULES[rule], text=text, players=players, poses=poses))
        return calls

    def _after(self, state: State, standing: SimpleNamespace) -> State:
        """The state after a look."""
        for name, number in zip(self._names, standing.states, strict=True):
            state = state.with_state([name], STATES[number])
        for team, carrier, points in zip(TEAMS, standing.carriers, standing.points, strict=True):
            by = None if carrier == NO_ONE else self._names[carrier]
            if by != state.flag(team).carrier:
                state = state.with_carrier(team, by)
            state = state.with_points(team, points)
        return state

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        """End the game, or begin the next round: scores carry over, positions and flags do not."""
        points = [state.points[team] for team in TEAMS]
        won = judging.winner(self._setting, points, state.round)
        if won == judging.DRAWN:
            return Verdict(state, winner=DRAW, why=f"still a tie after sudden death, {points[0]} to {points[1]}")
        if won != NO_ONE:
            return Verdict(state, winner=TEAMS[won], why=self._why(state, TEAMS[won]))
        marks = dict(self.initial().marks)
        for team in TEAMS:
            starts = {name: marks[name] for name in self._names if self.teams[name] == team}
            marks |= assigned({name: now.poses.get(name, start) for name, start in starts.items()}, [*starts.values()])
        number = judging.next_number(self._setting, points, state.round)
        fresh = structs.replace(
            self.initial(),
            marks=marks,
            round=number,
            points=state.points,
            disqualified=state.disqualified,
        )
        if number < judging.SUDDEN_DEATH:
            return Verdict(fresh)
        text = f"a tie, {points[0]} to {points[1]}: sudden death, in which the first capture wins"
        return Verdict(fresh, [Call(rule="sudden_death", text=text)])

    def zones(self, state: State) -> list[Zone]:
        """The field, and the half, the home zone and the flag zone of each team."""
        return self.layout.zones()

    def states_of(self, name: str) -> Sequence[str]:
        """The states into which an official may put a player."""
        return (NORMAL, TAGGED, FLAGGED) if name in self._names else (SCOUTING,)

    def put_into(self, state: State, name: str, value: str) -> State:
        """The state after an official has put a player into another one.

        Raises:
            ConfigError: the flag has another carrier.
        """
        opponents = other(self.teams[name])
        carrier = state.flag(opponents).carrier
        if value == FLAGGED and carrier not in (None, name):
            raise ConfigError(f"{carrier} has the flag of {opponents} already")
        if value == FLAGGED or carrier == name:
            state = state.with_carrier(opponents, name if value == FLAGGED else None)
        return self._driven_home(state.with_state([name], value))

    def _returned(self, state: State) -> tuple[State, list[Call]]:
        """Put back the flag of a carrier that is disqualified."""
        calls = []
        for team in TEAMS:
            carrier = state.flag(team).carrier
            if carrier is not None and carrier in state.disqualified:
                state = state.with_carrier(team, None).with_state([carrier], NORMAL)
                text = f"{carrier} is disqualified, and the flag of {team} returns"
                calls.append(Call(rule="flag_returns", text=text, players=(carrier,)))
        return state, calls

    def _driven_home(self, state: State) -> State:
        """Let the coordinator drive exactly the tagged players home."""
        tagged = {n: self._driven_to[self.teams[n]] for n, status in state.states.items() if status == TAGGED}
        return state if tagged == state.driven else structs.replace(state, driven=tagged)

    def _auctions(self, state: State, clock: float) -> State:
        """Let each team whose players are all without a flag bid, once an epoch, for who goes for the flag.

        An epoch ends early if the one that goes is tagged or fails.
        """
        for team in TEAMS:
            lot = attack_of(team)
            auction = state.auctions.get(lot)
            bidders = tuple(
                name
                for name in sorted(self.teams)
                if self.teams[name] == team and state.states[name] == NORMAL and name not in state.disqualified
            )
            if state.flag(other(team)).carrier is not None or not bidders:
                state = state if auction is None else closed(state, lot)
                continue
            over = auction is None or clock >= auction.opened + self.settings.epoch - 1e-9
            if auction is None or over or auction.winner not in (None, *bidders):
                state = opened(state, Auction(lot=lot, bidders=bidders, opened=clock, lasts=self.settings.bidding))
            elif auction.bidders != bidders:
                state = opened(state, structs.replace(auction, bidders=bidders))
        return state

    def _why(self, state: State, winner: str) -> str:
        """Why the game is over, in words."""
        if state.round >= judging.SUDDEN_DEATH:
            # By a capture, or by the score that an official has set.
            return f"the lead in sudden death, {state.points[winner]} to {min(state.points.values())}"
        points = state.points[winner]
        won = "1 flag is captured" if points == 1 else f"{points} flags are captured"
        enough = judging.is_enough(self._setting, [*state.points.values()])
        return won if enough else "the time is up"

    def time_limit(self, state: State) -> float:
        """The time of play in s at which this round ends at the latest."""
        return judging.time_limit(self._setting, state.round)
