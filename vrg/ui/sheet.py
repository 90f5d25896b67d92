"""A sheet for the printer: for each seat what it is for, and a link, also as a QR code to scan."""

from collections.abc import Sequence
from dataclasses import dataclass

import segno
from markupsafe import Markup

from vrg.ui.pages import rendered


@dataclass(frozen=True)
class Strip:
    """A strip of the sheet, for one person.

    Args:
        name: of the seat. purpose: in words. link: what the QR code holds.
    """

    name: str
    purpose: str
    link: str

    @property
    def code(self) -> Markup:
        """The QR code, as SVG."""
        return Markup(segno.make(self.link, micro=False, error="m").svg_inline(omitsize=True, border=4))


def page(title: str, strips: Sequence[Strip]) -> str:
    """The sheet as a page of HTML, which needs no other file and no network."""
    return str(rendered("sheet.html", title=title, strips=strips))
