"""Fonts of this machine for letters that DejaVu Sans has not, such as those of Chinese, Japanese and Korean names.

Windows, plots and printed sheets use the first installed font that has them all. Where there is none, they are boxes;
`vrg check` tells which names that are. matplotlib, which finds fonts, takes longer to load than a window to open: it is
loaded only where a text has such letters. Without it nobody knows which letters a font has.
"""

import importlib.util
import io
import logging
import warnings
from collections.abc import Iterable
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PACKAGE = "fonts-noto-cjk"
"""The package of Debian and Ubuntu with fonts for Chinese, Japanese and Korean."""


def lacking(text: str) -> frozenset[str]:
    """The letters of a text that DejaVu Sans has not."""
    if text.isascii() or importlib.util.find_spec("matplotlib") is None:
        return frozenset()
    from matplotlib import font_manager  # noqa: PLC0415 - see the module

    own = _letters(Path(font_manager.findfont("DejaVu Sans")))
    return frozenset(letter for letter in text if not letter.isspace() and ord(letter) not in own)


@lru_cache(4096)
def font_for(letter: str) -> Path | None:
    """The first installed font that has a letter; None if DejaVu Sans has it, or no font has."""
    if not lacking(letter):
        return None
    return next((path for path in _installed() if ord(letter) in _letters(path)), None)


def unwritten(names: Iterable[str]) -> list[str]:
    """The names of which windows and plots on this machine can show only boxes."""
    return [name for name in names if any(font_for(letter) is None for letter in lacking(name))]


@cache
def _installed() -> tuple[Path, ...]:
    from matplotlib import font_manager  # noqa: PLC0415 - see the module

    return tuple(sorted(map(Path, font_manager.findSystemFonts())))


@cache
def _letters(path: Path) -> frozenset[int]:
    """The letters of a font, by their numbers; none if it cannot be read."""
    from matplotlib.ft2font import FT2Font  # noqa: PLC0415 - see the module

    try:
        return frozenset(FT2Font(str(path)).get_charmap())
    except (OSError, RuntimeError):
        return frozenset()


def spell(figure: "Figure") -> None:
    """Let every text of a figure be written in a font that has its letters, as far as one is installed."""
    from matplotlib.font_manager import FontProperties, fontManager  # noqa: PLC0415 - see the module
    from matplotlib.text import Text  # noqa: PLC0415 - see the module

    # Not every font has every weight.
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        fonts = dict.fromkeys(filter(None, map(font_for, sorted(lacking(text.get_text())))))
        for path in fonts:
            fontManager.addfont(path)
        if fonts:
            text.set_fontfamily(["DejaVu Sans", *(FontProperties(fname=path).get_name() for path in fonts)])


def png_of(figure: "Figure", **options: Any) -> bytes:
    """A figure as a PNG file.

    Args:
        options: as for matplotlib's `savefig`.
    """
    spell(figure)
    file = io.BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")  # `vrg check` has warned of it
        figure.savefig(file, dpi=130, format="png", **options)
    return file.getvalue()
