"""The details of one player in the developers' view."""

import math
from collections.abc import Iterator

from vrg.bus.names import chunk_of
from vrg.bus.topics import key_matches
from vrg.types import Pose, Twist
from vrg.ui.deeds import LOW_BATTERY
from vrg.ui.developer import words
from vrg.ui.developer.insight import Insight
from vrg.ui.developer.streams import health
from vrg.ui.developer.tables import Item, Tone, driver_cell
from vrg.ui.scene import ScenePlayer, speed_text


def details(insight: Insight, name: str | None) -> list[Item]:
    """All that is known of one player, each with a label."""
    state = None if insight.state is None or name is None else insight.state.player(name)
    shown = next((p for p in insight.scene.players if p.name == name), None)
    if name is None or state is None or shown is None:
        return [Item(words.NOBODY_SELECTED, Tone.QUIET)]
    found = [Item(f"{name}: {state.role} of {state.team}, {state.state}", heading=True)]
    return [*found, *_told(insight, shown), *_placed(insight, shown), *_heard_of(insight, name)]


def _told(insight: Insight, player: ScenePlayer) -> Iterator[Item]:
    """The reports of a player about itself."""
    report = insight.reports.get(player.name)
    yield Item(words.UNKNOWN if report is None else report.body.mode, label="mode")
    if player.fault:
        yield Item(player.fault, Tone.ALARM if player.latched else Tone.CAUTION, label="fault")
    drives = driver_cell(player)
    yield Item(drives.text, drives.tone, label="driven by")
    if report is None:
        return
    body = report.body
    yield Item("none" if body.command is None else _twist(body.command), label="command")
    stopped = ", emergency stop latched" if body.estop else ""
    yield Item(f"{'armed' if body.armed else 'not armed'}{stopped}", label="robot")
    if body.battery is not None:
        low = body.battery < LOW_BATTERY
        yield Item(f"{body.battery:.0%}", Tone.CAUTION if low else Tone.PLAIN, label="battery")


def _placed(insight: Insight, player: ScenePlayer) -> Iterator[Item]:
    """The pose of a player's robot, the true one and the measured one."""
    name = player.name
    true, measured, robot = insight.pose(name), insight.measured.get(name), insight.robots.get(name)
    if true is not None:
        speed = "" if player.speed is None else f", {speed_text(player.speed)} m/s"
        yield Item(f"{_pose(true)}{speed}", label="true pose")
    if measured is not None and true is not None:
        pose = measured.body.pose
        off, age = math.dist((true.x, true.y), (pose.x, pose.y)), insight.now - measured.stamp
        yield Item(f"{_pose(pose)}, {off:.2f} m off, {max(0.0, age):.2f} s old", label="measured")
    if robot is not None and robot.body.fault:
        yield Item(robot.body.fault, Tone.CAUTION, label="in the world")
    if player.mark is not None:
        yield Item(_pose(player.mark), label="mark")


def _heard_of(insight: Insight, name: str) -> Iterator[Item]:
    """The radio of a player, its process, and every stream of its own and of its robot."""
    for link in insight.links[name].body.links if name in insight.links else ():
        text = f"{link.arrived} arrived, {link.lost} lost, {link.delay:.2f} s late"
        yield Item(text, Tone.CAUTION if link.lost else Tone.QUIET, label=f"hears {link.speaker}")
    for row in insight.processes:
        if row.status.name == name:
            pulse = "" if row.pulse is None else f", {row.pulse.frequency:.0f} ticks/s, {row.pulse.missed} missed"
            yield Item(f"{row.status.state.value}, {row.status.cpu:.0%} of a core{pulse}", label="process")
    for stream in insight.streams:
        if key_matches(f"*/{chunk_of(name)}/**", stream.key):
            text = f"{stream.rate:.1f} Hz, {stream.age:.1f} s old"
            if stream.key in insight.words:
                text += f": {insight.words[stream.key]}"
            yield Item(text, health(stream), label=stream.key.split("/", 2)[2].removeprefix("sensor/"))


def _pose(pose: Pose) -> str:
    return f"{pose.x:.2f}, {pose.y:.2f} m, {math.degrees(pose.theta):.0f}°"


def _twist(twist: Twist) -> str:
    side = f", {twist.side:.2f} m/s to the left" if twist.side else ""
    return f"{twist.v + 0.0:.2f} m/s{side}, {math.degrees(twist.w) + 0.0:.0f} °/s"
