"""What the drawer shows, as tables, lists and layers."""

import pytest
from heard import KEYS, ROBOT, Bench

from vrg.bus import messages as m
from vrg.bus.messages.process import ProcessState
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sensors.touch import Touch, TouchSpec
from vrg.types import Pose, Twist
from vrg_views.developer import layers, player, referee, streams, tables
from vrg_views.developer.insight import Insight
from vrg_views.developer.tables import Tone
from vrg_views.developer.traffic import Stream


def told(grid):
    return [row.cells[-1].text for row in grid.rows]


def of_referee(bench, heading="", **changes):
    """What the referee's list tells two ticks after the state has changed, from a heading on."""
    bench.changes |= changes
    bench.ticks(2)
    items = told(referee.referee(bench.insight()))
    return items[items.index(heading) + 1 :] if heading else items


def row(grid, name):
    return next([cell.text for cell in line.cells] for line in grid.rows if name in (line.name, line.cells[0].text))


def test_a_row_for_each_player_tells_mode_fault_driver_and_age(bench):
    bench.reports["robot2"] = {"fault": "its motors are too hot", "latched": True, "battery": None}
    bench.reports["robot3"] = {"manual": True}
    bench.ticks(2)
    grid = tables.players(bench.insight())
    assert row(grid, "robot1") == ["robot1", "Search/Turn", "0.6", "80%", "itself", "0.0"]
    assert row(grid, "robot2")[1:4] == ["its motors are too hot", "0.6", ""]
    assert row(grid, "robot3")[4] == "a person"
    assert grid.rows[1].cells[1].tone is Tone.ALARM


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
    [*_, newest, rule, older] = referee.referee(bench.insight()).rows
    assert [row.cells[1].text[:9] for row in (newest, rule, older)] == ["[halt] ha", "Rule (the", "[capture]"]
    assert [row.cells[0].text for row in (newest, rule, older)] == ["0:03.0", "", "0:03.0"]


def test_the_details_of_a_player_tell_poses_streams_process_and_radio(bench):
    bench.processes(cpu=0.5)
    link = m.LinkCount(speaker="robot2", arrived=9, lost=2, under_way=0, delay=0.25, longest=0.5)
    bench.tell(KEYS.links("robot1"), m.Links(links=(link,)))
    pose = bench.pose("robot1")
    bench.tell(KEYS.robot_pose("robot1"), m.MeasuredPose(pose=Pose(pose.x + 1.0, pose.y, 0.0)))
    for _ in range(10):
        bench.scan("robot1")
        bench.tick()
    found = {row.cells[0].text: row.cells[-1].text for row in player.player(bench.insight("robot1")).rows}
    assert found["mode"] == "Search/Turn"
    assert "1.00 m off" in found["measured"]
    assert found["hears robot2"] == "9 arrived, 2 lost, 0.25 s late"
    assert found["process"] == "running, 50% of a core, 10 ticks/s, 3 missed"
    assert "Hz" in found["laser/front"]
    assert "Click a player" in player.player(bench.insight()).note


def test_a_player_with_the_name_of_a_key_of_the_referees_has_its_own_streams_alone():
    bench = Bench()
    bench.names[0] = "state"
    bench.ticks(10)
    labels = [row.cells[0].text for row in player.player(bench.insight("state")).rows]
    assert "report" in labels
    assert not any("referee" in label for label in labels)


def test_a_ring_without_bumpers_draws_nothing(bench):
    bench.tell(KEYS.sensor(Touch, "robot1", TouchSpec(count=8).name), Touch(pressed=()))
    bench.tick()
    assert not any(layers.shapes(bench.insight("robot1")).values())


def test_what_came_under_a_wrong_key_is_an_alarm():
    stream = Stream("estop", 0.0, 0.0, 1.0, lost=7, bad=1, misrouted=2)
    assert streams.health(stream) is Tone.ALARM
    [line] = streams.streams(Insight(streams=[stream])).rows
    assert line.cells[-1].text.endswith("+1 bad +2 misrouted")


def test_bad_streams_stand_first():
    good = Stream("clock", 50.0, 1000.0, 0.0, sender="world/w", longest=0.05)
    losing = Stream("poses", 40.0, 9000.0, 0.0, sender="world/w", lost=3, lately=2, longest=0.1)
    silent = Stream("player/ann/report", 0.0, 0.0, 4.0, sender="player/ann", longest=0.1)
    orders = Stream("estop", 0.0, 0.0, 40.0, sender="player/ann", lost=7, longest=20.0)
    bids = Stream("player/ann/bid", 0.0, 0.0, 4.0, longest=0.1)
    assert streams.health(bids) is Tone.PLAIN, "nobody must bid"
    heard = [good, losing, silent, orders]
    assert [streams.health(stream) for stream in heard] == [Tone.PLAIN, Tone.ALARM, Tone.CAUTION, Tone.PLAIN]

    listed = streams.streams(Insight(streams=heard))
    assert [line.cells[0].text for line in listed.rows] == ["poses", "player/ann/report", "clock", "estop"]
    summary = "4 streams, 90 messages/s, 10 kB/s, 3 lost"
    assert listed.note == f"{summary}\nPublishing most, kB/s: world/w 10.0, player/ann 0.0"
    assert [line.cells[1].text for line in listed.rows][:2] == ["world/w", "player/ann"]
    assert streams.streams(Insight(streams=[orders])).rows[0].cells[-1].text == "–", "several speak there"


def test_processes_tell_load_missed_ticks_restarts_and_clock(bench):
    bench.processes(cpu=0.93, restarts=2)
    bench.ticks(2)
    grid = tables.processes(bench.insight())
    assert row(grid, "robot1") == ["robot1", "running", "93%", "48", "10.0", "3", "4", "2", "2", "+10"]
    assert [cell.tone for cell in grid.rows[0].cells][5:8] == [Tone.CAUTION, Tone.ALARM, Tone.CAUTION]
    bench.processes(state=ProcessState.ENDED, pid=None)
    bench.ticks(2)
    grid = tables.processes(bench.insight())
    assert row(grid, "robot1") == ["robot1", "ended", "", "", "", "", "", "0", "", ""]


def of_layer(insight, name):
    return layers.shapes(insight)[name]


def test_a_scan_of_the_selected_robot_is_drawn_where_it_was_when_it_was_made(bench):
    bench.scan("robot1", 2.0)
    bench.scan("robot2", 2.0)
    pose = bench.pose("robot1")
    bench.ticks(5)
    assert of_layer(bench.insight(), layers.SCANS) == []
    area, dots = of_layer(bench.insight("robot1"), layers.SCANS)
    assert area.fill is not None
    assert (dots.radius > 0.0, len(dots.points)) == (True, 90)
    # The laser's 92nd beam of 181, which meets something, points 1 degree to the left of straight ahead.
    mount = ROBOT.sensor(LaserSpec).x
    assert dots.points[45] == pytest.approx((pose.x + mount + 2.0, pose.y + 0.035), abs=0.01)
    bench.ticks(20)
    assert of_layer(bench.insight("robot1"), layers.SCANS) == [], "it is old"


def test_echoes_sightings_and_where_a_robot_was_measured_are_drawn(bench):
    bench.ring("robot2")
    pose = bench.pose("robot1")
    bench.tell(KEYS.robot_pose("robot1"), m.MeasuredPose(pose=Pose(pose.x + 3.0, pose.y, 0.0)))
    bench.tell(
        KEYS.sightings("robot2"), m.Sightings(seen=[m.Sighting(x=5.0, y=6.0, time=10.0, xx=0.1, xy=0.0, yy=0.1)])
    )
    bench.ticks(1)
    insight = bench.insight()
    lines = of_layer(insight, layers.SENSORS)
    assert [(line.fill, line.line is None) for line in lines] == [(None, False)] * 16
    dot, ellipse = of_layer(insight, layers.SIGHTINGS)
    assert (dot.points, ellipse.fill) == (((5.0, 6.0),), None)
    _, line = of_layer(insight, layers.MEASURED)
    assert line.points == ((pose.x + 3.0, pose.y), (pose.x, pose.y)), "a line leads from one to the other"
    bench.ticks(40)
    assert of_layer(bench.insight(), layers.SIGHTINGS) == []


def test_a_seat_that_may_not_hear_everything_names_what_it_may_not(bench):
    assert "may not hear" not in streams.streams(bench.insight()).note
    note = streams.streams(Bench(official=False).insight()).note
    assert "may not hear" in note
    assert "player/{player}/bid" in note


def test_what_is_closed_has_forgotten_what_it_heard(bench):
    bench.hearing.close()
    bench.real += 1.0
    assert bench.insight().streams == []
    assert bench.insight().state is None
