"""The drawer in Chromium, served on the loopback, with a made-up match in place of one that is played."""

from collections.abc import Mapping

import pytest
from heard import Bench

from vrg.testing.views.browser import LAYOUT, SIZES, Visitor
from vrg.ui.web import parts
from vrg.ui.web.drawers import Drawer
from vrg.ui.web.gallery import PRIVATE
from vrg.ui.web.requests import Inspect, PageButton
from vrg.ui.web.server import WebServer
from vrg_views.developer import DETAILS
from vrg_views.developer.part import details


@pytest.fixture
def drawers() -> Mapping[str, Drawer]:
    return {"details": DETAILS}


def wanted(player: str) -> Inspect:
    return Inspect(drawer="details", player=player)


class TestDetails:
    """The drawer of the details, for officials."""

    @pytest.fixture
    def official(self, visit, server) -> Visitor:
        """A page whose link opens the drawer, and that shows a match of three robots."""
        bench = Bench()
        bench.scan("robot1")
        bench.ticks(2)
        scene, names = bench.insight().scene, ("", "robot1", "robot2")
        told = {name: {"t": "drawer", "drawer": "details", "data": details(bench.insight(name))} for name in names}
        self.details = {PRIVATE + wanted(name).part: parts.encode(part) for name, part in told.items()}
        server.show(parts.parts(scene))
        page = visit("official&details")
        self.show(page, server, "")
        page.wait("vrg.drawers.open?.data && vrg.field.plates.length === 3")
        return page

    def show(self, page: Visitor, server: WebServer, selected: str) -> None:
        """Show the details once a drawer wants those of a player; before, they are for nobody."""
        for _ in range(1000):
            if wanted(selected) in server.inspected:
                break
            page.page.wait_for_timeout(20)
        assert wanted(selected) in server.inspected
        server.show(self.details)

    def names(self, page: Visitor) -> list[str]:
        """What stands in the first column."""
        found: list[str] = page.page.eval_on_selector_all(
            "#table tbody td:first-child", "all => all.map(c => c.textContent)"
        )
        return found

    def test_a_table_is_filtered_by_typing_and_sorted_by_its_headings(self, official, server):
        assert self.names(official) == ["robot1", "robot2", "robot3"]
        official.page.fill("#filter", "ROBOT3")
        assert self.names(official) == ["robot3"]
        official.page.click("[data-tab=streams]")
        first = self.names(official)
        assert len(first) > 3, "each table has its own filter"
        for pressed, order in (("key", sorted(first)), ("key", sorted(first)[::-1]), ("key", first)):
            official.page.click(f"[data-heading='{pressed}']")
            assert self.names(official) == order
        rates = "#table tbody td:nth-child(3)"
        official.page.click("[data-heading='Hz']")
        found = official.page.eval_on_selector_all(rates, "all => all.map(c => parseFloat(c.textContent))")
        assert found == sorted(found, reverse=True)
        assert len(set(found)) > 1
        official.page.click("[data-tab=players]")
        assert self.names(official) == ["robot3"]
        official.page.type("#filter", "hcr")
        official.page.wait_for_timeout(200)
        assert server.wishes().decisions == (), "letters that are typed there are no keys of an official's"

    def test_a_robot_that_is_clicked_is_shown_and_may_be_disqualified(self, official, server):
        assert official.page.locator("#on-player").is_hidden()
        x, y = official.page.evaluate("({ x, y } = vrg.field.robots[0].circle, [x, y])")
        official.page.mouse.click(x, y)
        self.show(official, server, "robot1")
        official.wait("vrg.drawers.open.data?.selected === 'robot1'")
        assert "Search/Turn" in official.text("#table")
        official.wait("vrg.drawers.open.shapes.some(({ radius }) => radius)")
        official.page.uncheck("#layers label:has-text('Scan') input")
        official.wait("!vrg.drawers.open.shapes.some(({ radius }) => radius)")
        official.page.click("#disqualify")
        for _ in range(500):
            if decisions := server.wishes().decisions:
                break
            official.page.wait_for_timeout(20)
        assert [(d.what, d.player) for d in decisions] == [(PageButton.DISQUALIFY, "robot1")]
        official.page.click("[data-tab=players]")
        official.page.click("#table td:text('robot2')")
        self.show(official, server, "robot2")
        official.wait("vrg.drawers.open.data?.selected === 'robot2'")

    def test_it_asks_for_nothing_while_it_is_closed_and_others_have_none(self, official, visit, server):
        assert server.inspected == {wanted("")}
        official.page.click("#drawers button")
        official.wait("!vrg.drawers.open")
        assert official.page.locator("#details").is_hidden()
        for _ in range(500):
            if not server.inspected:
                break
            official.page.wait_for_timeout(20)
        assert server.inspected == frozenset()
        driver = visit("player2&details")
        driver.wait("vrg.match.role === 'seat'")
        assert driver.page.locator("#drawers button").count() == 0
        assert driver.page.locator("#details").count() == 0

    def test_everything_in_it_has_room(self, official):
        for width, height in SIZES:
            official.page.set_viewport_size({"width": width, "height": height})
            for tab in ("players", "player", "streams"):
                official.page.click(f"[data-tab={tab}]")
                frame = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
                official.page.evaluate(frame)
                found = official.page.evaluate(LAYOUT)
                assert (found["cut"], found["scrolls"], found["reachable"]) == ([], False, True), f"{width}x{height}"
                assert official.page.locator("#sheet").bounding_box()["height"] > 150
