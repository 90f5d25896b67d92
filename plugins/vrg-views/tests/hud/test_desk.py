"""What the buttons, fields and clicks of a display mean."""

import math
from typing import Any

import pytest
from displays import GROUND, HOME, KEYS, ROBOT, START, desk, received, report, scene_of, seen, sent, state, status
from msgspec import structs

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Manual
from vrg.bus.pacing import LEASE
from vrg.hal.models.crazyflie import CRAZYFLIE
from vrg.types import Pose, Twist
from vrg.ui.deeds import NO_CLOCK
from vrg.ui.driving import SLOW, Driving, Hands
from vrg_views.hud import words
from vrg_views.hud.desk import Desk
from vrg_views.hud.form import Form
from vrg_views.hud.goals import OtherRobot, refusal
from vrg_views.hud.helm import Goal, Wish

RELEASED = [("player/ann/manual", Manual(forward=0.0, turn=0.0, lease=0.0))]


@pytest.fixture
def at() -> Desk:
    return desk()


def written(form: Form, *texts: str) -> Form:
    for index, text in enumerate(texts):
        form.enter(index)
        for sign in text:
            assert form.type(sign) is None
    return form


class TestGoals:
    @pytest.mark.parametrize(
        ("goal", "why"),
        [
            (Goal(9.0, 0.0), r"outside of the map, which reaches from x = -5 to 5 m and from y = -4 to 4 m"),
            (Goal(math.nan, 0.0), "outside of the map"),
            (Goal(math.inf, 0.0), "outside of the map"),
            (Goal(4.9, 0.0), "nearer to the map's border than the 0.35 m"),
            (Goal(2.1, 0.5), "in a wall"),
            (Goal(1.8, 0.0), "0.20 m from a wall, and the robot needs 0.35 m"),
            (Goal(-1.0, 1.2), "where bob stands"),
        ],
    )
    def test_a_goal_where_the_robot_cannot_stand_is_refused(self, goal: Goal, why: str) -> None:
        told = refusal(goal, GROUND, [OtherRobot("bob", (-1.0, 1.0), (0.0, 0.0), 0.35)])
        assert told is not None
        assert why in told

    def test_a_free_place_and_one_that_a_moving_robot_leaves_are_good(self) -> None:
        assert refusal(Goal(0.0, 0.0), GROUND) is None
        assert refusal(Goal(-1.0, 1.0), GROUND, [OtherRobot("bob", (-1.0, 1.0), (0.5, 0.0), 0.35)]) is None

    def test_a_refused_goal_leaves_the_old_one_and_says_so(self, at: Desk) -> None:
        assert at.aim(1.0, 1.0)
        assert not at.aim(99.0, 0.0)
        assert at.goal == Goal(1.0, 1.0)
        assert "outside of the map" in at.notice
        assert at.notice.endswith("The goal stays (1.00, 1.00).")
        assert at.aim(0.0, 0.0)
        assert at.notice == ""


class TestForm:
    def test_what_is_typed_is_the_goal(self) -> None:
        assert written(Form(), "1.5", "-2", "90").read() == Goal(1.5, -2.0, math.pi / 2)

    def test_the_heading_may_be_empty_and_turns_once_around(self) -> None:
        assert written(Form(), "0", "0").read() == Goal(0.0, 0.0, None)
        found = written(Form(), "0", "0", "450").read()
        assert isinstance(found, Goal)
        assert found.heading == pytest.approx(math.pi / 2)

    @pytest.mark.parametrize("sign", ["g", ",", " ", "é"])
    def test_a_character_that_is_in_no_number_is_refused(self, sign: str) -> None:
        form = written(Form(), "1")
        assert form.type(sign) == f"x: expected digits, a sign or a point, got {sign!r}"
        assert form.texts[0] == "1"

    @pytest.mark.parametrize("texts", [("", "1"), ("1", "--"), ("1.2.3", "0"), ("1", "2", "+")])
    def test_what_is_no_number_is_told(self, texts: tuple[str, ...]) -> None:
        told = written(Form(), *texts).read()
        assert isinstance(told, str)
        assert "expected a number of" in told

    def test_the_first_character_replaces_the_text_and_backspace_takes_the_last(self) -> None:
        form = written(Form(), "12")
        form.enter(0)
        form.type("3")
        form.type("4")
        form.erase()
        assert form.texts[0] == "3"

    def test_tab_goes_round(self) -> None:
        form = Form()
        found = []
        for by in (1, 1, 1, 1, -1):
            form.step(by)
            found.append(form.focus)
        assert found == [0, 1, 2, 0, 2]

    def test_a_goal_is_shown_in_degrees(self) -> None:
        form = Form()
        form.show(Goal(1.234, -0.001, math.pi))
        assert form.texts == ["1.23", "0.00", "180"]


class TestDriving:
    def test_nothing_is_said_while_the_person_only_watches(self, at: Desk) -> None:
        at.send(seen(), Hands(1.0, enabled=True), 1.0)
        assert sent(at.driving.mailbox) == []
        assert at.where == "Watch"

    def test_by_hand_what_flies_climbs_and_what_drives_does_not(self) -> None:
        for robot, climb in ((ROBOT, 0.0), (CRAZYFLIE, -SLOW)):
            at = Desk(Driving(Mailbox(), KEYS), "ann", robot, GROUND, HOME)
            at.want(Wish.MANUAL, seen())
            at.send(seen(), Hands(climb=-1.0, enabled=True), 1.0)
            [(_, down)] = sent(at.driving.mailbox)
            assert down == Manual(forward=0.0, turn=0.0, climb=climb, lease=LEASE)

    def test_goto_drives_to_the_goal(self, at: Desk) -> None:
        at.aim(0.0, 0.0)
        at.want(Wish.GOTO, seen())
        at.send(seen(), Hands(), 1.0)
        [(key, ahead)] = sent(at.driving.mailbox)
        assert key == "player/ann/manual"
        assert isinstance(ahead, Manual)
        assert ahead.forward > 0.9
        assert ahead.lease == LEASE
        assert at.where == "Goto/Drive"

    def test_goto_takes_what_stands_in_the_fields(self, at: Desk) -> None:
        written(at.form, "-1", "1")
        at.want(Wish.GOTO, seen())
        assert (at.goal, at.wish) == (Goal(-1.0, 1.0), Wish.GOTO)
        written(at.form, "0", "1")
        at.want(Wish.GOTO, seen())
        assert (at.goal, at.wish) == (Goal(0.0, 1.0), Wish.GOTO), "a new goal is no second press"

    @pytest.mark.parametrize("texts", [(), ("9", "0"), ("1",)])
    def test_goto_without_a_good_goal_does_not_begin(self, at: Desk, texts: tuple[str, ...]) -> None:
        written(at.form, *texts)
        at.want(Wish.GOTO, seen())
        assert at.wish is Wish.WATCH
        assert at.notice
        at.send(seen(), Hands(), 1.0)
        assert sent(at.driving.mailbox) == []

    def test_manual_asks_for_what_the_hands_hold(self, at: Desk) -> None:
        at.want(Wish.MANUAL, seen())
        at.send(seen(), Hands(1.0, 0.5, enabled=True), 1.0)
        at.send(seen(), Hands(1.0, 0.5), 1.0)
        at.send(seen(), Hands(1.0, 0.0, enabled=True, turbo=True), 1.0)
        slow, still, fast = (body for _, body in sent(at.driving.mailbox))
        assert slow == Manual(forward=SLOW, turn=SLOW / 2, lease=LEASE)
        assert still == Manual(forward=0.0, turn=0.0, lease=LEASE)
        assert fast == Manual(forward=1.0, turn=0.0, lease=LEASE)

    def test_reset_drives_home(self, at: Desk) -> None:
        at.want(Wish.RESET, seen())
        at.send(seen(Pose(0.0, 0.0, math.pi)), Hands(), 1.0)
        [(_, ahead)] = sent(at.driving.mailbox)
        assert isinstance(ahead, Manual)
        assert ahead.forward > 0.9
        assert at.way(seen(Pose(0.0, 0.0, 0.0))) == [(HOME.x, HOME.y)]

    def test_a_motion_that_is_too_fast_keeps_its_curve(self, at: Desk) -> None:
        at.aim(-3.0, 2.0)
        at.want(Wish.GOTO, seen())
        at.send(seen(), Hands(), 1.0)
        [(_, aside)] = sent(at.driving.mailbox)
        assert isinstance(aside, Manual)
        assert aside.turn == 1.0

    @pytest.mark.parametrize("wish", [Wish.GOTO, Wish.MANUAL, Wish.RESET])
    @pytest.mark.parametrize("how", ["again", "release"])
    def test_the_robot_is_given_back_at_once(self, at: Desk, wish: Wish, how: str) -> None:
        at.aim(0.0, 0.0)
        at.want(wish, seen())
        if how == "release":
            at.release()
        else:
            at.want(wish, seen())
        at.send(seen(), Hands(1.0, enabled=True), 1.0)
        assert sent(at.driving.mailbox) == RELEASED

    def test_a_robot_that_another_person_drives_is_not_taken(self, at: Desk) -> None:
        taken = seen(report=received(report(manual=True), 1.0))
        at.want(Wish.MANUAL, taken)
        assert at.wish is Wish.WATCH
        assert "driven by another person" in at.notice
        assert at.holder(taken) == words.ANOTHER

    def test_its_own_lease_is_not_taken_for_another_persons(self, at: Desk) -> None:
        at.driving.mailbox.handover(1.0)
        at.want(Wish.MANUAL, seen())
        at.release()
        echo = seen(now=1.1, report=received(report(manual=True), 1.1))
        assert at.holder(echo) == words.OWN_STRATEGY
        at.want(Wish.MANUAL, echo)
        assert at.wish is Wish.MANUAL

    @pytest.mark.parametrize("lost", [{"pose": None, "pose_age": None}, {"pose_age": 0.5}])
    def test_without_a_fresh_pose_it_stands(self, at: Desk, lost: dict[str, Any]) -> None:
        at.aim(0.0, 0.0)
        at.want(Wish.GOTO, seen())
        blind = seen(**lost)
        at.send(blind, Hands(), 1.0)
        assert sent(at.driving.mailbox) == [("player/ann/manual", Manual(forward=0.0, turn=0.0, lease=LEASE))]
        assert at.hindrance(blind, scene_of(blind)) == words.NO_POSE
        assert at.way(blind) == []

    def test_other_robots_are_driven_around(self, at: Desk) -> None:
        at.see([OtherRobot("bob", (-1.5, 0.0), (0.0, 0.0), 0.35)])
        at.aim(0.0, 0.0)
        at.want(Wish.GOTO, seen())
        assert len(at.way(seen())) > 1


class TestWhatIsTold:
    def test_who_holds_the_lease(self, at: Desk) -> None:
        assert at.holder(seen()) == words.OWN_STRATEGY
        assert at.holder(seen(me=status("ann", START, lease=Twist(0.1, 0.0)))) == words.REFEREE
        at.want(Wish.MANUAL, seen())
        assert at.holder(seen()) == words.YOU_SOON
        assert at.holder(seen(report=received(report(manual=True), 1.0))) == words.YOU

    @pytest.mark.parametrize(
        ("changes", "why"),
        [
            ({}, ""),
            ({"live": False}, NO_CLOCK),
            ({"state": None, "me": None}, words.NO_REFEREE),
            ({"state": state(estop=True)}, "emergency stop: only an official releases it"),
            ({"report": received(report(estop=True))}, "emergency stop: only an official releases it"),
            ({"state": state(halted="a foul")}, "play is halted: only an official continues it"),
            ({"state": state(status("ann", START, lease=Twist(0.1, 0.0)))}, "the referee drives it"),
            ({"report": received(report(fault="a motor is hot"))}, "a motor is hot"),
            ({"state": state(status("ann", START, may_move=False))}, "it may not move now"),
            ({"pose_age": 1.0}, words.NO_POSE),
        ],
    )
    def test_what_keeps_the_robot_from_being_driven(self, at: Desk, changes: dict[str, Any], why: str) -> None:
        found = seen(**changes)
        assert at.hindrance(found, scene_of(found)) == why

    def test_the_situation_holds_the_margin_of_the_robot(self, at: Desk) -> None:
        found = at.situation(seen(), Hands())
        assert found is not None
        assert found.margin >= GROUND.radius
        assert structs.asdict(found)["goal"] == HOME, "there is no goal yet"
