"""The leaderboard of a tournament as a page that can be read from the back of a room, and reloads itself."""

from collections.abc import Sequence
from html import escape
from typing import Final

from vrg.colours import BLUE, ORANGE, WHITE, hexadecimal
from vrg.ui.palette import BACKGROUND, INK, LINE, MUTED, RAISED, TEXT

RELOADED_EVERY: Final = 3
"""The time in s after which a browser reads the page again."""
_STYLE: Final = """
:root {{ --ground: {ground}; --text: {text}; --muted: {muted}; --line: {line}; --band: {band}; --first: {first}; }}
@media (prefers-color-scheme: light) {{
  :root {{ --ground: {white}; --text: {ink}; --muted: #4c5866; --line: #c8d0d8; --band: #eef2f6; --first: {blue}; }}
}}
* {{ box-sizing: border-box; }}
body {{ margin: 0; padding: 2vh 3vw; background: var(--ground); color: var(--text); font-family: sans-serif;
  /* All rows fit on the screen, as long as they can be read there. */
  font-size: clamp(16px, min(2.6vw, calc(66vh / {rows})), 64px); line-height: 1.15; }}
h1 {{ margin: 0; font-size: 1.3em; }}
p {{ margin: 0.2em 0 0.5em; color: var(--muted); font-size: 0.8em; overflow-wrap: anywhere; }}
table {{ width: 100%; border-collapse: collapse; font-variant-numeric: tabular-nums; }}
th {{ color: var(--muted); font-weight: normal; font-size: 0.7em; border-bottom: 2px solid var(--line); }}
th, td {{ padding: 0.12em 0.4em; text-align: right; white-space: nowrap; }}
th:nth-child(2), td:nth-child(2) {{ text-align: left; width: 99%; max-width: 0; overflow: hidden;
  text-overflow: ellipsis; font-weight: bold; }}
tr:nth-child(even) td {{ background: var(--band); }}
tr.first td:nth-child(-n+2) {{ color: var(--first); }}
"""


def page(title: str, notes: Sequence[str], table: Sequence[Sequence[str]], *, reloads: bool) -> str:
    """The page, which needs no other file and no network.

    Args:
        notes: lines between the title and the table.
        table: the head and the rows, the best first: rank, name, and numbers.
        reloads: True lets browsers read it again and again.
    """
    head, *rows = table
    style = _STYLE.format(
        rows=max(len(rows) + len(notes) + 1, 6),
        **{"ground": hexadecimal(BACKGROUND), "text": hexadecimal(TEXT), "muted": hexadecimal(MUTED)},
        **{"line": hexadecimal(LINE), "band": hexadecimal(RAISED), "first": hexadecimal(ORANGE)},
        **{"white": hexadecimal(WHITE), "ink": hexadecimal(INK), "blue": hexadecimal(BLUE)},
    )
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width">',
        f'<meta http-equiv="refresh" content="{RELOADED_EVERY}">' if reloads else "",
        f"<title>{escape(title)}</title><style>{style}</style></head><body>",
        f"<h1>{escape(title)}</h1>",
        *(f"<p>{escape(note)}</p>" for note in notes),
        f"<table><thead>{_row(head, 'th')}</thead><tbody>",
        *(_row(row, "td", "first" if row[0] == "1" else "") for row in rows),
        "</tbody></table></body></html>",
    ]
    return "\n".join(line for line in lines if line) + "\n"


def _row(cells: Sequence[str], kind: str, name: str = "") -> str:
    words = "".join(f"<{kind}>{escape(cell)}</{kind}>" for cell in cells)
    return f'<tr class="{name}">{words}</tr>' if name else f"<tr>{words}</tr>"
