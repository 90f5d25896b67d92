"""The rules of RoboFlag (thesis 4.4, Algorithm 4.3): capture the flag, with two halves, two homes and two flags."""

from collections.abc import Mapping, Sequence

from msgspec import structs

from vrg.bus.messages import Auction, FieldObject, Zone
from vrg.coordinator.auctions import closed, opened
from vrg.coordinator.placing import assigned
from vrg.coordinator.rulebook import DRAW, Call, Contestant, Observation, RuleBook, Verdict
from vrg.errors import ConfigError
from vrg.games.roboflag import FLAG, FLAGGED, GAME, NORMAL, TAG_DISTANCE, TAGGED, TEAMS, attack_of, flag_of, other
from vrg.games.roboflag.judging import State, Ways, judge_flags, judge_homes, judge_tags
from vrg.games.roboflag.layout import FieldLayout, problems_of
from vrg.games.roboflag.settings import Settings
from vrg.types import Pose

ROUNDS = 2
SUDDEN_DEATH = 3
"""The number of the round that decides a tie."""


class RoboFlag(RuleBook[State]):
    """The rule book of RoboFlag.

    Args:
        settings: the [rules] table of the match file.
        contestants: the players. Teams may be of different sizes.
        seed: the seed of the match; nothing in these rules is drawn.

    Raises:
        ConfigError: the match cannot be played; see `problems_of`. The error lists all reasons.
    """

    name = GAME.name
    round_word = GAME.round_word
    rounds = ROUNDS
    state_type = State

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int = 0) -> None:
        if problems := problems_of(settings, contestants):
            raise ConfigError(problems)
        super().__init__(contestants)
        self.settings = settings
        self.layout = FieldLayout(settings)
        self.teams = {c.name: c.role for c in contestants}
        # A robot that is released at the border of the field would turn beyond it.
        self._driven_to = {team: self.layout.home(team).shrunk(self.layout.home_reach / 4) for team in TEAMS}
        self.lineup_limit = settings.patience

    def initial(self) -> State:
        """The state in which every player is normal, both flags are in their places, and no team has scored."""
        flags = tuple(
            FieldObject(name=flag_of(team), kind=FLAG, x=place[0], y=place[1], team=team)
            for team in TEAMS
            for place in [self.layout.flag(team)]
        )
        return State(
            states=dict.fromkeys(self.contestants, NORMAL),
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
        here = {name: pose for name, pose in now.poses.items() if name in self.teams and name not in state.disqualified}
        ways = Ways(before.poses, here, self.teams)
        for part in (judge_homes, judge_flags, judge_tags):
            state, found = part(state, self.layout, ways)
            calls += found
        state = self._driven_home(self._auctions(state, clock))
        return self._end_of_round(state, clock, calls)

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        """End the game, or begin the next round: scores carry over, positions and flags do not."""
        first, second = (state.points[team] for team in TEAMS)
        leader = TEAMS[0] if first > second else TEAMS[1]
        last = self._decided(state) or state.round >= ROUNDS
        if last and first != second:
            return Verdict(state, winner=leader, why=self._why(state, leader))
        if state.round >= SUDDEN_DEATH:
            return Verdict(state, winner=DRAW, why=f"still a tie after sudden death, {first} to {second}")
        marks: dict[str, Pose] = {}
        for team in TEAMS:
            starts = {name: start for name, start in self.initial().marks.items() if self.teams[name] == team}
            marks |= assigned({name: now.poses.get(name, start) for name, start in starts.items()}, [*starts.values()])
        fresh = structs.replace(
            self.initial(),
            marks=marks,
            round=SUDDEN_DEATH if last else state.round + 1,
            points=state.points,
            disqualified=state.disqualified,
        )
        if not last:
            return Verdict(fresh)
        text = f"a tie, {first} to {second}: sudden death, in which the first capture wins"
        return Verdict(fresh, [Call(rule="sudden_death", text=text)])

    def zones(self, state: State) -> list[Zone]:
        """The field, and the half, the home zone and the flag zone of each team."""
        return self.layout.zones()

    def states_of(self, name: str) -> Sequence[str]:
        """The states into which an official may put a player."""
        return NORMAL, TAGGED, FLAGGED

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
        if state.round >= SUDDEN_DEATH:
            # By a capture, or by the score that an official has set.
            return f"the lead in sudden death, {state.points[winner]} to {min(state.points.values())}"
        points = state.points[winner]
        won = "1 flag is captured" if points == 1 else f"{points} flags are captured"
        return won if self._decided(state) else "the time is up"

    def time_limit(self, state: State) -> float:
        """The time of play in s at which this round ends at the latest."""
        return self.settings.sudden_death if state.round == SUDDEN_DEATH else self.settings.round_time

    def _decided(self, state: State) -> bool:
        """True if a team has captured enough flags to end the game."""
        return any(captured >= self.settings.captures for captured in state.points.values())

    def _end_of_round(self, state: State, clock: float, calls: list[Call]) -> Verdict[State]:
        decided = self._decided(state)
        if state.round == SUDDEN_DEATH:
            # An official may set a score, too. Both teams may capture at once, which leaves the tie.
            decided = len(set(state.points.values())) > 1 or any(call.rule == "capture" for call in calls)
        if not decided and clock < self.time_limit(state) - 1e-9:
            return Verdict(state, calls)
        if not decided:
            calls.append(Call(rule="time", text=f"the time of round {state.round} is up"))
        return Verdict(structs.replace(state, auctions={}, driven={}), calls, round_over=True)
