"""Who may command a robot, from the strongest to the weakest."""

import re
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.hal.fake_driver import MODEL, POSE, FakeDriver
from vrg.agents.planner import Planner
from vrg.agents.player import NONSENSE_LIMIT, Player
from vrg.agents.strategy import Action, Strategy, View
from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.radio import Radio
from vrg.bus.topics import Keys
from vrg.errors import StrategyError
from vrg.hal.device import Device
from vrg.hal.gate import REFEREE_TIMEOUT
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.spec import Sample
from vrg.types import STILL, Twist

KEYS = Keys("m")


class Ahead(Strategy):
    """Drives ahead, and counts how often it was asked."""

    asked = 0

    def act(self, view: View) -> Twist:
        self.asked += 1
        return Twist(0.35, 0.0)


class Bench:
    """A player whose referee, world and robot are played by the test."""

    def __init__(self) -> None:
        self.robot = FakeDriver()
        self.mailbox = Mailbox()
        self.strategy = Ahead("a", MODEL)
        device = Device(self.robot, KEYS, self.mailbox)
        radio = Radio(KEYS, self.mailbox, "a", "t")
        self.player = Player(self.mailbox, KEYS, device, self.strategy, team="t", radio=radio)
        self.time = 0.0
        self.sequence = 0
        self.robot.told.clear()

    def hear(self, body: m.Message, key: str = "k") -> None:
        self.sequence += 1
        for inlet in self.mailbox.inlets:
            if inlet.topic.type is type(body):
                inlet.offer(Received(key, self.time, self.sequence, body))

    def tick(self, *, referee: bool = True, live: bool = True, advance: float = 0.1, **state: Any) -> list[str]:
        """One tick; what the robot was told in it."""
        self.time += advance
        if referee:
            self.hear(referee_state(**state), "referee")
        self.robot.told.clear()
        self.mailbox.handover(self.time)
        self.player.tick(Tick(self.time, live))
        return list(self.robot.told)

    def sent(self) -> list[m.Message]:
        """What the player has published."""
        return [out.message.body for out in self.mailbox.collect()]

    def report(self) -> m.Report:
        body = self.sent()[-1]
        assert isinstance(body, m.Report)
        return body


def referee_state(
    may_move: bool = True, halted: str | None = None, estop: bool = False, name: str = "a"
) -> m.RefereeState:
    status = m.PlayerStatus(name=name, team="t", role="r", state="active", may_move=may_move, radius=0.35, pose=POSE)
    return m.RefereeState(
        game="g", stage=m.Stage.PLAY_ROUND, halted=halted, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=(status,), zones=(), estop=estop,
    )  # fmt: skip


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_the_strategy_drives_when_nothing_is_stronger(bench: Bench) -> None:
    told = bench.tick()
    assert told == ["arm", "drive 0.35 0.00"]
    assert bench.tick() == ["drive 0.35 0.00"], "it is armed once"


def test_a_report_tells_the_motion_that_the_robot_was_told_to_make(bench: Bench) -> None:
    bench.tick()
    assert bench.report().command == Twist(0.35, 0.0)
    bench.hear(m.SpeedLimit(v_max=0.2))
    bench.tick()
    assert bench.report().command == Twist(pytest.approx(0.2), 0.0), "after all limits"
    bench.tick(may_move=False)
    assert bench.report().command == STILL
    bench.tick(halted="a cable")
    assert bench.report().command is None, "it is not driven"


def test_a_report_tells_the_charge_of_the_battery_while_it_is_known(bench: Bench) -> None:
    bench.tick()
    assert bench.report().battery is None
    bench.robot.samples.append(Sample(0.0, 0.0, Battery(charge=0.6)))
    bench.tick()
    assert bench.report().battery == 0.6
    bench.robot.blind = True
    bench.tick()
    assert bench.report().battery is None


def test_a_new_player_reaches_its_robot_only_when_it_is_started_and_begins_disarmed(bench: Bench) -> None:
    assert bench.robot.told == []
    bench.player.start()
    assert bench.robot.told == ["connect", "disarm"]


def test_without_a_referee_nothing_moves(bench: Bench) -> None:
    assert bench.tick(referee=False) == ["stop"]
    assert bench.strategy.asked == 0


def test_a_silent_referee_stops_the_robot(bench: Bench) -> None:
    bench.tick()
    assert bench.tick(referee=False)[-1].startswith("drive")
    assert bench.tick(referee=False, advance=REFEREE_TIMEOUT) == ["stop"]
    assert bench.report().mode == "Stop/no referee"


def test_a_stopped_clock_stops_the_robot(bench: Bench) -> None:
    bench.tick()
    assert bench.tick(live=False) == ["stop"]
    assert bench.report().mode == "Stop/no clock"


def test_halt_stops_the_robot_and_it_stays_armed(bench: Bench) -> None:
    bench.tick()
    assert bench.tick(halted="x") == ["stop"]
    assert bench.tick()[-1].startswith("drive")


def test_who_may_not_move_stands_but_its_strategy_sees_what_happens(bench: Bench) -> None:
    bench.tick()
    asked = bench.strategy.asked
    assert bench.tick(may_move=False) == ["stop"]
    assert bench.strategy.asked == asked + 1


@pytest.mark.parametrize("way", ["message", "referee"])
def test_an_emergency_stop_disarms_and_arms_again_only_when_released(bench: Bench, way: str) -> None:
    bench.tick()
    if way == "message":
        bench.hear(m.Estop(by="x"))
        assert bench.robot.told[-1] == "emergency stop", "it does not wait for a tick"
        assert bench.tick() == ["disarm"]
    else:
        assert bench.tick(estop=True) == ["emergency stop", "disarm"]
    assert bench.report().estop
    assert bench.tick(estop=way == "referee") == ["disarm"]
    bench.hear(m.EstopRelease(by="x"))
    assert bench.tick(halted="emergency stop by x") == ["release", "stop"], "released, but play is still halted"
    assert bench.tick()[0] == "arm"


def test_a_human_with_a_lease_drives_instead(bench: Bench) -> None:
    bench.tick()
    bench.hear(m.Manual(forward=-0.5, turn=0.0, lease=0.5), "manual")
    assert bench.tick() == [f"drive {-0.5 * MODEL.v_max:.2f} 0.00"]
    assert bench.report().manual


def test_when_the_lease_ends_the_player_is_its_own_again(bench: Bench) -> None:
    bench.tick()
    bench.hear(m.Manual(forward=0.0, turn=1.0, lease=0.3), "manual")
    bench.tick()
    own = "drive 0.35"
    told = [bench.tick()[-1] for _ in range(4)]
    assert not told[0].startswith(own)
    assert told[-1].startswith(own)


def test_a_lease_moves_nobody_who_may_not_move(bench: Bench) -> None:
    bench.tick()
    bench.hear(m.Manual(forward=1.0, turn=0.0, lease=1.0), "manual")
    assert bench.tick(may_move=False) == ["stop"]
    bench.hear(m.Manual(forward=1.0, turn=0.0, lease=1.0), "manual")
    assert bench.tick(halted="x") == ["stop"]


def test_a_blind_robot_stands_and_says_why(bench: Bench) -> None:
    bench.robot.blind = True
    assert bench.tick() == ["stop"]
    assert bench.report().fault == "a: no reading has come yet"


def test_old_readings_stop_the_robot(bench: Bench) -> None:
    bench.tick()
    bench.robot.age = 0.5
    assert bench.tick() == ["stop"]
    assert "0.5 s old" in (bench.report().fault or "")


def test_a_fault_of_the_robot_is_reported(bench: Bench) -> None:
    bench.robot.fault = "left wheel: over-current"
    assert bench.tick() == ["stop"]
    assert bench.report().fault == "left wheel: over-current"


def test_a_robot_that_lost_its_arming_stops_and_is_armed_again(bench: Bench) -> None:
    bench.tick()
    bench.robot.armed = False
    assert bench.tick()[0] == "arm"


def test_a_player_that_is_not_in_the_match_stands(bench: Bench) -> None:
    assert bench.tick(name="b") == ["stop"]
    assert bench.report().mode == "Stop/not in this match"


def test_at_the_end_the_robot_is_let_go(bench: Bench) -> None:
    bench.tick()
    bench.player.stop()
    assert bench.robot.told[-2:] == ["disarm", "close"]


def test_a_strategy_that_fails_is_not_swallowed(bench: Bench) -> None:
    def broken(_view: View) -> Twist:
        raise ZeroDivisionError

    bench.strategy.act = broken  # type: ignore[method-assign]
    with pytest.raises(StrategyError, match=r"ZeroDivisionError \(test_player\.py, line \d+, in broken\)") as caught:
        bench.tick()
    assert isinstance(caught.value.__cause__, ZeroDivisionError), "its traceback is kept for the log"


def test_a_strategy_may_stand_still(bench: Bench) -> None:
    bench.strategy.act = lambda _view: STILL  # type: ignore[method-assign]
    assert bench.tick() == ["arm", "stop"]


def test_a_fault_that_has_latched_is_reported_as_such(bench: Bench) -> None:
    bench.robot.fault, bench.robot.latched = "a: node 0: no heartbeat", True
    assert bench.tick() == ["stop"]
    report = bench.report()
    assert report.latched
    assert report.fault == "a: node 0: no heartbeat"
    bench.robot.fault, bench.robot.latched = None, False
    bench.tick()
    assert not bench.report().latched


def test_a_player_that_missed_the_release_is_freed_by_the_referees_newer_state(bench: Bench) -> None:
    bench.tick()
    bench.hear(m.Estop(by="x"))
    bench.tick(estop=True)
    assert bench.tick(estop=True) == ["disarm"]
    # The release got lost; the referee has heard it.
    assert bench.tick(halted="emergency stop by x") == ["release", "stop"]
    assert not bench.report().estop
    assert bench.tick()[0] == "arm"


def test_a_stop_that_the_referee_never_knew_of_is_not_ended_by_its_state(bench: Bench) -> None:
    bench.tick()
    bench.hear(m.Estop(by="x"))
    for _ in range(20):
        assert bench.tick()[-1] == "disarm"
    assert bench.report().estop, "so the referee comes to know of it"


def test_numpys_numbers_drive_as_pythons_do(bench: Bench) -> None:
    bench.strategy.act = lambda _view: Twist(np.float64(0.35), np.float32(0.5))  # type: ignore[method-assign]
    bench.tick()
    assert bench.tick() == ["drive 0.35 0.50"]


@pytest.mark.parametrize("answer", [None, 0.5, (0.5, 0.1), Twist("fast", 0.0), Twist(None, 0.0)])  # type: ignore[arg-type]
def test_an_answer_that_is_no_motion_names_the_strategy(bench: Bench, answer: object) -> None:
    bench.strategy.act = lambda _view: answer  # type: ignore[method-assign, assignment, return-value]
    with pytest.raises(StrategyError, match=r"Ahead\.act: expected a Twist.*\(test_player\.py, line \d+, in act\)"):
        bench.tick()


def test_a_motion_that_is_no_number_stops_the_robot_and_is_told(bench: Bench) -> None:
    bench.tick()
    bench.strategy.act = lambda _view: Twist(float("nan"), 0.0)  # type: ignore[method-assign]
    assert bench.tick() == ["stop"]
    assert "finite" in (bench.report().fault or "")
    bench.strategy.act = lambda _view: Twist(0.2, 0.0)  # type: ignore[method-assign]
    assert bench.tick() == ["drive 0.20 0.00"]
    assert bench.report().fault is None


def test_a_strategy_that_answers_nonsense_again_and_again_has_failed(bench: Bench) -> None:
    bench.tick()
    bench.strategy.act = lambda _view: Twist(0.0, float("inf"))  # type: ignore[method-assign]
    for _ in range(NONSENSE_LIMIT - 1):
        bench.tick()
    with pytest.raises(StrategyError, match=r"expected finite numbers of m/s and rad/s, got Twist\(v=0.0, w=inf\)"):
        bench.tick()


class Halving(Planner):
    """Halves each motion, and remembers what was wanted."""

    wanted: Twist | None = None

    def plan(self, view: View, twist: Twist) -> Twist:
        self.wanted = twist
        return Twist(np.float64(twist.v / 2), twist.w / 2)  # numpy's own numbers, as students write them


def test_a_planner_changes_what_the_strategy_and_a_human_want(bench: Bench) -> None:
    bench.strategy.planner = planner = Halving("a", MODEL)
    assert bench.tick()[-1] == "drive 0.17 0.00"
    assert planner.wanted == Twist(0.35, 0.0)
    bench.hear(m.Manual(forward=1.0, turn=0.0, lease=0.5))
    assert bench.tick()[-1] == "drive 0.35 0.00"
    planner.wanted = None
    assert bench.tick(may_move=False) == ["stop"]
    assert planner.wanted is None


def test_a_planner_is_not_asked_for_a_motion_that_is_not_finite(bench: Bench) -> None:
    bench.strategy.planner = planner = Halving("a", MODEL)
    bench.strategy.act = lambda _view: Twist(float("nan"), 0.0)  # type: ignore[method-assign]
    bench.tick()
    assert planner.wanted is None
    assert "Ahead.act: expected finite" in (bench.report().fault or "")


@pytest.mark.parametrize("answer", [None, Twist(float("nan"), 0.0), Twist("fast", 0.0)])
def test_a_planner_that_answers_nonsense_fails_with_its_name(bench: Bench, answer: Any) -> None:
    bench.strategy.planner = planner = Halving("a", MODEL)
    planner.plan = lambda _view, _twist: answer  # type: ignore[method-assign]
    with pytest.raises(StrategyError, match=r"Halving\.plan: expected"):
        bench.tick()


def test_a_strategy_that_ends_the_program_has_failed_like_any_other(bench: Bench) -> None:
    def leave(_view: View) -> Twist:
        sys.exit(0)

    bench.strategy.act = leave  # type: ignore[method-assign]
    with pytest.raises(StrategyError, match=r"SystemExit: 0 \(test_player\.py, line \d+, in leave\)"):
        bench.tick()


def test_a_player_that_gives_way_stands_and_says_why(bench: Bench) -> None:
    bench.tick()
    bench.robot.told.clear()
    bench.player.give_way("a: no idea")
    assert bench.robot.told == ["stop"]
    report = bench.report()
    assert (report.fault, report.mode) == ("a: no idea", "Stop/failed")


def test_what_a_player_says_goes_to_its_team_and_is_heard_there(bench: Bench) -> None:
    words = {"shark": np.array([1.0, 2.0]), "near": np.float64(0.5)}
    bench.strategy.act = lambda _view: Action(STILL, words)  # type: ignore[method-assign]
    bench.tick()
    said = next(body for body in bench.sent() if isinstance(body, m.Say))
    seen: list[View] = []
    bench.strategy.act = lambda view: seen.append(view) or STILL  # type: ignore[method-assign, func-returns-value]
    bench.hear(said, KEYS.say("t", "b").key)
    bench.hear(said, KEYS.say("t", "a").key)
    bench.tick()
    (heard,) = seen[0].heard
    assert heard.speaker == "b", "nobody hears itself"
    assert heard.words == {"shark": [1.0, 2.0], "near": 0.5}
    bench.tick()
    assert seen[1].heard == [], "what was heard once is not heard again"


def test_a_player_cannot_say_more_than_the_radio_carries(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    for number in range(100):
        told = telling(bench, Action(Twist(0.2, 0.1), "x" * (5000 + number // 50), sightings=[SIGHTING]))
        assert told == [m.Sightings(seen=(SIGHTING,))]
    assert bench.robot.told[-1] == "drive 0.20 0.10"
    assert "Ahead.act: say left out: expected at most 1024 bytes to be sent at a tick, got 5003" in caplog.text
    assert len(caplog.messages) == 2, "each text is logged once"


def test_a_loop_outside_may_look_and_drive_in_place_of_a_strategy(bench: Bench) -> None:
    bench.time = 0.1
    bench.hear(referee_state(), "referee")
    bench.mailbox.handover(bench.time)
    view = bench.player.look(Tick(bench.time))
    assert view is not None
    assert view.pose == POSE
    bench.player.drive(view, Action(Twist(0.2, 0.1)))
    assert bench.robot.told[-1] == "drive 0.20 0.10"
    assert bench.strategy.asked == 0


def telling(bench: Bench, action: Action) -> list[m.Message]:
    """What a player publishes besides its report when its strategy answers with this action."""
    bench.strategy.act = lambda view: action  # type: ignore[method-assign]
    bench.tick()
    return [body for body in bench.sent() if not isinstance(body, m.Report)]


SIGHTING = m.Sighting(x=1.0, y=2.0, time=0.1, xx=0.01, xy=0.0, yy=0.01)


def test_an_action_tells_the_referee_and_the_windows_what_it_holds(bench: Bench) -> None:
    action = Action(
        sightings=[SIGHTING],
        bids={"intruder1": np.float64(2.5), "intruder2": None},  # type: ignore[dict-item]
        sketch=[m.Stroke(points=[(np.float64(1.0), 2)], label="here")],
    )
    assert telling(bench, action) == [
        m.Sightings(seen=(SIGHTING,)),
        m.Bid(lot="intruder1", cost=2.5),
        m.Bid(lot="intruder2", cost=None),
        m.Sketch(strokes=(m.Stroke(points=((1.0, 2.0),), label="here"),)),
    ]


def test_an_action_that_says_nothing_publishes_nothing(bench: Bench) -> None:
    assert telling(bench, Action(Twist(0.1, 0.0))) == []


@pytest.mark.parametrize(
    "action",
    [
        Action(bids={"a": float("nan")}),
        Action(bids={"a": -1.0}),
        Action(bids={"a": "cheap"}),  # type: ignore[dict-item]
        Action(bids={"": 1.0}),
        Action(sightings=[m.Sighting(x=float("nan"), y=0.0, time=0.0, xx=1.0, xy=0.0, yy=1.0)]),
        Action(sightings=[SIGHTING] * 101),
        Action(sightings=["a robot"]),  # type: ignore[list-item]
        Action(sketch=[m.Stroke(points=())]),
        Action(sketch=[m.Stroke(points=((0.0, 0.0),), label="x" * 41)]),
        Action(bids=[1.0]),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_told_is_left_out_with_a_warning(
    bench: Bench, action: Action, caplog: pytest.LogCaptureFixture
) -> None:
    bench.tick()
    bench.sent()
    good: dict[str, Any] = {"sketch": []} if action.sketch is None else {"bids": {"b": 1.0}}
    assert telling(bench, replace(action, **good)) == (
        [m.Sketch(strokes=())] if "sketch" in good else [m.Bid(lot="b", cost=1.0)]
    )
    assert re.fullmatch(
        r"Ahead\.act: (bids|sightings|sketch) left out: .+ \(.*, line \d+, in act\)", caplog.messages[0]
    )


def test_what_the_radio_brought_is_published_once_a_second_and_kept_for_the_result(bench: Bench) -> None:
    bench.tick()
    assert bench.player.counted() == {"radio": {}}
    bench.sent()
    for _ in range(25):
        bench.hear(m.Say(words=b"\x01", place=(0.0, 0.0)), KEYS.say("t", "b").key)
        bench.tick()
    published = [body for body in bench.sent() if isinstance(body, m.Links)]
    assert len(published) == 3
    [link] = published[-1].links
    assert (link.speaker, link.lost) == ("b", 0)
    assert bench.player.counted()["radio"]["b"]["arrived"] == 25
