"""The leaderboard as a page."""

from vrg_league.ui.leaderboard import Block, Link, page

ROWS = [["rank", "strategy", "points"], ["1", "<script>alert('x')</script>", "3"], ["2", "Anna Maria", "1"]]
TABLE = [Block(ROWS, "board")]


def test_names_are_text_and_no_html() -> None:
    text = page("a & b", ["left out: <i>"], TABLE, reloads=True)
    assert "<script" not in text
    assert "<td>&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;</td>" in text
    assert "<title>a &amp; b</title>" in text
    assert "<p>left out: &lt;i&gt;</p>" in text
    assert '<tr class="first"><td>1</td>' in text


def test_it_reloads_itself_until_the_tournament_is_over_and_needs_no_network() -> None:
    assert 'http-equiv="refresh"' in page("cup", [], TABLE, reloads=True)
    last = page("cup", [], TABLE, reloads=False)
    assert "refresh" not in last
    assert "http:" not in last
    assert "src=" not in last


def test_cells_that_lead_elsewhere_are_text_too_and_a_telephone_has_fewer_columns() -> None:
    link = Link('<b>"ann"', 'entry-1.html"onclick="x', about='1 < 2 "')
    blocks = [Block([["rank", "strategy", "won"], ["2", link, "1"]], "board"), Block(command="vrg play '<x>'")]
    text = page("cup", [], blocks, reloads=False, links=[Link("a & b", "index.html")])
    cell = '<a href="entry-1.html&#34;onclick=&#34;x" title="1 &lt; 2 &#34;">&lt;b&gt;&#34;ann&#34;</a>'
    assert f"<td>{cell}</td>" in text
    assert '<td class="minor">1</td>' in text
    assert "<code>vrg play &#39;&lt;x&gt;&#39;</code>" in text
    assert '<nav><a href="index.html">a &amp; b</a></nav>' in text
