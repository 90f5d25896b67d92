"""Sheets for the printer that have exact sizes: the tags of robots, and the board that a lens is calibrated with."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
from matplotlib.figure import Figure

from vrg.ui.letters import spell

A4: Final = (210.0, 297.0)
"""Width and height of the paper, mm."""
EDGE: Final = 5.0
"""What printers leave white at each edge, mm."""
_INCH: Final = 25.4
_FINE: Final = 40
"""Points for a cell, as viewers smooth pictures of few points."""
_RULER: Final = 100.0


@dataclass(frozen=True)
class PrintedTag:
    """A tag to be printed.

    Args:
        name: of the robot, or what it is for. number: which tag it is. size: the length of its sides, m.
        cells: True where it is black, rows from above, its border included.
    """

    name: str
    number: int
    size: float
    cells: npt.NDArray[np.bool_]

    @property
    def whole(self) -> float:
        """The length of its sides with the white around it, of one cell, m."""
        return self.size * (len(self.cells) + 2) / len(self.cells)


def largest_tag(cells: int) -> float:
    """The length of the sides of the largest tag with so many cells along a side that A4 has room for, m."""
    return (A4[0] - 2 * EDGE) / 1000 * cells / (cells + 2)


def tag_sheets(tags: Sequence[PrintedTag]) -> bytes:
    """A PDF with a page for each tag."""
    file = io.BytesIO()
    with PdfPages(file, metadata={"Title": "Tags", "CreationDate": None}) as pages:
        for tag in tags:
            figure, page = _page(*A4)
            _tag(page, tag)
            spell(figure)
            pages.savefig(figure)
    return file.getvalue()


def board_sheet(picture: npt.NDArray[np.uint8], size: tuple[float, float], words: str) -> bytes:
    """A PDF with the board on A4 across.

    Args:
        picture: the board. size: its width and height, m. words: below it.
    """
    file = io.BytesIO()
    with PdfPages(file, metadata={"Title": "Board", "CreationDate": None}) as pages:
        figure, page = _page(*reversed(A4))
        width, height = 1000 * size[0], 1000 * size[1]
        left, lower = (A4[1] - width) / 2, (A4[0] - height) / 2 + 4.0
        _picture(page, picture, (left, lower, left + width, lower + height))
        page.text(A4[1] / 2, lower - 8.0, words, ha="center", va="top", fontsize=9)
        spell(figure)
        pages.savefig(figure)
    return file.getvalue()


def _page(width: float, height: float) -> tuple[Figure, Axes]:
    """A page of a size in mm, in whose axes a unit is a mm."""
    figure = Figure(figsize=(width / _INCH, height / _INCH))
    FigureCanvasPdf(figure)
    page = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    page.set_xlim(0.0, width)
    page.set_ylim(0.0, height)
    page.set_axis_off()
    return figure, page


def _picture(page: Axes, picture: npt.NDArray[np.uint8], place: tuple[float, float, float, float]) -> None:
    """A grey picture at a place: left, lower, right, upper, mm."""
    left, lower, right, upper = place
    limits = page.get_xlim(), page.get_ylim()
    page.imshow(
        picture, cmap="gray", vmin=0, vmax=255, extent=(left, right, lower, upper), interpolation="none", aspect="auto"
    )
    page.set_xlim(*limits[0])
    page.set_ylim(*limits[1])


def _tag(page: Axes, tag: PrintedTag) -> None:
    """A tag with the line to cut along, what it is, and which way the robot drives."""
    side, whole = 1000 * tag.size, 1000 * tag.whole
    middle, upper = A4[0] / 2, A4[1] - 32.0
    left = middle - side / 2
    top = upper - (whole - side) / 2
    fine = np.kron(~tag.cells, np.ones((_FINE, _FINE), dtype=np.bool_)).astype(np.uint8) * np.uint8(255)
    _picture(page, fine, (left, top - side, left + side, top))
    page.plot(
        np.array([-1, 1, 1, -1, -1]) * whole / 2 + middle,
        np.array([0, 0, -1, -1, 0]) * whole + upper,
        color="0.6",
        linewidth=0.5,
        linestyle=(0, (6, 6)),
    )
    page.annotate("", (middle, A4[1] - 10.0), (middle, A4[1] - 24.0), arrowprops={"arrowstyle": "-|>", "lw": 2.0})
    page.text(middle + 8.0, A4[1] - 17.0, "to the front of the robot", va="center", fontsize=11)
    below = upper - whole
    page.text(middle, below - 10.0, tag.name, ha="center", va="top", fontsize=30, parse_math=False)
    words = f"tag {tag.number} of AprilTag 36h11; the black square must be {side:g} mm wide: measure it"
    page.text(middle, below - 26.0, words, ha="center", va="top", fontsize=11)
    words = "Print it at 100 %. Cut along the dashed line: the white border belongs to the tag. Glue it on flat."
    page.text(middle, below - 33.0, words, ha="center", va="top", fontsize=8)
    ruler = below - 46.0
    page.plot([middle - _RULER / 2, middle + _RULER / 2], [ruler, ruler], color="black", linewidth=1.0)
    for end in (-_RULER / 2, _RULER / 2):
        page.plot([middle + end] * 2, [ruler - 2.0, ruler + 2.0], color="black", linewidth=1.0)
    page.text(middle, ruler - 4.0, f"this line is {_RULER:g} mm long", ha="center", va="top", fontsize=8)
