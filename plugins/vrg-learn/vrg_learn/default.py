"""What programs that learn a game need to know of it where its package does not say: what its rule book publishes."""

from vrg.agents.strategy import View
from vrg.bus.messages import DISQUALIFIED, TIME_LIMIT, PlayerStatus, RefereeState, Stage
from vrg.config.loading import load_match
from vrg.config.rules import rulebook_of
from vrg.coordinator.rulebook import Observation
from vrg.games.game import Game
from vrg.regions import Bounds, Region, surrounding
from vrg.shared import shared
from vrg_learn.learning import Learning, Look, left


def default_of(game: Game) -> Learning:
    """What programs that learn a game need to know of it, by the rule book of the match that it ships.

    A player sees its role, the time, the round and the lead of its team, the nearest point and the middle of each zone,
    where each thing is, and of others which team, which role and which state they have. Only winning is rewarded.

    Raises:
        ConfigError: the match that the game ships has problems.
    """
    setup = load_match(game.default_match())
    book = rulebook_of(setup)
    first = book.initial()
    zones = {zone.name: zone.region for zone in book.zones(first)}
    things = {thing.name: (thing.x, thing.y) for thing in first.objects}
    things |= {name: (body.pose.x, body.pose.y) for name, body in book.bodies.items()}
    starts = [(player.x, player.y, player.x, player.y) for player in setup.players]
    around = surrounding([*(region.bounds for region in zones.values()), *starts])
    roles = [role.name for role in game.roles]

    def look(view: View) -> Look:
        me, state, here = view.me, view.referee, view.position
        bounds, regions = _field(state)
        found = {thing.name: (thing.x, thing.y) for thing in state.objects}
        best = max((points for team, points in state.score.items() if team != me.team), default=0)
        own, total = state.score.get(me.team, 0), sum(map(abs, state.score.values()))

        def flags(other: PlayerStatus) -> tuple[float, ...]:
            its = (float(other.role == role) for role in roles)
            return float(other.team == me.team), *its, float(other.may_move), float(game.is_out(other.state))

        numbers = (
            *(float(me.role == role) for role in roles),
            float(me.may_move),
            float(game.is_out(me.state)),
            left(state.clock, state.numbers.get(TIME_LIMIT)),
            min(1.0, state.round / max(1, state.rounds)),
            min(1.0, max(-1.0, (own - best) / max(1, total))),
        )
        known = [regions.get(name, region) for name, region in zones.items()]
        places = [place for region in known for place in (region.nearest(*here), region.middle)]
        places += [found.get(name, place) for name, place in things.items()]
        return Look(bounds or around, numbers, tuple(places), flags)

    statuses = book.statuses(first, Stage.PLAY_ROUND, Observation({}))
    states = {*(player.state for player in statuses), *game.out_of_play}
    states |= {state for name in book.contestants for state in book.states_of(name)}
    return Learning(
        look=look,
        numbers=(
            *(f"my role is {role}" for role in roles),
            *("i may move", "i am out of play", "time left", "round", "lead"),
        ),
        places=(
            *(f"{part} of the {name}" for name in zones for part in ("nearest point", "centre")),
            *(f"place of the {name}" for name in things),
        ),
        flags=("mate", *roles, "may move", "out of play"),
        states=tuple(sorted(states - {DISQUALIFIED})),
    )


@shared
def _field(state: RefereeState) -> tuple[Bounds | None, dict[str, Region]]:
    """The bounds of the field, None if the game has none, and the region of each zone."""
    field = next((zone.region.bounds for zone in state.zones if zone.kind == "field"), None)
    return field, {zone.name: zone.region for zone in state.zones}
