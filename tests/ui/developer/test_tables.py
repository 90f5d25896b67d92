"""What the developers' view tells, as tables and lists."""

import pytest

from tests.ui.developer.making import KEYS
from vrg.bus import messages as m
from vrg.bus.messages.process import ProcessState
from vrg.bus.traffic import Stream
from vrg.types import Pose, Twist
from vrg.ui.acts import Act, Press
from vrg.ui.developer import details, referee, streams, tables
from vrg.ui.developer.choices import ViewState
from vrg.ui.developer.tables import Tone


def told(items):
    return [item.text for item in items]


def of_referee(bench, heading="", **changes):
    """What the referee's tab tells two ticks after the state has changed, from a heading on."""
    bench.changes |= changes
    bench.ticks(2)
    items = told(referee.referee(bench.node.insight))
    return items[items.index(heading) + 1 :] if heading else items


def row(grid, name):
    return next([cell.text for cell in line.cells] for line in grid.lines if name in (line.name, line.cells[0].text))


def test_a_row_for_each_player_tells_mode_fault_driver_and_age(bench):
    bench.reports["robot2"] = {"fault": "robot2: its motors are too hot", "latched": True, "battery": None}
    bench.reports["robot3"] = {"manual": True}
    bench.ticks(2)
    grid = tables.players(bench.node.insight)
    assert row(grid, "robot1") == ["robot1", "Search/Turn", "0.6", "80%", "itself", "0.0"]
    assert row(grid, "robot2")[1:4] == ["its motors are too hot", "0.6", ""]
    assert row(grid, "robot3")[4] == "a person"
    assert grid.lines[1].cells[1].tone is Tone.ALARM


def test_start_conditions_halts_and_ways_out_are_listed(bench):
    reasons = ["robot1 does not report", "robot2 is not on its mark"]
    assert of_referee(bench, waiting=reasons)[:3] == ["START CONDITIONS", *reasons]
    halted = of_referee(bench, waiting=[], halted="the emergency stop", way_out="release it")
    assert halted[:3] == ["HALTED", "the emergency stop", "Way out: release it"]


def test_auctions_tell_who_bid_how_much_who_has_not_and_who_won(bench):
    bids = {"robot1": 4.2, "robot2": 3.1}
    auction = m.Auction(lot="i1", bidders=bench.names, opened=2.0, lasts=1.5, bids=bids)
    won = m.Auction(lot="i2", bidders=("robot3",), opened=3.0, lasts=1.5, bids={"robot3": 1.0}, winner="robot3")
    assert of_referee(bench, "AUCTIONS", auctions=[auction, won])[:4] == [
        "i1: open since 0:02.0, for 1.5 s at least",
        "robot2 bids 3.1, robot1 bids 4.2, robot3 has not bid",
        "i2: won by robot3, open since 0:03.0",
        "robot3 bids 1.0",
    ]


def test_leases_tell_who_drives_whom_and_until_when(bench):
    bench.states["robot1"] = {"lease": Twist(0.5, 0.0)}
    bench.reports["robot2"] = {"manual": True}
    bench.tell(KEYS.manual("robot2"), m.Manual(forward=1.0, turn=0.0, lease=0.5))
    assert of_referee(bench, "LEASES")[:2] == [
        "robot1: the referee drives it, 0.5 m/s and 0 °/s, until it ends that",
        "robot2: a person drives it for another 0.4 s",
    ]


def test_calls_stand_with_their_rule_the_newest_first_with_its_text(bench):
    bench.call(1, "capture", "robot1 captured robot2.")
    bench.call(2, "halt", "halt: asked for by test")
    bench.ticks(2)
    items = referee.referee(bench.node.insight)
    calls = [item for item in items if item.call is not None]
    assert [item.text[:9] for item in calls] == ["[halt] ha", "Rule (the", "[capture]"]
    assert [item.call.number for item in calls] == [2, 2, 1]


def test_the_details_of_a_player_tell_poses_streams_process_and_radio(bench):
    bench.processes(cpu=0.5)
    link = m.LinkCount(speaker="robot2", arrived=9, lost=2, under_way=0, delay=0.25, longest=0.5)
    bench.tell(KEYS.links("robot1"), m.Links(links=(link,)))
    pose = bench.pose("robot1")
    bench.tell(KEYS.robot_pose("robot1"), m.MeasuredPose(pose=Pose(pose.x + 1.0, pose.y, 0.0)))
    for _ in range(10):
        bench.scan("robot1")
        bench.tick()
    found = {item.label: item.text for item in details.details(bench.node.insight, "robot1")}
    assert found["mode"] == "Search/Turn"
    assert "1.00 m off" in found["measured"]
    assert found["hears robot2"] == "9 arrived, 2 lost, 0.25 s late"
    assert found["process"] == "running, 50% of a core, 10 ticks/s, 3 missed"
    assert "Hz" in found["laser/front"]
    assert "Click a player" in told(details.details(bench.node.insight, None))[0]


def test_what_came_under_a_wrong_key_is_an_alarm():
    stream = Stream("estop", 0.0, 0.0, 1.0, lost=7, bad=1, misrouted=2)
    assert streams.health(stream) is Tone.ALARM
    [line] = streams.streams([stream], None).lines
    assert line.cells[-1].text.endswith("+1 bad +2 misrouted")


def test_bad_streams_stand_first_until_a_heading_sorts_them():
    good = Stream("clock", 50.0, 1000.0, 0.0, longest=0.05)
    losing = Stream("poses", 40.0, 9000.0, 0.0, lost=3, lately=2, longest=0.1)
    silent = Stream("player/ann/report", 0.0, 0.0, 4.0, longest=0.1)
    orders = Stream("estop", 0.0, 0.0, 40.0, lost=7, longest=20.0)
    bids = Stream("player/ann/bid", 0.0, 0.0, 4.0, longest=0.1)
    assert streams.health(bids) is Tone.PLAIN, "nobody must bid"
    heard = [good, losing, silent, orders]
    assert [streams.health(stream) for stream in heard] == [Tone.PLAIN, Tone.ALARM, Tone.CAUTION, Tone.PLAIN]

    def shown(sort):
        return [line.cells[0].text for line in streams.streams(heard, sort).lines]

    assert shown(None) == ["poses", "player/ann/report", "clock", "estop"]
    assert shown(("Hz", True))[:2] == ["clock", "poses"]
    assert shown(("kB/s", False))[-1] == "poses"
    assert shown(("key", True)) == ["clock", "estop", "player/ann/report", "poses"]
    assert "4 streams, 90 messages/s, 10 kB/s, 3 lost" in streams.totals(heard)
    assert [cell.text for cell in streams.streams([orders], None).lines[0].cells][-1] == "–", "several speak there"


def test_processes_tell_load_missed_ticks_restarts_and_clock(bench):
    bench.processes(cpu=0.93, restarts=2)
    bench.ticks(2)
    grid = tables.processes(bench.node.insight)
    assert row(grid, "robot1") == ["robot1", "running", "93%", "48", "10.0", "3", "4", "2", "2", "+10"]
    assert [cell.tone for cell in grid.lines[0].cells][5:8] == [Tone.CAUTION, Tone.ALARM, Tone.CAUTION]
    bench.processes(state=ProcessState.ENDED, pid=None)
    bench.ticks(2)
    grid = tables.processes(bench.node.insight)
    assert row(grid, "robot1") == ["robot1", "ended", "", "", "", "", "", "0", "", ""]


@pytest.mark.parametrize("grid", [tables.PLAYER_COLUMNS, streams.STREAM_COLUMNS, tables.PROCESS_COLUMNS])
def test_columns_fill_the_width(grid):
    assert sum(column.share for column in grid) == pytest.approx(1.0, abs=0.011)


def test_choices_turn_around():
    choices = ViewState()
    choices.sort_by("Hz")
    choices.sort_by("Hz")
    choices.sort_by("Hz")
    assert choices.sort is None
    choices.scroll(None, 50, 7)
    assert choices.scrolled[None] == 7
    choices.scroll(None, -50, 7)
    assert choices.scrolled[None] == 0
    for _ in range(3):
        assert choices.press(Press(Act.SELECT), ["ann", "bob"])
    assert choices.selected == "ann"
    assert choices.press(Press(Act.SELECT, back=True), ["ann", "bob"])
    assert choices.selected == "bob"
    assert not choices.press(Press(Act.HALT), ["ann"])
