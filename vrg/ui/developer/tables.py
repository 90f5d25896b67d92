"""The tables and lists of the developers' view. Pure functions of what is known; this draws nothing."""

import enum
from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import Call, ProcessState
from vrg.ui.deeds import LOW_BATTERY
from vrg.ui.developer import words
from vrg.ui.developer.insight import Insight
from vrg.ui.processes import LATE
from vrg.ui.scene import ScenePlayer, speed_text


class Tone(enum.Enum):
    """The urgency of a text."""

    QUIET = "quiet"
    PLAIN = "plain"
    GOOD = "good"
    CAUTION = "caution"
    ALARM = "alarm"


@dataclass(frozen=True)
class Cell:
    """A cell of a table."""

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
class GridRow:
    """A row of a table. `name` is its subject, such as a player; empty if a click on it means nothing."""

    name: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Grid:
    """A table."""

    columns: tuple[Column, ...]
    lines: tuple[GridRow, ...]


@dataclass(frozen=True)
class Item:
    """A piece of a list.

    Args:
        text: of the item. tone: how urgent it is. heading: it begins a part of the list.
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
PROCESS_COLUMNS: Final = (
    Column("process", 0.14),
    Column("state", 0.12),
    Column("CPU", 0.08, right=True),
    Column("MB", 0.07, right=True),
    Column("ticks/s", 0.10, right=True),
    Column("missed", 0.10, right=True),
    Column("refused", 0.10, right=True),
    Column("restarts", 0.11, right=True),
    Column("ms", 0.08, right=True),
    Column("ppm", 0.10, right=True),
)


def players(insight: Insight) -> Grid:
    """A row for each player: what it does, how fast, with how much charge, who drives it, and the age of its report."""
    return Grid(PLAYER_COLUMNS, tuple(_player(insight, player) for player in insight.scene.players))


def _player(insight: Insight, player: ScenePlayer) -> GridRow:
    report = insight.reports.get(player.name)
    age = None if report is None else max(0.0, insight.now - report.stamp)
    doing, tone = player.mode or player.state, Tone.PLAIN
    if player.out_of_play:
        doing, tone = player.state, Tone.QUIET
    if player.fault:
        doing, tone = player.fault, Tone.ALARM if player.latched else Tone.CAUTION
    low = player.battery is not None and player.battery < LOW_BATTERY
    return GridRow(
        player.name,
        (
            Cell(player.name, Tone.QUIET if player.out_of_play else Tone.PLAIN),
            Cell(doing, tone),
            Cell("" if player.speed is None else speed_text(player.speed), Tone.QUIET),
            Cell("" if player.battery is None else f"{player.battery:.0%}", Tone.CAUTION if low else Tone.QUIET),
            driver_cell(player),
            Cell(words.UNKNOWN if age is None else f"{age:.1f}", _age_tone(age)),
        ),
    )


def driver_cell(player: ScenePlayer) -> Cell:
    """The driver of a player's robot now."""
    if player.leased:
        return Cell("referee", Tone.CAUTION)
    if player.manual:
        return Cell("a person", Tone.CAUTION)
    if not player.armed:
        return Cell("not armed", Tone.QUIET)
    return Cell("itself", Tone.GOOD) if player.may_move else Cell("no one", Tone.QUIET)


def _age_tone(age: float | None) -> Tone:
    return Tone.ALARM if age is None or age > 1.0 else Tone.CAUTION if age > 0.5 else Tone.QUIET


def processes(insight: Insight) -> Grid:
    """A row for each process, with its machine if there are several.

    `ms` is how late it hears the match clock, `ppm` how much faster its own clock runs.
    """
    further = len({row.status.machine for row in insight.processes}) > 1
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
            GridRow(
                "",
                (
                    Cell(f"{status.machine}: {status.name}" if further else status.name),
                    Cell(status.state.value, tones[status.state]),
                    Cell("" if status.pid is None else f"{status.cpu:.0%}"),
                    Cell("" if status.pid is None else f"{status.memory / 1e6:.0f}", Tone.QUIET),
                    Cell("" if pulse is None else f"{pulse.frequency:.1f}"),
                    Cell(
                        "" if pulse is None else str(pulse.missed),
                        Tone.CAUTION if pulse is not None and pulse.missed else Tone.QUIET,
                    ),
                    Cell(
                        "" if pulse is None else str(pulse.refused),
                        Tone.ALARM if pulse is not None and pulse.refused else Tone.QUIET,
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
