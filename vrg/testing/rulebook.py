"""The contract of every rule book. A game's test subclasses RuleBookContract and gives it a rule book and a field."""

from typing import Any, ClassVar, Final

import pytest

from vrg.bus.messages import OfficialAction, Stage
from vrg.coordinator.rulebook import Observation, RuleBook
from vrg.errors import ConfigError
from vrg.testing.leap import PERIOD, leap
from vrg.testing.trial import KEEP, trial

TRIALS: Final = 60
"""The seeds of whole matches."""
LEAPS: Final = 400
"""The seeds of long ways between two looks."""


class RuleBookContract:
    """Subclasses provide two fixtures: `book`, a fresh rule book; `ready`, a field on which its first round begins.

    Attributes:
        endless: True if a match in which nothing happens goes on until an official ends it.
        by_looks: the rules that are judged by where players are at a look, and not by their ways between two looks.
    """

    endless: ClassVar[bool] = False
    by_looks: ClassVar[frozenset[str]] = frozenset()

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

    def test_a_score_that_an_official_sets_stands(self, book: RuleBook[Any], ready: Observation) -> None:
        """It may also be refused in words."""
        for team in book.score(book.initial()):
            try:
                state = book.overrule(book.initial(), OfficialAction.SET_SCORE, team, "9")
            except ConfigError:
                continue
            later = book.judge(state, ready, ready, PERIOD).state
            for when, score in (("at once", book.score(state)), ("after the next look", book.score(later))):
                said = f"`set-score {team} 9` is announced, and {when} the score is {score}"
                assert score[team] == 9, f"{said}{KEEP}"

    def test_it_keeps_its_promises_whatever_happens(self, book: RuleBook[Any], ready: Observation) -> None:
        for seed in range(TRIALS):
            trial(book, ready, seed, endless=self.endless)

    def test_what_happens_between_two_looks_is_judged(self, book: RuleBook[Any], ready: Observation) -> None:
        for seed in range(LEAPS):
            leap(book, ready, seed, self.by_looks)
