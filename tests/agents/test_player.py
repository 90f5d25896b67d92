"""Who may command a robot, from the strongest to the weakest."""

import re
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from tests.agents.bench import KEYS, Bench, referee_state
from tests.hal.fake_driver import MODEL, POSE
from vrg.agents.player import NONSENSE_LIMIT
from vrg.agents.strategy import Action, Strategy, View
from vrg.bus import messages as m
from vrg.bus.node import Tick
from vrg.errors import StrategyError
from vrg.hal.permission import REFEREE_TIMEOUT
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.spec import Sample
from vrg.types import STILL, Twist


class Ahead(Strategy):
    """Drives ahead, and counts how often it was asked."""

    asked = 0

    def act(self, view: View) -> Twist:
        self.asked += 1
        return Twist(0.35, 0.0)


@pytest.fixture
def new() -> Bench[Ahead]:
    """One that was never ticked."""
    return Bench(Ahead("a", MODEL))


@pytest.fixture
def bench(new: Bench[Ahead]) -> Bench[Ahead]:
    """One that drives."""
    assert new.tick() == ["arm", "drive 0.35 0.00"]
    return new


@pytest.mark.parametrize(
    ("happens", "mode"),
    [
        ({"referee": False, "advance": REFEREE_TIMEOUT + 0.1}, "Stop/no referee"),
        ({"live": False}, "Stop/no clock"),
        ({"halted": "x"}, None),
        ({"may_move": False}, None),
        ({"name": "z"}, "Stop/not in this match"),
    ],
    ids=["the referee is silent", "the clock has stopped", "play is halted", "it may not move", "not in the match"],
)
def test_it_drives_when_nothing_is_stronger_stands_while_something_is_and_drives_again(
    bench: Bench[Ahead], happens: dict[str, Any], mode: str | None
) -> None:
    assert bench.tick() == ["drive 0.35 0.00"], "it is armed once"
    assert bench.tick(referee=False) == ["drive 0.35 0.00"], "one message may be late"
    asked = bench.strategy.asked
    assert bench.tick(**happens) == ["stop"]
    assert mode in (None, bench.report().mode)
    assert bench.strategy.asked - asked == ("may_move" in happens), "who stands by the rules sees what happens"
    assert bench.tick() == ["drive 0.35 0.00"], "it stays armed"


def test_a_report_tells_the_motion_that_the_robot_was_told_to_make(bench: Bench[Ahead]) -> None:
    assert bench.report().command == Twist(0.35, 0.0)
    bench.hear(m.SpeedLimit(v_max=0.2))
    bench.tick()
    assert bench.report().command == Twist(pytest.approx(0.2), 0.0), "after all limits"
    bench.tick(may_move=False)
    assert bench.report().command == STILL
    bench.tick(halted="a cable")
    assert bench.report().command is None, "it is not driven"


def test_a_report_tells_the_charge_of_the_battery_while_it_is_known(bench: Bench[Ahead]) -> None:
    assert bench.report().battery is None
    bench.robot.samples.append(Sample(0.0, 0.0, Battery(charge=0.6)))
    bench.tick()
    assert bench.report().battery == 0.6
    bench.robot.blind = True
    bench.tick()
    assert bench.report().battery is None


def test_a_player_reaches_its_robot_when_it_is_started_disarms_it_and_lets_it_go_at_the_end(new: Bench[Ahead]) -> None:
    assert new.robot.told == []
    new.player.start()
    assert new.robot.told == ["connect", "disarm"]
    assert new.tick(referee=False) == ["stop"], "nothing moves without a referee"
    assert new.strategy.asked == 0
    new.tick()
    new.player.stop()
    assert new.robot.told[-2:] == ["disarm", "close"]


@pytest.mark.parametrize("way", ["message", "referee"])
def test_an_emergency_stop_disarms_and_arms_again_only_when_released(bench: Bench[Ahead], way: str) -> None:
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


def test_a_lease_moves_nobody_who_may_not_move(bench: Bench[Ahead]) -> None:
    bench.hear(m.Manual(forward=1.0, turn=0.0, lease=1.0))
    assert bench.tick(may_move=False) == ["stop"]
    bench.hear(m.Manual(forward=1.0, turn=0.0, lease=1.0))
    assert bench.tick(halted="x") == ["stop"]


@pytest.mark.parametrize(
    ("robot", "fault"),
    [
        ({"blind": True}, "no reading has arrived yet"),
        ({"age": 0.5}, "0.5 s old"),
        ({"fault": "left wheel: over-current"}, "left wheel: over-current"),
        ({"fault": "node 0: no heartbeat", "latched": True}, "node 0: no heartbeat"),
    ],
    ids=["blind", "old readings", "a fault", "a fault that has latched"],
)
def test_a_robot_that_is_not_well_stands_and_says_why(new: Bench[Ahead], robot: dict[str, Any], fault: str) -> None:
    for name, value in robot.items():
        setattr(new.robot, name, value)
    assert new.tick() == ["stop"]
    report = new.report()
    assert fault in (report.fault or "")
    assert report.latched is ("latched" in robot)
    new.robot.fault, new.robot.latched = None, False
    new.tick()
    assert not new.report().latched


def test_a_robot_that_lost_its_arming_stops_and_is_armed_again(bench: Bench[Ahead]) -> None:
    bench.robot.armed = False
    assert bench.tick()[0] == "arm"


def broken(_view: View) -> Twist:
    raise ZeroDivisionError


def leave(_view: View) -> Twist:
    sys.exit(0)


@pytest.mark.parametrize(
    ("act", "said", "cause"),
    [(broken, "ZeroDivisionError", ZeroDivisionError), (leave, "SystemExit: 0", SystemExit)],
    ids=["it raises", "it ends the program"],
)
def test_a_strategy_that_fails_is_not_swallowed(
    new: Bench[Ahead], act: Callable[[View], Twist], said: str, cause: type[BaseException]
) -> None:
    new.strategy.act = act  # type: ignore[method-assign]
    place = rf"{said} \(test_player\.py, line \d+, in {act.__name__}\)"
    with pytest.raises(StrategyError, match=place) as caught:
        new.tick()
    assert isinstance(caught.value.__cause__, cause), "its traceback is kept for the log"


def test_a_player_that_missed_the_release_is_freed_by_the_referees_newer_state(bench: Bench[Ahead]) -> None:
    bench.hear(m.Estop(by="x"))
    bench.tick(estop=True)
    assert bench.tick(estop=True) == ["disarm"]
    # The release got lost; the referee has heard it.
    assert bench.tick(halted="emergency stop by x") == ["release", "stop"]
    assert not bench.report().estop
    assert bench.tick()[0] == "arm"


def test_a_stop_that_the_referee_never_knew_of_is_not_ended_by_its_state(bench: Bench[Ahead]) -> None:
    bench.hear(m.Estop(by="x"))
    for _ in range(20):
        assert bench.tick()[-1] == "disarm"
    assert bench.report().estop, "so the referee comes to know of it"


def test_numpys_numbers_drive_as_pythons_do_and_a_strategy_may_stand_still(bench: Bench[Ahead]) -> None:
    bench.strategy.act = lambda _view: Twist(np.float64(0.35), np.float32(0.5))  # type: ignore[method-assign]
    assert bench.tick() == ["drive 0.35 0.50"]
    bench.strategy.act = lambda _view: STILL  # type: ignore[method-assign]
    assert bench.tick() == ["stop"]


@pytest.mark.parametrize("answer", [None, 0.5, (0.5, 0.1), Twist("fast", 0.0), Twist(None, 0.0)])  # type: ignore[arg-type]
def test_an_answer_that_is_no_motion_names_the_strategy(bench: Bench[Ahead], answer: object) -> None:
    bench.strategy.act = lambda _view: answer  # type: ignore[method-assign, assignment, return-value]
    with pytest.raises(StrategyError, match=r"Ahead\.act: expected a Twist.*\(test_player\.py, line \d+, in act\)"):
        bench.tick()


def test_a_motion_that_is_no_number_stops_the_robot_and_is_told(bench: Bench[Ahead]) -> None:
    bench.strategy.act = lambda _view: Twist(float("nan"), 0.0)  # type: ignore[method-assign]
    assert bench.tick() == ["stop"]
    assert "finite" in (bench.report().fault or "")
    bench.strategy.act = lambda _view: Twist(0.2, 0.0)  # type: ignore[method-assign]
    assert bench.tick() == ["drive 0.20 0.00"]
    assert bench.report().fault is None


def test_a_strategy_that_answers_nonsense_again_and_again_has_failed(bench: Bench[Ahead]) -> None:
    bench.strategy.act = lambda _view: Twist(0.0, float("inf"))  # type: ignore[method-assign]
    for _ in range(NONSENSE_LIMIT - 1):
        bench.tick()
    with pytest.raises(StrategyError, match=r"expected finite numbers of m/s and rad/s, got Twist\(v=0.0, w=inf\)"):
        bench.tick()


def test_a_player_that_gives_way_stands_and_says_why(bench: Bench[Ahead]) -> None:
    bench.robot.told.clear()
    bench.player.give_way("no idea")
    assert bench.robot.told == ["stop"]
    report = bench.report()
    assert (report.fault, report.mode) == ("no idea", "Stop/failed")


def test_what_a_player_says_goes_to_its_team_and_is_heard_there(bench: Bench[Ahead]) -> None:
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


def test_a_player_cannot_say_more_than_the_radio_carries(bench: Bench[Ahead], caplog: pytest.LogCaptureFixture) -> None:
    for number in range(100):
        told = telling(bench, Action(Twist(0.2, 0.1), "x" * (5000 + number // 50), sightings=[SIGHTING]))
        assert told == [m.Sightings(seen=(SIGHTING,))]
    assert bench.robot.told[-1] == "drive 0.20 0.10"
    assert "Ahead.act: say left out: expected at most 1024 bytes to be sent at a tick, got 5003" in caplog.text
    assert len(caplog.messages) == 2, "each text is logged once"


def test_a_loop_outside_may_look_and_drive_in_place_of_a_strategy(new: Bench[Ahead]) -> None:
    new.time = 0.1
    new.hear(referee_state())
    new.mailbox.handover(new.time)
    view = new.player.look(Tick(new.time))
    assert view is not None
    assert view.pose == POSE
    new.player.drive(view, Action(Twist(0.2, 0.1)))
    assert new.robot.told[-1] == "drive 0.20 0.10"
    assert new.strategy.asked == 0


def telling(bench: Bench[Ahead], action: Action) -> list[m.Message]:
    """What a player publishes besides its report when its strategy answers with this action."""
    bench.strategy.act = lambda view: action  # type: ignore[method-assign]
    bench.tick()
    return [body for body in bench.sent() if not isinstance(body, m.Report)]


SIGHTING = m.Sighting(x=1.0, y=2.0, time=0.1, xx=0.01, xy=0.0, yy=0.01)


def test_an_action_tells_the_referee_and_the_windows_what_it_holds(bench: Bench[Ahead]) -> None:
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
def test_what_cannot_be_told_is_left_out(bench: Bench[Ahead], action: Action, caplog: pytest.LogCaptureFixture) -> None:
    bench.sent()
    good: dict[str, Any] = {"sketch": []} if action.sketch is None else {"bids": {"b": 1.0}}
    told = [m.Sketch(strokes=())] if "sketch" in good else [m.Bid(lot="b", cost=1.0)]
    assert telling(bench, structs.replace(action, **good)) == told
    said = r"Ahead\.act: (bids|sightings|sketch) left out: .+ \(.*, line \d+, in act\)"
    assert re.fullmatch(said, caplog.messages[0])


def test_what_the_radio_brought_is_published_once_a_second_and_kept_for_the_result(bench: Bench[Ahead]) -> None:
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
