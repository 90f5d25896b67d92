"""Shows the match as text: a live table in a terminal, plain lines where the output is a file or a CI log."""

import io
import math
from typing import ClassVar, Final

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call, Stage
from vrg.bus.node import Node, Tick, due_index
from vrg.bus.topics import Keys
from vrg.colours import hexadecimal
from vrg.games import game_of
from vrg.games.game import Game, Marker, title
from vrg.types import few
from vrg.ui import palette
from vrg.ui.banner import Help, banners
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.headline import winner_words
from vrg.ui.pace import Pace
from vrg.ui.processes import Board, process_table
from vrg.ui.scene import Scene, ScenePlayer, clock_text, speed_text

STATUS_EVERY: Final = 5.0
"""s of match time between status lines where the output is no terminal."""
REDRAW: Final = 0.25
"""s of real time between redraws of a terminal."""
CALLS_SHOWN: Final = 6
LONGEST_NAME: Final = 24
"""The characters of a name that are shown."""
LEAST_HEIGHT: Final = 12
"""The lines that the match needs at least, if processes are shown below."""
CALLS_LEAST: Final = 2
"""Calls for which there must be room, or else the players stand beside each other."""

_COLUMNS: Final = {
    "player": 0, "role": 50, "state": 0, "x, m": 76, "y, m": 76, "heading": 92, "m/s": 64, "battery": 84, "does": 0,
}  # fmt: skip
"""The columns of a player, each with the width of the terminal from which on it is shown."""
_NUMBERS: Final = {"x, m", "y, m", "heading", "m/s", "battery"}
_SIGNS: Final = {
    Marker.TRIANGLE: "▲",
    Marker.CIRCLE: "●",
    Marker.SQUARE: "■",
    Marker.DIAMOND: "◆",
    Marker.CROSS: "✕",
}


class TerminalTable(Node):
    """Shows a match without a display. Colours obey NO_COLOR.

    Args:
        console: where to write; standard output if it is missing. On a terminal the table is redrawn in place,
            else each call is one line, and every 5 s of match time there is one line of status.
        processes: True shows the processes of all machines below the match, where there is room.
        means: of those who look at the terminal, by which play goes on.
    """

    kind: ClassVar[str] = "spectator"

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        *,
        console: Console | None = None,
        period: float = 0.25,
        processes: bool = False,
        means: Help = Help.COMMANDS,
    ) -> None:
        super().__init__(name, mailbox, period)
        self._means = means
        self._console = console or Console(highlight=False)
        self._inlets = SceneInlets(mailbox, keys)
        self._builder = SceneBuilder()
        self._board = Board(mailbox, keys) if processes else None
        self._pace = Pace(REDRAW)
        self._live: Live | None = None
        self._status_due: int | None = None
        self._alarms: set[str] = set()

    def tick(self, tick: Tick) -> None:
        """Take messages in and show the match."""
        calls = self._inlets.feed(self._builder)
        scene = self._builder.build(tick.live)
        if not self._console.is_terminal:
            self._print(scene, calls)
        elif self._pace.due(tick, scene.rate):
            self._redraw(scene)

    def stop(self) -> None:
        """Leave the last table on the terminal. Calling it again does nothing."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _redraw(self, scene: Scene) -> None:
        if self._live is None:
            # Without its own thread: a node is drawn when it ticks.
            self._live = Live(console=self._console, auto_refresh=False)
            self._live.start()
        size = self._console.size
        shown: RenderableType = table(scene, size.width, size.height, self._means)
        if self._board is not None:
            below = process_table(self._board.look())
            # One line is left for the prompt.
            room = size.height - 1 - _height(below, size.width)
            if room >= LEAST_HEIGHT:
                shown = Group(table(scene, size.width, room, self._means), below)
        self._live.update(shown, refresh=True)

    def _print(self, scene: Scene, calls: list[Call]) -> None:
        for call in calls:
            self._line(f"{clock_text(call.clock)}  {call.rule}: {call.text}")
        if scene.stage is None:
            return
        # The call tells that the game is over, and what follows tells how it ended.
        over = winner_words(scene)[0] if scene.stage is Stage.GAME_OVER else ""
        found = [banner for banner in banners(scene, self._means) if banner.heading != over]
        headings = {banner.heading for banner in found}
        if scene.stage is Stage.GAME_OVER and headings <= self._alarms:
            return  # all is printed
        due = due_index(scene.time, STATUS_EVERY)
        status = due != self._status_due
        self._status_due = due
        if status:
            self._line(status_line(scene))
        # What hinders the match is printed when it begins and with each status: its words change all the time.
        for banner in found:
            if status or banner.heading not in self._alarms:
                text = few(banner.text.split("; "), "; ") if banner.brief else banner.text
                self._line(f"{banner.heading}: {text}" if text else banner.heading)
        self._alarms = headings

    def _line(self, text: str) -> None:
        # Whole lines: what reads a log wants to search it, not to see it wrapped.
        self._console.print(Text(text), soft_wrap=True)


def status_line(scene: Scene) -> str:
    """The match in one line."""
    stage = title(scene.stage.value) if scene.stage is not None else "no referee"
    score = ", ".join(f"{team} {points}" for team, points in scene.score)
    playing = sum(not player.out_of_play for player in scene.players)
    return (
        f"{clock_text(scene.clock)}  {stage}, {game_of(scene.game).round_word} {scene.round} of {scene.rounds}"
        f"; {score or 'no score'}; {playing} of {len(scene.players)} players in play"
    )


def table(scene: Scene, width: int = 120, height: int = 50, means: Help = Help.COMMANDS) -> RenderableType:
    """The match as a table for rich, for a terminal of this many columns and lines.

    Where the lines do not suffice, the players stand beside each other and there are fewer calls; where the columns do
    not, each player has fewer columns. Words have the terminal's own colours, so that they can be read on any ground.
    """
    parts: list[RenderableType] = [_heading(scene)]
    for banner in banners(scene, means):
        text = Text(
            f" {banner.heading} ",
            style=f"bold {hexadecimal(palette.ink_on(banner.colour))} on {hexadecimal(banner.colour)}",
        )
        text.append("  " + banner.text, style="not bold")
        parts.append(text)
    inside = max(1, width - 4)
    room = height - 2 - sum(_height(part, inside) for part in parts)
    players, calls = _players(scene, inside), min(CALLS_LEAST, len(scene.calls))
    taken = _height(players, inside)
    if taken + calls > room:
        players = _players_beside(scene, inside)
        taken = _height(players, inside)
    parts += [players, _calls(scene, inside, max(1, room - taken))]
    return Panel(
        Group(*parts),
        title=game_of(scene.game).title or title(scene.game) or "Waiting for the referee",
        title_align="left",
    )


def _height(part: RenderableType, width: int) -> int:
    """The number of lines that a part takes at a width."""
    console = Console(width=width, file=io.StringIO())
    return len(console.render_lines(part, console.options))


def _heading(scene: Scene) -> Text:
    text = Text()
    if scene.stage is None:
        return text
    text.append(title(scene.stage.value), style="bold green")
    text.append(f"   {game_of(scene.game).round_word} {scene.round} of {scene.rounds}   ")
    text.append(clock_text(scene.clock), style="bold")
    for team, points in scene.score:
        text.append(f"   {title(team)} ")
        text.append(str(points), style="bold")
    for thing in (thing for thing in scene.objects if thing.words):
        text.append(f"   {thing.words}", style="bold" if thing.carrier else "dim")
    return text


def _players(scene: Scene, width: int) -> Table:
    """A line for each player, with as much of it as there is room for."""
    grid = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    shown = [name for name, least in _COLUMNS.items() if width >= least]
    for name in shown:
        grid.add_column(
            name, justify="right" if name in _NUMBERS else "left", no_wrap=name in _NUMBERS or name == "player"
        )
    game = game_of(scene.game)
    poses = {body.name: body.pose for body in scene.bodies}
    for player in scene.players:
        pose = poses.get(player.name)
        does = player.fault or ("driven by hand" if player.by_hand else player.mode)
        cells = {
            "player": _name(player, game),
            "role": Text(player.role),
            "state": Text(player.state),
            "x, m": Text(f"{pose.x:.2f}" if pose else "?"),
            "y, m": Text(f"{pose.y:.2f}" if pose else "?"),
            "heading": Text(f"{_degrees(pose.theta):.0f}°" if pose else "?"),
            "m/s": Text("?" if player.speed is None else speed_text(player.speed)),
            "battery": Text("" if player.battery is None else f"{player.battery:.0%}"),
            "does": Text(does, style="bold red" if player.fault else ""),
        }
        grid.add_row(*(cells[name] for name in shown))
    return grid


def _players_beside(scene: Scene, width: int) -> Table:
    """Two or three players in a line, each with what it does."""
    columns = max(1, min(3, width // 26))
    game = game_of(scene.game)
    cell = max(8, width // columns)
    names = min(max((len(p.name) for p in scene.players), default=0), max(4, cell // 2 - 4))
    grid = Table.grid(padding=(0, 1, 0, 0))
    for _ in range(columns):
        grid.add_column(no_wrap=True, width=names + 2)
        grid.add_column(no_wrap=True, width=max(1, cell - names - 4), overflow="ellipsis")
    rows = -(-len(scene.players) // columns)
    for row in range(rows):
        cells: list[RenderableType] = []
        for player in scene.players[row::rows]:
            does = player.fault or ("by hand" if player.by_hand else player.mode.rpartition("/")[2])
            word = player.state if player.out_of_play else does
            cells += [_name(player, game, names), Text(word, style="bold red" if player.fault else "")]
        grid.add_row(*cells)
    return grid


def _name(player: ScenePlayer, game: Game, longest: int = LONGEST_NAME) -> Text:
    style = game.style(player.role, player.state)
    name = player.name
    if len(name) > longest:
        # Names often differ at their ends.
        name = f"{name[: (longest - 1) // 2]}…{name[-(longest // 2) :]}"
    return Text.assemble((_SIGNS[style.marker], hexadecimal(style.colour)), f" {name}")


def _calls(scene: Scene, width: int, room: int) -> Group:
    """The last calls, whole if there are enough lines, or else each shortened to one line."""
    calls = [Text.assemble((clock_text(call.clock), "dim"), "  ", call.text) for call in scene.calls[-CALLS_SHOWN:]]
    if sum(_height(call, width) for call in calls) <= room:
        return Group(*calls)
    for call in calls:
        call.truncate(width, overflow="ellipsis")
    return Group(*calls[-room:])


def _degrees(theta: float) -> float:
    return math.degrees(math.remainder(theta, 2 * math.pi))
