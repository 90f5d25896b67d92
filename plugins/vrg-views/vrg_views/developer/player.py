"""Everything about one player."""

import math
from collections.abc import Iterator

from vrg.names import chunk_of
from vrg.types import Pose, Twist
from vrg.ui.deeds import LOW_BATTERY
from vrg.ui.scene import ScenePlayer, speed_text
from vrg_views.developer import words
from vrg_views.developer.insight import Insight
from vrg_views.developer.streams import health
from vrg_views.developer.tables import Grid, GridRow, Tone, driver_cell, heading, item


def player(insight: Insight) -> Grid:
    """All that is known of the selected player, each with a label."""
    name = insight.selected
    state = None if insight.state is None else insight.state.player(name)
    shown = insight.scene.player(name)
    if state is None or shown is None:
        return Grid([], note=words.NOBODY_SELECTED)
    head = heading(f"{name}: {state.role} of {state.team}, {state.state}")
    return Grid([head, *_told(insight, shown), *_placed(insight, shown), *_heard_of(insight, name)])


def _told(insight: Insight, player: ScenePlayer) -> Iterator[GridRow]:
    """The reports of a player about itself."""
    report = insight.reports.get(player.name)
    yield item(words.UNKNOWN if report is None else report.body.mode, label="mode")
    if player.fault:
        yield item(player.fault, Tone.ALARM if player.latched else Tone.CAUTION, label="fault")
    drives = driver_cell(player)
    yield item(drives.text, drives.tone, label="driven by")
    if report is None:
        return
    body = report.body
    yield item("none" if body.command is None else _twist(body.command), label="command")
    stopped = ", emergency stop latched" if body.estop else ""
    yield item(f"{'armed' if body.armed else 'not armed'}{stopped}", label="robot")
    if body.battery is not None:
        low = body.battery < LOW_BATTERY
        yield item(f"{body.battery:.0%}", Tone.CAUTION if low else Tone.PLAIN, label="battery")


def _placed(insight: Insight, player: ScenePlayer) -> Iterator[GridRow]:
    """The pose of a player's robot, the true one and the measured one."""
    name = player.name
    true, measured, robot = insight.pose(name), insight.measured.get(name), insight.robots.get(name)
    if true is not None:
        speed = "" if player.speed is None else f", {speed_text(player.speed)} m/s"
        yield item(f"{_pose(true)}{speed}", label="true pose")
    if measured is not None and true is not None:
        pose = measured.body.pose
        off, age = math.dist((true.x, true.y), (pose.x, pose.y)), insight.now - measured.stamp
        yield item(f"{_pose(pose)}, {off:.2f} m off, {max(0.0, age):.2f} s old", label="measured")
    if robot is not None and robot.body.fault:
        yield item(robot.body.fault, Tone.CAUTION, label="in the world")
    if player.mark is not None:
        yield item(_pose(player.mark), label="mark")


def _heard_of(insight: Insight, name: str) -> Iterator[GridRow]:
    """The radio of a player, its process, and every stream of its own and of its robot."""
    for link in insight.links[name].body.links if name in insight.links else ():
        text = f"{link.arrived} arrived, {link.lost} lost, {link.delay:.2f} s late"
        yield item(text, Tone.CAUTION if link.lost else Tone.QUIET, label=f"hears {link.speaker}")
    for row in insight.processes:
        if row.status.name == name:
            pulse = "" if row.pulse is None else f", {row.pulse.frequency:.0f} ticks/s, {row.pulse.missed} missed"
            yield item(f"{row.status.state.value}, {row.status.cpu:.0%} of a core{pulse}", label="process")
    own = tuple(f"{what}/{chunk_of(name)}/" for what in ("robot", "player"))
    for stream in insight.streams:
        if stream.key.startswith(own):
            text = f"{stream.rate:.1f} Hz, {stream.age:.1f} s old"
            if stream.key in insight.words:
                text += f": {insight.words[stream.key]}"
            yield item(text, health(stream), label=stream.key.split("/", 2)[2].removeprefix("sensor/"))


def _pose(pose: Pose) -> str:
    return f"{pose.x:.2f}, {pose.y:.2f} m, {math.degrees(pose.theta):.0f}°"


def _twist(twist: Twist) -> str:
    side = f", {twist.side:.2f} m/s to the left" if twist.side else ""
    return f"{twist.v + 0.0:.2f} m/s{side}, {math.degrees(twist.w) + 0.0:.0f} °/s"
