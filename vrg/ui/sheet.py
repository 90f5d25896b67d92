"""A sheet for the printer: for each seat what it is for, and a link, also as a QR code to scan."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

import segno

_STYLE: Final = """
body { margin: 1cm; font-family: sans-serif; color: black; background: white; }
h1 { font-size: 14pt; }
section { display: inline-flex; gap: 5mm; width: 46%; margin: 2mm 1%; padding: 4mm; border: 1px dashed grey;
  break-inside: avoid; vertical-align: top; box-sizing: border-box; }
section div { min-width: 0; }
svg { width: 38mm; height: 38mm; flex: none; }
h2 { margin: 0; font-size: 16pt; overflow-wrap: anywhere; }
p { margin: 1mm 0; font-size: 9pt; overflow-wrap: anywhere; }
"""


@dataclass(frozen=True)
class Strip:
    """A strip of the sheet, for one person.

    Args:
        name: of the seat. purpose: in words. link: what the QR code holds.
    """

    name: str
    purpose: str
    link: str


def page(title: str, strips: Sequence[Strip]) -> str:
    """The sheet as a page of HTML, which needs no other file and no network."""
    return "\n".join(
        [
            "<!DOCTYPE html>",
            f'<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>',
            f"<style>{_STYLE}</style></head><body><h1>{escape(title)}</h1>",
            *map(_section, strips),
            "</body></html>\n",
        ]
    )


def _section(strip: Strip) -> str:
    code = segno.make(strip.link, micro=False, error="m").svg_inline(omitsize=True, border=4)
    words = f"<h2>{escape(strip.name)}</h2><p>{escape(strip.purpose)}</p><p>{escape(strip.link)}</p>"
    return f"<section>{code}<div>{words}</div></section>"
