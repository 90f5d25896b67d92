"""The sheet with the links of a match's seats."""

import re

import segno

from vrg.ui.sheet import Strip, page

LINK = "http://192.168.1.5:8080/#y2NERmY99M5RohyjMrEvLw"


def test_each_seat_has_a_strip_with_its_own_code() -> None:
    text = page("final & more", [Strip("<b>max", "drive", LINK), Strip("watch", "watch", "http://a/")])
    assert text.count("<section>") == text.count("<svg") == 2
    assert "<title>final &amp; more</title>" in text
    assert "<h2>&lt;b&gt;max</h2>" in text
    assert "<b>" not in text
    codes = re.findall(r"<svg.*?</svg>", text)
    assert codes[0] == segno.make_qr(LINK, error="m").svg_inline(omitsize=True, border=4)
    assert codes[0] != codes[1]
    assert "src=" not in text
