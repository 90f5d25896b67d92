"""A world that decides anew only when something may have changed does what one does that decides at every tick."""

import math
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from msgspec import structs

from vrg.config.loading import load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Observation
from vrg.hal.models import MODELS
from vrg.hal.models.pioneer import P2AT
from vrg.hal.sim.config import RobotSetup, WorldConfig
from vrg.hal.sim.world import World
from vrg.types import Pose, Twist

NAMES = ("flat", "slow", "plain")
STATE = Match(rulebook_of(load_match(match_path("sharks-and-minnows")))).state(Observation({}), estop=False)
LOOK = 5
"""The ticks between two commands of players, and two states of the referee."""

twists = st.builds(Twist, st.sampled_from([0.0, 0.4]), st.sampled_from([0.0, 0.5]))
happenings = st.one_of(
    st.tuples(st.just("drive"), st.sampled_from(NAMES), twists, st.booleans()),
    st.tuples(st.just("limit"), st.sampled_from(NAMES), st.sampled_from([0.2, 0.7])),
    st.tuples(st.just("engage"), st.booleans()),
    st.tuples(
        st.just("referee"), st.sampled_from([-0.2, 0.0, 0.25, 0.57]), st.booleans(),
        st.lists(st.tuples(st.booleans(), st.none() | twists), min_size=3, max_size=3),
    ),
)  # fmt: skip


def world() -> World:
    robots = tuple(RobotSetup(name=n, model=n, pose=Pose(3.0 * k, 0.0, 0.0)) for k, n in enumerate(NAMES))
    return World(WorldConfig(map="open", engine="planar", tick=0.02, seed=1, lasers=False, robots=robots))


def happen(to: World, what: str, *how: object) -> None:
    """Let a world hear something."""
    if what == "drive":
        name, twist, armed = how
        to.drive(name, twist, armed)  # type: ignore[arg-type]
    elif what == "limit":
        to.limit(*how)  # type: ignore[arg-type]
    elif what == "engage":
        to.engage(bool(how[0]))
    else:
        ahead, halted, players = how
        state = structs.replace(
            STATE,
            halted="halted" if halted else None,
            players=tuple(
                structs.replace(STATE.players[0], name=name, may_move=may_move, lease=lease)
                for name, (may_move, lease) in zip(NAMES, players, strict=True)  # type: ignore[call-overload]
            ),
        )
        to.referee(state, max(0.0, to.time + ahead))  # type: ignore[operator]


@example(late=False, events=[(("referee", 0.57, False, [(True, None)] * 3), 12, True)])
@settings(max_examples=60, deadline=None)
@given(st.booleans(), st.lists(st.tuples(happenings, st.integers(0, 12), st.booleans()), min_size=5, max_size=25))
def test_it_does_and_says_the_same(late: bool, events: list[tuple[tuple[object, ...], int, bool]]) -> None:
    # With a robot that acts on what it hears later, all are decided at every tick.
    models = replace(P2AT, battery_wh=0.01), replace(P2AT, delay=0.05 * late), P2AT
    with pytest.MonkeyPatch.context() as patch:
        for name, model in zip(NAMES, models, strict=True):
            patch.setitem(MODELS._found, name, replace(model, name=name))
        both = settling, deciding = world(), world()
        driven = {name: (Twist(0.4, 0.0), True) for name in NAMES}
        for what, looks, alive in [*events, (("limit", "plain", 0.3), 40, True)]:
            for each in both:
                happen(each, *what)  # type: ignore[arg-type]
            if what[0] == "drive":
                driven[str(what[1])] = what[2], what[3]  # type: ignore[assignment]
            for tick in range(LOOK * looks):
                if alive and tick % LOOK == 1:
                    for each in both:
                        for name, (twist, armed) in driven.items():
                            each.drive(name, twist, armed)
                deciding._settled_until = -math.inf
                settling.step()
                deciding.step()
                deciding._decided = True
                now = settling.time
                assert settling.states() == deciding.states(), now
                assert settling.poses() == deciding.poses(), now
                assert [settling.robot(n).command for n in NAMES] == [deciding.robot(n).command for n in NAMES], now
