"""The details as the page asks for them: drawn up by its node, and heard while somebody has the drawer open."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.testing.views import synthetic
from vrg.testing.views.viewers import Viewers
from vrg.ui.web.drawers import DRAWERS
from vrg.ui.web.node import WebNode
from vrg.ui.web.requests import Inspect
from vrg_views.developer import DETAILS
from vrg_views.developer.part import Details


class Bus:
    """Counts who listens."""

    opened = 0

    def collect_raw(self, expression: str, limit: int) -> "Bus":
        self.opened += 1
        return self

    def __call__(self) -> list[tuple[str, bytes]]:
        return []

    def close(self) -> None:
        self.opened -= 1


@pytest.fixture
def bus() -> Bus:
    return Bus()


@pytest.fixture
def audience() -> Viewers:
    return Viewers()


@pytest.fixture
def node(keys: Keys, audience: Viewers, bus: Bus) -> WebNode:
    """A page with the drawer, of which an installed package tells."""
    on = SimpleNamespace(setup=SimpleNamespace(keys=keys, players=[]), join=lambda: bus, official=True)
    content = DRAWERS.get("details").content(on)
    assert isinstance(content, Details)
    return WebNode("web", Mailbox(), keys, audience, drawers={"details": content})


def test_it_has_a_row_for_each_player_and_what_is_told_of_the_one_that_is_selected(
    node: WebNode, keys: Keys, audience: Viewers
) -> None:
    match = synthetic.SyntheticMatch(keys)
    audience.inspected = frozenset({Inspect(drawer="details"), Inspect(drawer="details", player="nemo")})
    for number in range(50):
        match.step(node, number * node.period, number)
    shown: Mapping[str, Any] = next(frame for frame in reversed(audience.frames) if "drawer/details/nemo" in frame)
    nobody, nemo = (shown[f"drawer/details/{name}"]["data"] for name in ("", "nemo"))
    assert (nobody["selected"], nemo["selected"]) == ("", "nemo")
    assert [name for name, _ in nemo["tabs"]["players"]["rows"]] == list(synthetic.NAMES)


def test_it_listens_to_everything_only_while_somebody_wants_details(
    node: WebNode, keys: Keys, audience: Viewers, bus: Bus
) -> None:
    match = synthetic.SyntheticMatch(keys)
    for number, (wanted, watched) in enumerate([((), True), (("",), True), (("",), True), ((), False)]):
        audience.inspected = frozenset(Inspect(drawer="details", player=player) for player in wanted)
        audience.watched = watched
        match.step(node, 5.0 + number, number)
        assert bus.opened == len(wanted)


def test_the_page_finds_its_script() -> None:
    assert DRAWERS.get("details") is DETAILS
    assert (DETAILS.folder / "drawer.js").is_file()
