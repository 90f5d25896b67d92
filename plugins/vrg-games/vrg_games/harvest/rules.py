"""The settings and the rule book of harvest."""

from collections.abc import Mapping, Sequence

from msgspec import structs
from pydantic import Field as Setting

from vrg.bus.messages import FieldObject, Thing, Zone
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict, called
from vrg.errors import ConfigError, Problem
from vrg.games.settings import Pitch
from vrg.hal.sim.config import BodySetup
from vrg.hal.sim.contact import form_of, placed
from vrg.regions import Rectangle
from vrg.types import Pose
from vrg_games.harvest import BLUES, DEPOT, GAME, KINDS, OTHER, REDS, TEAMS

OWN, OTHERS = 2, 1
"""The points of a piece of the depot's colour, and of another one."""


class Settings(Pitch):
    """The [rules] table of a match file; lengths are in m, times in s of play.

    Args:
        depot: the side of a depot, in the middle of its short side of the field: reds have that at the low x.
        pause: the time after a trespass in which the same player is not called again. time: that of the match.
    """

    length: float = Setting(12.0, ge=2, le=100)
    width: float = Setting(8.0, ge=2, le=100)
    depot: float = Setting(2.0, ge=0.2, le=50)
    pause: float = Setting(3.0, ge=0.5, le=60)
    time: float = Setting(120.0, gt=0, le=1e5)

    def depot_of(self, team: str) -> Rectangle:
        """The depot of an alliance."""
        far = self.length / 2
        return self.part(-1.0 if team == REDS else 1.0, far - self.depot, far, self.depot)


class HarvestState(GameState, frozen=True, kw_only=True):
    """The state of a match.

    Args:
        homes: the alliance in whose depot each piece is, by the name of the piece.
        warned: the time of play of each player's last trespass, s.
    """

    homes: Mapping[str, str] = {}
    warned: Mapping[str, float] = {}


class Harvest(RuleBook[HarvestState]):
    """The rule book. A match is one round."""

    name = GAME.name
    round_word = GAME.round_word
    state_type = HarvestState
    lineup_limit = 20.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        super().__init__(contestants)
        self.settings = settings
        problems = [
            Problem("starts outside the field, or in the other alliance's depot", ("players", c.name))
            for c in contestants
            if not settings.field.contains(c.start.x, c.start.y) or self._trespasses(c, c.start)
        ]
        if {TEAMS[c.role] for c in contestants} != {REDS, BLUES}:
            problems.append(Problem("expected players of both alliances", ("players",)))
        if problems:
            raise ConfigError(problems)

    def equip(self, bodies: Sequence[BodySetup]) -> None:
        """Take in the pieces.

        Raises:
            ConfigError: there are none, or one starts outside the field.
        """
        super().equip(bodies)
        self.pieces = {body.name: body for body in bodies if body.kind in KINDS}
        if not self.pieces:
            raise ConfigError([Problem(f"expected bodies of the kinds {' and '.join(KINDS)}, got none", ("bodies",))])
        outside = [p.name for p in self.pieces.values() if not self.settings.field.contains(p.pose.x, p.pose.y)]
        if outside:
            raise ConfigError([Problem(f"{', '.join(outside)}: expected a start on the field", ("bodies",))])

    def initial(self) -> HarvestState:
        """Nothing is home."""
        return HarvestState()

    def team_of(self, name: str) -> str:
        """The alliance of a player's role."""
        return TEAMS[self.contestants[name].role]

    def time_limit(self, state: HarvestState) -> float:
        """The time of the match, s."""
        return self.settings.time

    def zones(self, state: HarvestState) -> list[Zone]:
        """The field and the depots."""
        depots = [(team, self.settings.depot_of(team)) for team in (REDS, BLUES)]
        return [
            Zone(name="field", kind="field", region=self.settings.field),
            *(Zone(name=f"{team} depot", kind=DEPOT, region=depot, team=team) for team, depot in depots),
        ]

    def objects(self, state: HarvestState, now: Observation) -> list[FieldObject]:
        """The pieces, each with the alliance whose colour it has."""
        found = super().objects(state, now)
        return [structs.replace(thing, team=KINDS.get(thing.kind, thing.team)) for thing in found]

    def judge(self, state: HarvestState, before: Observation, now: Observation, clock: float) -> Verdict[HarvestState]:
        """Pieces that come home, are taken or leave the field; who trespasses; and the end of the match."""
        calls: list[Call] = []
        place = {}
        for name, piece in self.pieces.items():
            if (thing := now.things.get(name)) is None:
                continue
            state, news = self._moved(state, piece, thing)
            calls += news
            if not self.settings.field.contains(thing.pose.x, thing.pose.y):
                place[name] = piece.pose
                calls.append(Call(rule="out", text=f"{name} is put back on the field", poses=(thing.pose,)))
        for name, pose in now.poses.items():
            contestant = self.contestants[name]
            if name in state.disqualified or not self._trespasses(contestant, pose):
                continue
            if clock - state.warned.get(name, -self.settings.pause) >= self.settings.pause:
                other = OTHER[self.team_of(name)]
                state = structs.replace(state, warned={**state.warned, name: clock})
                state = state.scored(other)
                calls.append(
                    called("trespass", f"{name} is in the depot of the {other}, who get a point", {name: pose})
                )
        if clock >= self.settings.time:
            return Verdict(state, [*calls, Call(rule="time_up", text="the time is up")], round_over=True, place=place)
        if len(state.homes) == len(self.pieces):
            return Verdict(state, [*calls, Call(rule="all_home", text="all pieces are home")], round_over=True)
        return Verdict(state, calls, place=place)

    def _moved(self, state: HarvestState, piece: BodySetup, thing: Thing) -> tuple[HarvestState, list[Call]]:
        """Count a piece that has come into a depot, or has left one."""
        was, team = state.homes.get(piece.name), self.home_of(piece, thing)
        if was == team:
            return state, []
        calls, colour = [], KINDS[piece.kind]
        homes = {name: of for name, of in state.homes.items() if name != piece.name}
        state = structs.replace(state, homes=homes)
        if was is not None:
            worth = OWN if colour == was else OTHERS
            state = state.scored(was, -worth)
            calls.append(Call(rule="taken", text=f"{piece.name} has left the depot of the {was}", poses=(thing.pose,)))
        if team is not None:
            worth = OWN if colour == team else OTHERS
            state = structs.replace(state, homes={**homes, piece.name: team})
            state = state.scored(team, worth)
            text = f"{piece.name} is home: {worth} point{'s' * (worth > 1)} for the {team}"
            calls.append(Call(rule="home", text=text, poses=(thing.pose,)))
        return state, calls

    def home_of(self, piece: BodySetup, thing: Thing) -> str | None:
        """The alliance in whose depot the whole of a piece is; None if it is in none."""
        at = placed(form_of(piece.radius, piece.corners), thing.pose.x, thing.pose.y, thing.pose.theta)
        for team in (REDS, BLUES):
            x_min, y_min, x_max, y_max = self.settings.depot_of(team).bounds
            points = at.corners or [(at.x - at.radius, at.y - at.radius), (at.x + at.radius, at.y + at.radius)]
            if all(x_min <= x <= x_max and y_min <= y <= y_max for x, y in points):
                return team
        return None

    def _trespasses(self, contestant: Contestant, pose: Pose) -> bool:
        return self.settings.depot_of(OTHER[TEAMS[contestant.role]]).contains(pose.x, pose.y)
