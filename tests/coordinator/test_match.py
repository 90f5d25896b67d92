"""The stages of Algorithm 3.1 and what an official may do, with a rule book made for it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from vrg.bus.messages import Official, OfficialAction, Stage, Thing
from vrg.config.loading import load_match
from vrg.config.rules import rulebook_of
from vrg.coordinator.decisions import decide
from vrg.coordinator.match import BY_HAND, PLACE_AGAIN, SPOT_PATIENCE, Match
from vrg.coordinator.outcome import Effects
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict
from vrg.hal.sim.config import BodySetup
from vrg.runs.result import ended_of
from vrg.types import Pose
from vrg.ui.banner import banners
from vrg.ui.scene import Scene


class Book(RuleBook[GameState]):
    """A game of two rounds: a player scores by being right of x = 10, fouls left of x = 0; 3 points end a round."""

    name = "test-game"
    rounds = 2
    state_type = GameState

    def __init__(self) -> None:
        super().__init__([Contestant(name="a", role="team", start=Pose(0, 0, 0), size=(0.5, 0.3), v_max=50.0)])

    def initial(self) -> GameState:
        return GameState()

    def marks(self, state: GameState) -> dict[str, Pose]:
        return {"a": Pose(0, 0, 0)}

    def obstacles_to_start(self, state: GameState, now: Observation) -> dict[str, str]:
        return {} if "a" in now.poses and now.poses["a"].x < 5 else {"a": "is not at home"}

    def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        x = now.poses["a"].x
        if x < 0:
            return Verdict(state, [_call("foul")])
        if x > 10:
            points = self.score(state)["team"] + 1
            return Verdict(state.with_points("team", points), [_call("goal")], round_over=points % 3 == 0)
        return Verdict(state)

    def next_round(self, state: GameState, now: Observation) -> Verdict[GameState]:
        if state.round == 2:
            return Verdict(state, winner="team" if state.points["team"] > 3 else "nature")
        return super().next_round(state, now)


def _call(rule: str) -> Call:
    return Call(rule=rule, text=rule, players=("a",), poses=(Pose(0, 0, 0),))


A = frozenset({"a"})


def at(x: float, **more: Any) -> Observation:
    return Observation({"a": Pose(x, 0, 0)}, **more)


def playing() -> Match:
    match = Match(Book())
    outcome = match.step(0.1, at(1), [])
    assert (match.stage, rules(outcome), outcome.stages) == (Stage.PLAY_ROUND, ["begin"], [Stage.PLAY_ROUND])
    return match


@pytest.fixture
def match() -> Match:
    """One in play."""
    return playing()


@pytest.fixture
def finished(match: Match) -> Match:
    """One whose last round is over."""
    play(match, [11, 11, 11, *[1] * 22, 11, 11, 11])
    return match


def decided(
    match: Match, action: OfficialAction, *words: str, now: Observation | None = None, absent: Sequence[str] = ()
) -> Effects:
    """What a decision of Ann about a subject, with a value, leads to."""
    subject, value = (*words, None, None)[:2]
    told = Official(action=action, by="ann", reason="because", subject=subject, value=value, id="7")
    return decide(match, told, now or at(1), absent)


def way_out(match: Match, *missing: str) -> str | None:
    match.step(0.1, at(1), missing)
    return match.state(at(1), estop=False).way_out


def rules(outcome: Effects) -> list[str]:
    return [f.rule for f in outcome.calls]


def play(match: Match, xs: Sequence[float]) -> list[str]:
    return called(match, *map(at, xs))


def called(match: Match, *fields: Observation) -> list[str]:
    return [rule for now in fields for rule in rules(match.step(0.1, now, []))]


def test_a_match_waits_for_its_conditions_and_lists_what_is_missing() -> None:
    match = Match(Book())
    assert not match.step(0.1, at(7), ["b does not report"])
    assert match.stage is Stage.INITIALIZE
    assert match.waiting == ["b does not report", "the line-up (0 s): a is not at home"]
    assert match.clock == 0.0


def test_the_time_of_the_line_up_is_told_and_when_robots_are_placed_if_any_can_be() -> None:
    match = Match(Book())
    play(match, [7] * 40)
    assert match.waiting == ["the line-up (4 s of at most 60 s): a is not at home"]
    match.step(0.1, at(7.0, physical=A), [])
    assert match.waiting == ["the line-up (4 s): a is not at home"]


def test_the_clock_runs_in_play_alone(match: Match) -> None:
    play(match, [1] * 10)
    assert match.clock == pytest.approx(1.0)
    assert play(match, [-1]) == ["foul"]
    assert match.clock == pytest.approx(1.1), "a foul does not stop play"
    match.halt("because")
    play(match, [1] * 10)
    assert match.clock == pytest.approx(1.1)


def test_a_round_ends_then_the_next_is_set_up(match: Match) -> None:
    assert play(match, [11, 11, 11]) == ["goal"] * 3
    assert match.stage is Stage.ROUND_OVER
    stages = [stage for _ in range(25) for stage in match.step(0.1, at(1), []).stages]
    assert stages == [Stage.INITIALIZE, Stage.PLAY_ROUND]
    assert match.game.round == 2
    assert match.clock < 0.5
    assert match.total == pytest.approx(0.3 + match.clock), "the match's clock is not set back"


def test_the_game_ends_with_a_winner_and_stays_ended(finished: Match) -> None:
    assert play(finished, [1] * 25) == ["game_over"]
    assert finished.over
    assert finished.winner == "team"
    assert not finished.step(0.1, at(11), []), "nothing is judged any more"
    wrong = [action for action in OfficialAction if rules(decided(finished, action)) != ["refused"]]
    assert wrong == [], "nothing can be decided any more"
    again = Match(Book(), finished.standing())
    assert again.over
    assert again.halted is None


def test_the_last_call_can_still_be_overruled(finished: Match) -> None:
    play(finished, [1] * 5)
    decided(finished, OfficialAction.SET_SCORE, "team", "0")
    play(finished, [1] * 25)
    assert finished.winner == "nature"


def test_halt_stops_clock_and_robots_and_nothing_is_judged(match: Match) -> None:
    first = decided(match, OfficialAction.HALT)
    assert rules(first) == ["halt"]
    assert play(match, [11, -1]) == []
    assert match.clock == 0.0
    state = match.state(at(1), estop=False)
    assert state.halted == "called by ann (because)"
    assert not any(p.may_move for p in state.players)
    again = decided(match, OfficialAction.HALT)
    assert "halted already" in again.calls[0].text
    assert [f.answers for f in (*first.calls, *again.calls)] == ["7", "7"]


def test_what_moved_during_a_halt_is_not_swept(match: Match) -> None:
    match.halt("x")
    match.step(0.1, at(1), [])
    decided(match, OfficialAction.RESUME)
    seen: list[Observation] = []
    book_judge = match._book.judge

    def judge(state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        seen.append(before)
        return book_judge(state, before, now, clock)

    match._book.judge = judge
    match.step(0.1, at(4), [])
    assert seen == [at(4)]


def test_resume_is_refused_while_something_is_missing_or_nothing_is_halted_and_says_what(match: Match) -> None:
    assert rules(decided(match, OfficialAction.RESUME)) == ["refused"], "nothing is halted"
    match.halt("x")
    outcome = decided(match, OfficialAction.RESUME, absent=["b does not report"])
    assert rules(outcome) == ["refused"]
    assert "b does not report" in outcome.calls[0].text
    assert match.halted
    assert rules(decided(match, OfficialAction.RESUME)) == ["resume"]
    assert match.halted is None
    assert match.stage is Stage.PLAY_ROUND


def test_reasons_to_halt_add_up_are_told_once_and_still_fit_into_a_message(match: Match) -> None:
    match.halt("one")
    match.halt("two")
    assert not match.halt("one")
    assert match.halted == "one; two"
    match.halt("on")
    assert match.halted == "one; two; on", "a part of another reason is a reason of its own"
    for i in range(200):
        match.halt(f"reason number {i}")
    assert len(match.halted) <= 1500


def test_an_official_ends_a_match(match: Match) -> None:
    assert rules(decided(match, OfficialAction.END)) == ["ended"]
    assert match.over
    assert match.winner == "nobody"
    for told in (match, Match(Book(), match.standing())):
        state = told.state(at(1), estop=False)
        assert state.ended == ended_of(state) == "ended by ann (because)"
        shown = banners(Scene(live=True, stage=state.stage, ended=state.ended))
        assert shown[0].lines[0] == "Ended by ann (because)"
    assert Match(Book()).state(at(1), estop=False).ended is None


def test_an_official_overrules_and_the_call_says_so_and_an_impossible_decision_is_refused(match: Match) -> None:
    assert decided(match, OfficialAction.SET_SCORE, "team", "2").calls[0].text == "ann: set-score team 2 (because)"
    assert match.game.points == {"team": 2}
    outcome = decided(match, OfficialAction.SET_ROLE, "a", "b")
    assert rules(outcome) == ["refused"]
    assert "cannot be set in this game" in outcome.calls[0].text


def test_players_that_do_not_line_up_are_put_on_their_marks_again_and_again_but_not_while_one_is_absent() -> None:
    class Stubborn(Book):
        lineup_limit = 5.0

    match = Match(Stubborn())
    assert not any(match.step(0.1, at(7), ["a does not report"]) for _ in range(100))
    match = Match(Stubborn())
    placed = [i for i in range(300) if match.step(0.1, at(7), []).place]
    assert placed[0] in (49, 50)
    assert placed[1] - placed[0] == pytest.approx(PLACE_AGAIN / 0.1, abs=1)


def test_a_halt_says_how_it_is_left_and_what_is_in_the_way_but_does_not_repeat_its_reason(match: Match) -> None:
    assert way_out(match) is None
    match.halt("rain")
    assert way_out(match) == "An official continues play"
    solved = "An official continues play as soon as this is solved"
    assert way_out(match, "b does not report", "c does not report") == f"{solved}: b does not report; c does not report"
    match.halt("b does not report")
    assert way_out(match, "b does not report", "c does not report") == f"{solved}, and this: c does not report"
    assert (way_out(match, "b does not report") or "").startswith(solved)


def test_an_official_has_a_virtual_robot_put_on_its_mark_or_anywhere(match: Match) -> None:
    assert decided(Match(Book()), OfficialAction.PLACE, "a").place == {"a": Pose(0, 0, 0)}
    assert rules(decided(match, OfficialAction.PLACE, "a")) == ["refused"], "it has no mark now"
    outcome = decided(match, OfficialAction.PLACE, "a", "1.5 -2 90")
    assert outcome.place["a"].x == 1.5
    assert outcome.place["a"].theta == pytest.approx(1.5708, abs=1e-4)
    assert outcome.placed == {}
    assert rules(outcome) == [], "only the world knows whether there is room"
    assert outcome.once_placed is not None
    assert outcome.once_placed.text == "a is put at (1.50, -2.00), 90 degrees: by ann (because)"


def test_who_is_pushed_is_judged_where_it_stood_until_it_is_free_again(match: Match) -> None:
    assert called(match, at(1), at(-1, pushed=A), at(-2, pushed=A), at(-1), at(0.5)) == []
    assert called(match, at(-0.5)) == ["foul"], "it was free again, and has driven there"
    assert called(playing(), at(1), at(12, pushed=A)) == [], "nor does it gain by it"
    match = playing()
    assert called(match, at(1), at(-1, pushed=A), *[at(-1)] * 49) == []
    restarted = Match(Book(), match.standing())
    restarted.resume()
    for again in (match, restarted):
        assert called(again, at(-1), at(-1))[0] == "foul", "it had time to drive back"


def test_a_robot_that_cannot_have_driven_is_judged_where_it_is_and_not_on_a_way() -> None:
    seen: list[Observation] = []

    class Watching(Book):
        def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
            seen.append(before)
            return Verdict(state)

    match = Match(Watching())  # its player drives at most 50 m/s
    match.step(0.1, at(0.0, time=1.0), [])
    for step, (x, before) in enumerate([(4.0, 0.0), (9.4, 4.0), (15.0, 15.0), (20.4, 15.0), (10.0, 10.0)], 1):
        match.step(0.1, at(x, time=1.0 + 0.1 * step), [])
        assert seen[-1].poses["a"].x == before, f"step {step}"
    match.step(0.4, at(30.0, time=1.9), [])
    assert seen[-1].poses["a"].x == 10.0, "it had four times as long"


def test_an_official_says_where_a_physical_robot_has_been_put(match: Match) -> None:
    outcome = decided(match, OfficialAction.PLACE, "a", "1.5 -2 90", now=at(1, physical=A))
    assert outcome.place == {}
    assert (outcome.placed["a"].x, outcome.by) == (1.5, "ann")
    assert "a stands at (1.50, -2.00), 90 degrees: by ann" in outcome.calls[0].text


def test_where_a_physical_robot_stands_is_not_told_to_a_player_that_is_away(match: Match) -> None:
    """It would never hear it, and would drive on from a wrong place."""
    place = Official(action=OfficialAction.PLACE, by="ann", subject="a", value="1.5 -2 90")
    outcome = decide(match, place, at(1, physical=A), [], silent=["a"])
    assert rules(outcome) == ["refused"]
    assert "a does not report" in outcome.calls[0].text


@pytest.mark.parametrize(
    ("value", "why"),
    [("500 0 0", "expected a pose inside map courtyard"), ("20 -8.1 0", "is in a wall or obstacle"), ("20 -20 0", "")],
)
def test_a_physical_robot_stands_neither_outside_the_map_nor_in_a_wall(value: str, why: str) -> None:
    setup = load_match(Path("examples/mixed.toml"))
    now = Observation({player.name: player.pose for player in setup.players}, physical=frozenset(setup.physical))
    outcome = decided(Match(rulebook_of(setup)), OfficialAction.PLACE, setup.physical[0], value, now=now)
    assert rules(outcome) == (["refused"] if why else ["place"])
    assert why in outcome.calls[0].text
    assert bool(outcome.placed) is not bool(why)


@pytest.mark.parametrize(
    "words", [("a", "here"), ("a", "1 2"), ("a", "nan 0 0"), ("a", "1e9 0 0"), ("b",)], ids=" ".join
)
def test_a_place_that_is_none_is_refused(match: Match, words: Sequence[str]) -> None:
    assert rules(decided(match, OfficialAction.PLACE, *words)) == ["refused"]


def with_ball(x: float, *, lost: bool = False, robot: float = 1.0) -> Observation:
    return at(robot, things={"ball": Thing("ball", Pose(x, 0.0, 0.0), lost=lost)})


def match_with_ball(*, tracked: bool) -> Match:
    """One whose players, and a ball that belongs at x = 2, line up."""
    book, at_two = Book(), Pose(2.0, 0.0, 0.0)
    book.equip([
        BodySetup(name="ball", kind="ball", pose=at_two, radius=0.1, mass=0.5, height=0.2, friction=0.1,
                  restitution=0.3, tracked=tracked),
    ])  # fmt: skip
    return Match(book)


def test_a_round_waits_for_a_real_ball_that_people_put_on_its_spot() -> None:
    match = match_with_ball(tracked=True)
    rolling = with_ball(2.0)
    rolling = replace(rolling, things={"ball": structs.replace(rolling.things["ball"], vx=0.12, vy=-0.12)})
    for seen in (with_ball(2.0, lost=True), with_ball(2.0 + BY_HAND + 0.01), rolling):
        for _ in range(round((Book.lineup_limit + 2 * PLACE_AGAIN) / 10.0)):
            outcome = match.step(10.0, seen, [])
            assert (match.stage, rules(outcome), outcome.place) == (Stage.INITIALIZE, [], {})
            assert match.waiting == ["ball does not lie at (2, 0): put it there"]
    assert rules(match.step(0.1, with_ball(2.0 + BY_HAND - 0.01), [])) == ["begin"]


def test_the_world_puts_a_virtual_ball_on_its_spot() -> None:
    match = match_with_ball(tracked=False)
    assert match.step(0.1, with_ball(2.0 + BY_HAND - 0.01), []).place == {"ball": Pose(2.0, 0.0, 0.0)}
    assert match.waiting == []
    assert rules(match.step(2 * SPOT_PATIENCE, with_ball(1.0), [])) == ["begin"], "a robot may stand there"


def test_the_world_is_not_asked_to_put_a_real_ball_anywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    places = {"ball": Pose(3.0, 0.0, 0.0), "a": Pose(0.0, 0.0, 0.0)}
    monkeypatch.setattr(Book, "judge", lambda _self, state, *_: Verdict(state, place=places))
    for tracked, asked in ((True, {"a"}), (False, {"a", "ball"})):
        match = match_with_ball(tracked=tracked)
        match.step(0.1, with_ball(2.0), [])
        assert match.step(0.1, with_ball(2.0), []).place.keys() == asked


def test_a_body_is_judged_where_it_was_put_also_before_the_world_has_put_it_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The world of another process does that a look later, and a rule about where a ball is would be called twice."""

    def out(_self: Book, state: GameState, before: Observation, now: Observation, _clock: float) -> Verdict[GameState]:
        seen.append((before.things["ball"].pose.x, now.things["ball"].pose.x, now.things["ball"].vx))
        if now.things["ball"].pose.x < 10.0:
            return Verdict(state)
        return Verdict(state, [Call(rule="out", text="out")], place={"ball": Pose(2.0, 0.0, 0.0)})

    seen: list[tuple[float, float, float]] = []
    monkeypatch.setattr(Book, "judge", out)
    match = match_with_ball(tracked=False)
    match.step(0.1, with_ball(2.0), [])
    rolls = with_ball(11.0)
    rolls = replace(rolls, things={"ball": structs.replace(rolls.things["ball"], vx=1.0)})
    called = []
    for look, now in enumerate((with_ball(9.0), rolls, rolls, with_ball(2.1), with_ball(2.2), rolls)):
        called += rules(match.step(0.1, replace(now, time=0.1 * look), []))
    assert called == ["out", "out"], "once when it went out, and once when it went out again"
    assert seen == [
        (2.0, 9.0, 0.0),
        (9.0, 11.0, 1.0),
        (11.0, 2.0, 0.0),
        (2.0, 2.1, 0.0),
        (2.1, 2.2, 0.0),
        (2.2, 11.0, 1.0),
    ]
    stuck = [rules(match.step(0.1, replace(rolls, time=2.0 + 0.1 * look), [])) for look in range(40)]
    assert 1 <= sum(map(len, stuck)) <= 4, "it is not waited for for ever"
