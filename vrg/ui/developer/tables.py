"""What the developers' view tells in tables and lists. Pure functions of what is known; this draws nothing."""

import enum
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import Auction, Call, PlayerStatus, ProcessState
from vrg.bus.names import chunk_of
from vrg.bus.topics import Keys, key_matches
from vrg.bus.traffic import Stream
from vrg.games import game_of
from vrg.types import Pose
from vrg.ui.deeds import LOW_BATTERY
from vrg.ui.developer import words
from vrg.ui.developer.insight import Insight
from vrg.ui.processes import LATE
from vrg.ui.scene import ScenePlayer, clock_text, speed_text

SILENT: Final = 1.0
"""The real time in s after which a stream that was regular counts as silent."""
FADING: Final = 5.0
"""A stream counts as silent after so many times the longest time that there was between two of its messages."""
SHARED: Final = tuple(
    line.path for line in (Keys.official, Keys.estop, Keys.estop_release, Keys.seat_request, Keys.seat_answer)
)
"""The keys on which several may speak, so that the numbers of their messages do not tell what was lost."""
SHARED_BY_NAME: Final = tuple(Keys.expression(line.path) for line in (Keys.camera_request, Keys.manual))
"""The same, of keys with names in them."""


class Tone(enum.Enum):
    """How urgent something is."""

    QUIET = "quiet"
    PLAIN = "plain"
    GOOD = "good"
    CAUTION = "caution"
    ALARM = "alarm"


@dataclass(frozen=True)
class Cell:
    """What stands in a table."""

    text: str
    tone: Tone = Tone.PLAIN


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Args:
        heading: its name. share: of the table's width. right: its cells end at its right edge.
    """

    heading: str
    share: float
    right: bool = False


@dataclass(frozen=True)
class Line:
    """A row of a table. `name` says what it is about, such as a player; empty if a click on it means nothing."""

    name: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Grid:
    """A table."""

    columns: tuple[Column, ...]
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Item:
    """A piece of a list.

    Args:
        text: what it says. tone: how urgent it is. heading: it begins a part of the list.
        label: what stands before it. call: the call that a click on it explains.
    """

    text: str
    tone: Tone = Tone.PLAIN
    heading: bool = False
    label: str = ""
    call: Call | None = None


PLAYER_COLUMNS: Final = (
    Column("player", 0.23),
    Column("mode", 0.29),
    Column("m/s", 0.09, right=True),
    Column("battery", 0.13, right=True),
    Column("driven by", 0.17),
    Column("age", 0.09, right=True),
)
STREAM_COLUMNS: Final = (
    Column("key", 0.52),
    Column("Hz", 0.12, right=True),
    Column("kB/s", 0.12, right=True),
    Column("age", 0.12, right=True),
    Column("lost", 0.12, right=True),
)
PROCESS_COLUMNS: Final = (
    Column("process", 0.17),
    Column("machine", 0.12),
    Column("state", 0.11),
    Column("CPU", 0.07, right=True),
    Column("MB", 0.07, right=True),
    Column("ticks/s", 0.10, right=True),
    Column("missed", 0.10, right=True),
    Column("restarts", 0.11, right=True),
    Column("ms", 0.06, right=True),
    Column("ppm", 0.09, right=True),
)


def players(insight: Insight) -> Grid:
    """A row for each player: what it does, how fast, with how much charge, who drives it, and the age of its report."""
    return Grid(PLAYER_COLUMNS, tuple(_player(insight, player) for player in insight.scene.players))


def _player(insight: Insight, player: ScenePlayer) -> Line:
    report = insight.reports.get(player.name)
    age = None if report is None else max(0.0, insight.now - report.stamp)
    doing, tone = player.mode or player.state, Tone.PLAIN
    if player.out_of_play:
        doing, tone = player.state, Tone.QUIET
    if player.fault:
        doing, tone = player.fault, Tone.ALARM if player.latched else Tone.CAUTION
    low = player.battery is not None and player.battery < LOW_BATTERY
    return Line(
        player.name,
        (
            Cell(player.name, Tone.QUIET if player.out_of_play else Tone.PLAIN),
            Cell(doing, tone),
            Cell("" if player.speed is None else speed_text(player.speed), Tone.QUIET),
            Cell("" if player.battery is None else f"{player.battery:.0%}", Tone.CAUTION if low else Tone.QUIET),
            _driver(player),
            Cell(words.UNKNOWN if age is None else f"{age:.1f}", _age_tone(age)),
        ),
    )


def _driver(player: ScenePlayer) -> Cell:
    if player.leased:
        return Cell("referee", Tone.CAUTION)
    if player.manual:
        return Cell("a person", Tone.CAUTION)
    if not player.armed:
        return Cell("not armed", Tone.QUIET)
    return Cell("itself", Tone.GOOD) if player.may_move else Cell("may not move", Tone.QUIET)


def _age_tone(age: float | None) -> Tone:
    return Tone.ALARM if age is None or age > 1.0 else Tone.CAUTION if age > 0.5 else Tone.QUIET


def referee(insight: Insight) -> list[Item]:
    """The coordinator: what it waits for, auctions with bids, leases, and calls with their rules."""
    state = insight.state
    if state is None:
        return [Item(words.WAITING, Tone.QUIET)]
    found = []
    if state.halted is not None:
        found += [Item(words.HALTED, heading=True), Item(state.halted, Tone.CAUTION)]
        found += [Item(words.WAY_OUT.format(state.way_out))] if state.way_out else []
    found.append(Item(words.CONDITIONS, heading=True))
    found += [Item(reason, Tone.CAUTION) for reason in state.waiting] or [Item(words.NOTHING_WAITS, Tone.QUIET)]
    found.append(Item(words.AUCTIONS, heading=True))
    found += [item for auction in state.auctions for item in _auction(auction)] or [Item(words.NO_AUCTION, Tone.QUIET)]
    found.append(Item(words.LEASES, heading=True))
    found += [item for p in state.players for item in _lease(insight, p)] or [Item(words.NO_LEASE, Tone.QUIET)]
    found.append(Item(words.CALLS, heading=True))
    game = game_of(state.game)
    for number, call in enumerate(reversed(insight.scene.calls)):
        tone = Tone.PLAIN if number == 0 else Tone.QUIET
        found.append(Item(f"[{call.rule}] {call.text}", tone, label=clock_text(call.clock), call=call))
        rule = game.rule_text(call.rule)
        if rule is not None and number == 0:
            source = f" ({rule.source})" if rule.source else ""
            found.append(Item(f"Rule{source}: {rule.words}", Tone.GOOD, label=" ", call=call))
    if not insight.scene.calls:
        found.append(Item(words.NO_CALL, Tone.QUIET))
    return found


def _auction(auction: Auction) -> list[Item]:
    opened = clock_text(auction.opened)
    if auction.winner is None:
        head = Item(
            words.AUCTION_OPEN.format(lot=auction.lot, opened=opened, lasts=auction.lasts),
            Tone.CAUTION,
        )
    else:
        head = Item(words.AUCTION_WON.format(lot=auction.lot, winner=auction.winner, opened=opened), Tone.GOOD)
    bids = [words.BID.format(player=p, cost=cost) for p, cost in sorted(auction.bids.items(), key=_by_cost)]
    bids += [words.NO_BID.format(player=p) for p in auction.bidders if p not in auction.bids]
    return [head, Item(", ".join(bids), Tone.QUIET, label=" ")] if bids else [head]


def _by_cost(bid: tuple[str, float]) -> tuple[float, str]:
    return bid[1], bid[0]


def _lease(insight: Insight, player: PlayerStatus) -> list[Item]:
    if player.lease is not None:
        text = words.LEASE_OF_REFEREE.format(player=player.name, v=player.lease.v, w=math.degrees(player.lease.w))
        return [Item(text, Tone.CAUTION)]
    report, manual = insight.reports.get(player.name), insight.manuals.get(player.name)
    if report is None or not report.body.manual:
        return []
    if manual is None:
        return [Item(words.LEASE_OF_PERSON.format(player=player.name), Tone.CAUTION)]
    rest = max(0.0, manual.stamp + manual.body.lease - insight.now)
    return [Item(words.LEASE_UNTIL.format(player=player.name, rest=rest), Tone.CAUTION)]


def details(insight: Insight, name: str | None) -> list[Item]:
    """All that is known of one player, each with a label."""
    state = None if insight.state is None or name is None else insight.state.player(name)
    shown = next((p for p in insight.scene.players if p.name == name), None)
    if name is None or state is None or shown is None:
        return [Item(words.NOBODY_SELECTED, Tone.QUIET)]
    found = [Item(f"{name}: {state.role} of {state.team}, {state.state}", heading=True)]
    return [*found, *_told(insight, shown), *_placed(insight, shown), *_heard_of(insight, name)]


def _told(insight: Insight, player: ScenePlayer) -> Iterator[Item]:
    """What a player tells of itself."""
    report = insight.reports.get(player.name)
    yield Item(words.UNKNOWN if report is None else report.body.mode, label="mode")
    if player.fault:
        yield Item(player.fault, Tone.ALARM if player.latched else Tone.CAUTION, label="fault")
    driver = _driver(player)
    yield Item(driver.text, driver.tone, label="driven by")
    if report is None:
        return
    body = report.body
    yield Item("none" if body.command is None else _twist(body.command.v, body.command.w), label="command")
    stopped = ", emergency stop latched" if body.estop else ""
    yield Item(f"{'armed' if body.armed else 'not armed'}{stopped}", label="robot")
    if body.battery is not None:
        low = body.battery < LOW_BATTERY
        yield Item(f"{body.battery:.0%}", Tone.CAUTION if low else Tone.PLAIN, label="battery")


def _placed(insight: Insight, player: ScenePlayer) -> Iterator[Item]:
    """Where a player's robot is, and where it was measured to be."""
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
    """What the radio brings a player, how its process is, and every stream of its own and of its robot."""
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
            yield Item(text, health(stream), label=stream.key.split("/", 2)[2].removeprefix("sensor/"))


def _pose(pose: Pose) -> str:
    return f"{pose.x:.2f}, {pose.y:.2f} m, {math.degrees(pose.theta):.0f}°"


def _twist(v: float, w: float) -> str:
    return f"{v + 0.0:.2f} m/s, {math.degrees(w) + 0.0:.0f} °/s"


def health(stream: Stream) -> Tone:
    """Whether a stream has lost messages lately (alarm), or has lost some or fallen silent (caution)."""
    if stream.bad or (stream.lately and not shared(stream.key)):
        return Tone.ALARM
    regular = 0.0 < stream.longest < SILENT
    if (stream.lost and not shared(stream.key)) or (regular and stream.age > max(SILENT, FADING * stream.longest)):
        return Tone.CAUTION
    return Tone.PLAIN


def shared(key: str) -> bool:
    """Whether several may speak on a key, so that the numbers of its messages do not tell what was lost."""
    return key in SHARED or any(key_matches(expression, key) for expression in SHARED_BY_NAME)


def streams(heard: Sequence[Stream], sort: tuple[str, bool] | None) -> Grid:
    """A row for each stream.

    Args:
        sort: a heading, and whether downwards; None puts the bad ones first.
    """
    grave = {Tone.ALARM: 0, Tone.CAUTION: 1}
    ordered = sorted(heard, key=lambda stream: (grave.get(health(stream), 2), stream.key))
    if sort is not None:
        values = {
            "Hz": lambda s: s.rate, "kB/s": lambda s: s.bandwidth, "age": lambda s: s.age,
            "lost": lambda s: -1 if shared(s.key) else s.lost,
        }  # fmt: skip
        by = values.get(sort[0], lambda s: s.key)
        # A key is read from A to Z, a number from the highest.
        ordered = sorted(ordered, key=by, reverse=sort[1] == (sort[0] in values))
    return Grid(STREAM_COLUMNS, tuple(_stream(stream) for stream in ordered))


def _stream(stream: Stream) -> Line:
    tone = health(stream)
    lost = words.UNKNOWN if shared(stream.key) else str(stream.lost)
    return Line(
        "",
        (
            Cell(stream.key, tone),
            Cell(f"{stream.rate:.1f}", tone),
            Cell(f"{stream.bandwidth / 1e3:.1f}", tone),
            Cell(f"{stream.age:.1f}", tone),
            Cell(f"{lost} +{stream.bad} bad" if stream.bad else lost, tone),
        ),
    )


def summary(heard: Sequence[Stream]) -> str:
    """All streams together, in words."""
    return words.SUMMARY.format(
        count=len(heard),
        rate=sum(stream.rate for stream in heard),
        bandwidth=sum(stream.bandwidth for stream in heard) / 1e3,
        lost=sum(stream.lost for stream in heard if not shared(stream.key)),
    )


def processes(insight: Insight) -> Grid:
    """A row for each process; `ms` and `ppm` are how late it hears the match clock, and how fast its own clock runs."""
    tones = {
        ProcessState.STARTING: Tone.CAUTION,
        ProcessState.RUNNING: Tone.GOOD,
        ProcessState.ENDED: Tone.ALARM,
        ProcessState.AWAY: Tone.ALARM,
    }
    lines = []
    for row in insight.processes:
        status, pulse = row.status, row.pulse
        late = None if pulse is None else pulse.late
        lines.append(
            Line(
                "",
                (
                    Cell(status.name),
                    Cell(status.machine, Tone.QUIET),
                    Cell(status.state.value, tones[status.state]),
                    Cell("" if status.pid is None else f"{status.cpu:.0%}"),
                    Cell("" if status.pid is None else f"{status.memory / 1e6:.0f}", Tone.QUIET),
                    Cell("" if pulse is None else f"{pulse.frequency:.1f}"),
                    Cell(
                        "" if pulse is None else str(pulse.missed),
                        Tone.CAUTION if pulse is not None and pulse.missed else Tone.QUIET,
                    ),
                    Cell(str(status.restarts), Tone.CAUTION if status.restarts else Tone.QUIET),
                    Cell(
                        "" if late is None else f"{1e3 * late:.0f}",
                        Tone.ALARM if late is not None and late > LATE else Tone.QUIET,
                    ),
                    Cell("" if pulse is None or pulse.drift is None else f"{1e6 * pulse.drift:+.0f}", Tone.QUIET),
                ),
            )
        )
    return Grid(PROCESS_COLUMNS, tuple(lines))
