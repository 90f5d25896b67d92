"""Pages of tables that can be read from the back of a room and on a telephone: of a tournament, and of a league.

A page needs no other file, no network and no program, and whatever stands in it is text.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

from vrg.colours import BLUE, ORANGE, WHITE, hexadecimal
from vrg.ui.palette import BACKGROUND, ECHO, INK, LINE, MUTED, RAISED, TEXT

RELOADED_EVERY: Final = 3
"""The time in s after which a browser reads the page again."""
_MINOR: Final = frozenset({"points", "won", "drawn", "lost", "since", "to play", "side", "seed", "match time"})
"""The columns that a telephone has no room for."""
_ROOM: Final = 6
"""The number of rows for which there is always room."""
_STYLE: Final = """
:root {{ --ground: {ground}; --text: {text}; --muted: {muted}; --line: {line}; --band: {band}; --first: {first};
  --second: {second}; color-scheme: dark light; }}
@media (prefers-color-scheme: light) {{
  :root {{ --ground: {white}; --text: {ink}; --muted: #4c5866; --line: #c8d0d8; --band: #eef2f6; --first: {blue};
    --second: #b04a00; }}
}}
* {{ box-sizing: border-box; }}
body {{ margin: 0; padding: 2vh 3vw; background: var(--ground); color: var(--text); font-family: sans-serif;
  font-size: clamp(16px, 1.5vw, 30px); line-height: 1.15; }}
/* All rows fit on the screen, as long as they can be read there. */
body.board {{ font-size: clamp(16px, min({width}vw, calc(66vh / {rows})), 64px); }}
h1 {{ margin: 0; font-size: 1.3em; overflow-wrap: anywhere; }}
h2 {{ margin: 1em 0 0.2em; font-size: 1.1em; }}
p {{ margin: 0.2em 0 0.5em; color: var(--muted); font-size: 0.8em; overflow-wrap: anywhere; }}
a {{ color: inherit; text-decoration-color: var(--muted); text-underline-offset: 0.15em; }}
nav {{ font-size: 0.8em; margin-bottom: 0.6em; }}
nav a {{ margin-right: 1.2em; }}
code {{ display: block; padding: 0.5em; background: var(--band); overflow-wrap: anywhere; font-size: 0.8em;
  user-select: all; }}
div {{ overflow-x: auto; }}
table {{ width: 100%; border-collapse: collapse; font-variant-numeric: tabular-nums; }}
th {{ color: var(--muted); font-weight: normal; font-size: 0.7em; border-bottom: 2px solid var(--line); }}
th, td {{ padding: 0.12em 0.4em; text-align: right; white-space: nowrap; }}
table.board th:nth-child(2), table.board td:nth-child(2) {{ text-align: left; width: 99%; max-width: 0;
  overflow: hidden; text-overflow: ellipsis; font-weight: bold; }}
table.list, table.numbers {{ width: auto; }}
table.list th:nth-child(2), table.list td:nth-child(2) {{ text-align: left; }}
table.cross {{ width: auto; font-size: 0.8em; }}
table.cross th, table.cross td {{ text-align: center; min-width: 2.6em; }}
table.cross td:nth-child(2) {{ text-align: left; max-width: 9em; overflow: hidden; text-overflow: ellipsis;
  position: sticky; left: 0; background: var(--ground); }}
table.cross tr:nth-child(even) td:nth-child(2) {{ background: var(--band); }}
table.words td:not(:first-child), table.words th:not(:first-child) {{ text-align: left; }}
table.words td:last-child {{ white-space: normal; width: 99%; }}
table.sides {{ width: auto; }} table.sides th, table.sides td {{ text-align: left; }}
table.sides tr:first-child td:first-child {{ color: var(--first); }}
table.sides tr:last-child td:first-child {{ color: var(--second); }}
tr:nth-child(even) td {{ background: var(--band); }}
tr.first td:nth-child(-n+2) {{ color: var(--first); }}
svg {{ display: block; width: 100%; max-height: 70vh; margin: 0.5em 0; background: var(--band); }}
.one {{ color: var(--first); }} .two {{ color: var(--second); }}
polyline {{ fill: none; stroke: currentColor; stroke-width: 0.08; opacity: 0.35; }} circle {{ fill: currentColor; }}
td.more {{ color: var(--first); font-weight: bold; }}
@media (max-width: 700px) {{ .minor {{ display: none; }} th, td {{ padding: 0.3em 0.3em; }} }}
"""


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
        kind: `board` for a leaderboard (rank, name, numbers), `list` (number, name, more), `numbers`, `cross`, `sides`
            if the rows are the two teams, or `words` if the last column is a text. On a telephone the first three
            have fewer columns.
        heading: empty for none. command: a command to copy, in place of a table. picture: SVG after the table.
    """

    table: Sequence[Sequence[Cell]] = ()
    kind: str = "list"
    heading: str = ""
    command: str = ""
    picture: str = ""


def page(
    title: str, notes: Sequence[str], blocks: Sequence[Block], *, reloads: bool, links: Sequence[Link] = ()
) -> str:
    """The page.

    Args:
        notes: lines between the title and the tables. links: to other pages, below the title.
        reloads: True lets browsers read it again and again.
    """
    boards = [block for block in blocks if block.kind == "board"]
    rows = sum(len(block.table) for block in boards)
    style = _STYLE.format(
        rows=max(rows + len(notes) + bool(links), _ROOM),
        # So many columns have as much room as so few.
        width=round(26 / max(10, *(len(block.table[0]) for block in boards), 0), 2) if boards else 0,
        **{"ground": hexadecimal(BACKGROUND), "text": hexadecimal(TEXT), "muted": hexadecimal(MUTED)},
        **{
            "line": hexadecimal(LINE),
            "band": hexadecimal(RAISED),
            "first": hexadecimal(ORANGE),
            "second": hexadecimal(ECHO),
        },
        **{"white": hexadecimal(WHITE), "ink": hexadecimal(INK), "blue": hexadecimal(BLUE)},
    )
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width">',
        f'<meta http-equiv="refresh" content="{RELOADED_EVERY}">' if reloads else "",
        f"<title>{escape(title)}</title><style>{style}</style></head>",
        f'<body class="{"board" if boards else "plain"}">',
        f"<h1>{escape(title)}</h1>",
        f"<nav>{''.join(_text(link) for link in links)}</nav>" if links else "",
        *(f"<p>{escape(note)}</p>" for note in notes),
        *(_block(block) for block in blocks),
        "</body></html>",
    ]
    return "\n".join(line for line in lines if line) + "\n"


def _block(block: Block) -> str:
    lines = [f"<h2>{escape(block.heading)}</h2>" if block.heading else ""]
    lines.append(f"<code>{escape(block.command)}</code>" if block.command else "")
    if len(block.table) > 1:
        head, *rows = block.table
        minor = [block.kind in ("board", "list", "numbers") and cell in _MINOR for cell in head]
        best = block.kind == "board"
        lines += [
            f'<div><table class="{block.kind}"><thead>{_row(head, "th", minor)}</thead><tbody>',
            *(_row(row, "td", minor, "first" if best and row[0] == "1" else "") for row in rows),
            "</tbody></table></div>",
        ]
    return "\n".join(line for line in [*lines, block.picture] if line)


def _row(cells: Sequence[Cell], kind: str, minor: Sequence[bool], name: str = "") -> str:
    found = []
    for cell, less in zip(cells, minor, strict=True):
        classes = ["minor"] * less + ["more"] * (isinstance(cell, Link) and cell.more)
        found.append(f"<{kind}{_classes(classes)}>{_text(cell)}</{kind}>")
    return f"<tr{_classes([name] * bool(name))}>{''.join(found)}</tr>"


def _classes(names: Sequence[str]) -> str:
    return f' class="{" ".join(names)}"' if names else ""


def _text(cell: Cell) -> str:
    if isinstance(cell, str):
        return escape(cell)
    about = f' title="{escape(cell.about)}"' if cell.about else ""
    return f'<a href="{escape(cell.to)}"{about}>{escape(cell.text)}</a>' if cell.to else escape(cell.text)
