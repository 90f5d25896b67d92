"""Names in letters that DejaVu Sans has not are written in the first installed font that has them."""

from pathlib import Path

import pytest
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from matplotlib.figure import Figure

from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY
from vrg.ui import letters
from vrg.ui.window.text import Fonts

NAME = "小明"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A font with two letters, each a square, which alone is installed."""
    builder = FontBuilder(1000)
    pen = TTGlyphPen(None)
    pen.moveTo((0, 0))
    for point in ((0, 900), (900, 900), (900, 0)):
        pen.lineTo(point)
    pen.closePath()
    square = pen.glyph()
    builder.setupGlyphOrder([".notdef", "a", "b"])
    builder.setupCharacterMap({ord(NAME[0]): "a", ord(NAME[1]): "b"})
    builder.setupGlyf({".notdef": TTGlyphPen(None).glyph(), "a": square, "b": square})
    builder.setupHorizontalMetrics(dict.fromkeys([".notdef", "a", "b"], (1000, 0)))
    builder.setupHorizontalHeader(ascent=900, descent=-100)
    builder.setupNameTable({"familyName": "Squares", "styleName": "Regular"})
    builder.setupOS2()
    builder.setupPost()
    path = tmp_path / "squares.ttf"
    builder.save(path)
    monkeypatch.setattr(letters, "_installed", lambda: (path,))
    letters.font_for.cache_clear()
    yield path
    letters.font_for.cache_clear()


def test_a_letter_that_is_missing_is_taken_from_a_font_that_has_it(installed: Path) -> None:
    assert [letters.font_for(letter) for letter in (NAME[0], "é", "a", "み")] == [installed, None, None, None]
    assert letters.unwritten(["ann", "é1", NAME, "みか"]) == ["みか"]
    fonts = Fonts()
    black = fonts.render(f"é{NAME}1", 40, (0, 0, 0))
    assert black.get_width() == fonts.width(f"é{NAME}1", 40)
    squares = fonts.render(NAME, 40, (0, 0, 0))
    inked = sum(squares.get_at((x, 10))[3] > 200 for x in range(squares.get_width()))
    assert inked > 0.8 * squares.get_width(), "squares, not the frames of boxes"


def test_plots_write_it_too(installed: Path) -> None:
    figure = Figure()
    text = figure.text(0.5, 0.5, f"{NAME} wins")
    assert letters.png_of(figure).startswith(b"\x89PNG")
    assert text.get_fontfamily() == ["DejaVu Sans", "Squares"]


def test_a_check_names_whom_no_font_can_write(installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(TINY.replace('"ann"', '"みか"').replace('"bob"', f'"{NAME}"'))
    done = invoke("check", "m.toml")
    assert "note: no font of this machine has the letters of みか, so windows and plots show boxes" in done.output
