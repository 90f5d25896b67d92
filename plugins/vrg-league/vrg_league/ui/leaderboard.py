"""Pages of tables that can be read from the back of a room and on a telephone: of a tournament, and of a league.

Whatever stands in a page is text.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from vrg.colours import BLUE, ORANGE, WHITE, hexadecimal
from vrg.ui.pages import rendered
from vrg.ui.palette import BACKGROUND, ECHO, INK, LINE, MUTED, RAISED, TEXT

RELOADED_EVERY: Final = 3
"""The time in s after which a browser reads the page again."""
_MINOR: Final = frozenset({"points", "won", "drawn", "lost", "since", "to play", "side", "seed", "match time"})
"""The columns that a telephone has no room for."""
_ROOM: Final = 6
"""The number of rows for which there is always room."""
_COLOURS: Final = {
    "ground": BACKGROUND, "text": TEXT, "muted": MUTED, "line": LINE, "band": RAISED, "first": ORANGE, "second": ECHO,
    "white": WHITE, "ink": INK, "blue": BLUE,
}  # fmt: skip


@dataclass(frozen=True)
class Link:
    """A cell that leads to another page.

    Args:
        text: its text. to: the name of the page's file. about: what a pointer upon it shows.
        more: True marks the cell.
    """

    text: str
    to: str
    about: str = ""
    more: bool = False


Cell = str | Link


@dataclass(frozen=True)
class Block:
    """A part of a page: a table below a heading.

    Args:
        table: the head and the rows; without rows nothing is shown.
        kind: `board` for a leaderboard (rank, name, numbers), `list` (number, name, more), `numbers`, `cross`, or
            `sides` if the rows are the two teams. On a telephone the first three have fewer columns.
        heading: empty for none. command: a command to copy, in place of a table.
        match: the name of the file that shows a match after the table; see `vrg.ui.web.share`.
    """

    table: Sequence[Sequence[Cell]] = ()
    kind: str = "list"
    heading: str = ""
    command: str = ""
    match: str = ""

    @property
    def minor(self) -> Sequence[bool]:
        """Whether a telephone has no room for each of its columns."""
        return [self.kind in ("board", "list", "numbers") and cell in _MINOR for cell in self.table[0]]


def page(
    title: str, notes: Sequence[str], blocks: Sequence[Block], *, reloads: bool, links: Sequence[Link] = ()
) -> str:
    """The page.

    Args:
        notes: lines between the title and the tables. links: to other pages, below the title.
        reloads: True lets browsers read it again and again.
    """
    boards = [block for block in blocks if block.kind == "board"]
    rows = sum(len(block.table) for block in boards) + len(notes) + bool(links)
    text = rendered(
        "tables.html",
        package=__package__,
        title=title,
        notes=notes,
        blocks=blocks,
        links=links,
        reloads=RELOADED_EVERY if reloads else 0,
        rows=max(rows, _ROOM),
        # Many columns have as much room as a few.
        width=round(26 / max(10, *(len(block.table[0]) for block in boards), 0), 2) if boards else 0,
        colours={name: hexadecimal(colour) for name, colour in _COLOURS.items()},
    )
    return str(text)
