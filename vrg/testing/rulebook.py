"""The contract of every rule book. A game's test subclasses RuleBookContract and gives it a rule book and a field."""

import random
from typing import Any

import msgspec
import pytest

from vrg.bus.messages import OfficialAction, RefereeState, Stage
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Observation, RuleBook
from vrg.errors import ConfigError
from vrg.types import Pose

SEED = 7
TICK_DISTANCE = 0.15
"""m that a player wanders in a tick of the tests: 1.5 m/s."""


class RuleBookContract:
    """Subclasses provide two fixtures: `book`, a fresh rule book; `ready`, a field on which its first round begins."""

    def test_it_has_what_everybody_is_shown(self, book: RuleBook[Any]) -> None:
        assert book.name
        assert book.round_word
        assert book.rounds >= 1
        assert book.lineup_limit > 0
        assert book.initial().round == 1

    def test_the_first_round_begins_on_the_field_that_is_ready(self, book: RuleBook[Any], ready: Observation) -> None:
        assert book.obstacles_to_start(book.initial(), ready) == {}

    def test_nobody_begins_without_players_in_the_world(self, book: RuleBook[Any]) -> None:
        obstacles = book.obstacles_to_start(book.initial(), Observation({}))
        assert set(obstacles) <= {
            status.name for status in book.statuses(book.initial(), Stage.INITIALIZE, Observation({}))
        }
        assert obstacles, "expected a reason for each player that is not there"

    @pytest.mark.parametrize("stage", list(Stage))
    def test_every_player_has_a_status_in_every_stage(
        self, book: RuleBook[Any], ready: Observation, stage: Stage
    ) -> None:
        state = book.initial()
        statuses = book.statuses(state, stage, ready)
        names = [status.name for status in statuses]
        assert len(set(names)) == len(names) > 0
        assert set(names) == {status.name for status in book.statuses(state, Stage.INITIALIZE, ready)}
        assert {status.team for status in statuses} <= set(book.score(state)), "every team has a score"

    def test_its_state_survives_the_journal(self, book: RuleBook[Any], ready: Observation) -> None:
        state = book.judge(book.initial(), ready, ready, 0.1).state
        written = msgspec.json.encode(state)
        assert msgspec.json.decode(written, type=book.state_type) == state

    def test_judging_is_a_function_of_what_is_judged(self, book: RuleBook[Any], ready: Observation) -> None:
        state = book.initial()
        before, now = ready, _wandered(ready, random.Random(SEED))
        first, second = (book.judge(state, before, now, 0.1) for _ in range(2))
        assert first == second
        assert state == book.initial(), "the state that was handed in is as it was"

    def test_no_players_place_in_the_list_decides(self, book: RuleBook[Any], ready: Observation) -> None:
        now = _wandered(ready, random.Random(SEED))
        turned = Observation(dict(reversed(list(now.poses.items()))), now.moving, now.physical)
        forward = book.judge(book.initial(), ready, now, 0.1)
        backward = book.judge(book.initial(), ready, turned, 0.1)
        assert forward.state == backward.state
        assert sorted(call.text for call in forward.calls) == sorted(call.text for call in backward.calls)

    def test_zones_have_names_of_their_own_and_can_be_drawn(self, book: RuleBook[Any]) -> None:
        zones = book.zones(book.initial())
        assert len({zone.name for zone in zones}) == len(zones)
        assert all(len(zone.region.outline()) >= 3 for zone in zones)

    def test_top_speeds_are_above_zero(self, book: RuleBook[Any]) -> None:
        assert all(speed > 0 for speed in book.speed_limits().values())

    @pytest.mark.parametrize("action", [OfficialAction.SET_SCORE, OfficialAction.SET_ROLE, OfficialAction.SET_STATE])
    def test_an_impossible_decision_is_refused_in_words(self, book: RuleBook[Any], action: OfficialAction) -> None:
        with pytest.raises(ConfigError):
            book.overrule(book.initial(), action, "nobody of this name", "nothing of this kind")

    def test_players_that_wander_about_never_break_it(self, book: RuleBook[Any], ready: Observation) -> None:
        """Whatever happens on the field, a match goes on, and what is published and journalled can be read again."""
        rng, match, now = random.Random(SEED), Match(book), ready
        for _ in range(600):
            match.step(0.1, now, [])
            if match.stage is Stage.INITIALIZE:
                marks = {name: match.mark(name, now) for name in match.names}
                now = Observation({name: mark or now.poses[name] for name, mark in marks.items()})
            else:
                now = _wandered(now, rng)
            state = match.state(now, estop=False)
            assert msgspec.msgpack.decode(msgspec.msgpack.encode(state), type=RefereeState) == state
            if match.over:
                break
        standing = match.standing()
        written = msgspec.json.decode(msgspec.json.encode(standing), type=type(standing))
        assert Match(book, written).game == match.game


def _wandered(field: Observation, rng: random.Random) -> Observation:
    """The same players a tick later."""
    poses = {
        name: Pose(
            pose.x + rng.uniform(-TICK_DISTANCE, TICK_DISTANCE),
            pose.y + rng.uniform(-TICK_DISTANCE, TICK_DISTANCE),
            pose.theta,
        )
        for name, pose in field.poses.items()
    }
    return Observation(poses, frozenset(poses), field.physical)
