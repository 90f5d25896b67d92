"""The tables of the drawer. Pure functions of what is known; this draws nothing."""

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from vrg.bus.messages import ProcessState
from vrg.ui.deeds import LOW_BATTERY
from vrg.ui.processes import LATE, Row
from vrg.ui.scene import ScenePlayer, speed_text
from vrg_views.developer import words
from vrg_views.developer.insight import Insight


class Tone(enum.StrEnum):
    """The urgency of a text."""

    QUIET = "quiet"
    PLAIN = "plain"
    GOOD = "good"
    CAUTION = "caution"
    ALARM = "alarm"


class Cell(NamedTuple):
    """A cell of a table."""

    text: str
    tone: Tone = Tone.PLAIN


class GridRow(NamedTuple):
    """A row of a table. `name` is the player that it is about; empty if it is about none."""

    name: str
    cells: Sequence[Cell]


@dataclass(frozen=True)
class Grid:
    """A table, or a list.

    Args:
        rows: one with a single cell is a heading in a list. columns: the headings of a table; empty for a list, whose
            rows have a label and a text. note: what is said above it.
    """

    rows: Sequence[GridRow]
    columns: Sequence[str] = ()
    note: str = ""


def heading(text: str) -> GridRow:
    """The row that begins a part of a list."""
    return GridRow("", [Cell(text)])


def item(text: str, tone: Tone = Tone.PLAIN, label: str = "") -> GridRow:
    """A row of a list; `label` stands before the text."""
    return GridRow("", [Cell(label, Tone.QUIET), Cell(text, tone)])


PLAYER_COLUMNS: Final = ("player", "mode", "m/s", "battery", "driven by", "age")
_STATES: Final = {
    ProcessState.STARTING: Tone.CAUTION,
    ProcessState.RUNNING: Tone.GOOD,
    ProcessState.ENDED: Tone.ALARM,
    ProcessState.AWAY: Tone.ALARM,
}
PROCESS_COLUMNS: Final = (
    "process", "state", "CPU", "MB", "ticks/s", "missed", "refused", "restarts", "ms", "ppm",
)  # fmt: skip


def players(insight: Insight) -> Grid:
    """A row for each player: what it does, how fast, with how much charge, who drives it, and the age of its report."""
    return Grid([_player(insight, player) for player in insight.scene.players], PLAYER_COLUMNS)


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
    found = [_process(row, further=further) for row in insight.processes]
    return Grid(found, PROCESS_COLUMNS, "" if found else words.NO_PROCESSES)


def _process(row: Row, *, further: bool) -> GridRow:
    status, pulse = row.status, row.pulse
    late, drift = (None, None) if pulse is None else (pulse.late, pulse.drift)
    missed, refused = (None, None) if pulse is None else (pulse.missed, pulse.refused)
    return GridRow(
        "",
        (
            Cell(f"{status.machine}: {status.name}" if further else status.name),
            Cell(status.state.value, _STATES[status.state]),
            Cell("" if status.pid is None else f"{status.cpu:.0%}"),
            Cell("" if status.pid is None else f"{status.memory / 1e6:.0f}", Tone.QUIET),
            Cell("" if pulse is None else f"{pulse.frequency:.1f}"),
            Cell("" if missed is None else str(missed), Tone.CAUTION if missed else Tone.QUIET),
            Cell("" if refused is None else str(refused), Tone.ALARM if refused else Tone.QUIET),
            Cell(str(status.restarts), Tone.CAUTION if status.restarts else Tone.QUIET),
            Cell("" if late is None else f"{1e3 * late:.0f}", Tone.ALARM if (late or 0.0) > LATE else Tone.QUIET),
            Cell("" if drift is None else f"{1e6 * drift:+.0f}", Tone.QUIET),
        ),
    )
