"""Who is let in to the view in three dimensions, and what a browser shows of a match."""

import socket
import time
from collections.abc import Iterator

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.errors import LaunchError
from vrg.hal.models import robot_model
from vrg.recording.recorded import read_recorded
from vrg.testing.views import synthetic
from vrg.testing.views.browser import Visitor, chromium
from vrg.testing.views.synthetic import scene_at
from vrg.ui.scene import Scene
from vrg.ui.timeline import Timeline
from vrg_views.three import theatre as module
from vrg_views.three.node import FRAME, ThreeNode
from vrg_views.three.replay import ThreeReplay
from vrg_views.three.theatre import Theatre

WEBGL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
"""The flags with which it draws in three dimensions without a graphics card, slowly."""

ROBOTS = dict.fromkeys(synthetic.NAMES, robot_model("P2AT"))
GOING_AWAY = 1008
"""The code with which a WebSocket is closed for a reason of policy."""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        found: int = probe.getsockname()[1]
        return found


@pytest.fixture
def theatre() -> Iterator[Theatre]:
    opened = Theatre(ROBOTS, "127.0.0.1", free_port(), "test")
    opened.open()
    opened.show(scene_at(4.0), FRAME)
    yield opened
    opened.close()


def visit(theatre: Theatre, *, host: str = "127.0.0.1", origin: str | None = None) -> ClientConnection:
    """Connect as a page does that was loaded under the name `host`, or by a page of `origin`."""
    port = theatre.server.get_port()
    with socket.create_connection(("127.0.0.1", port)) as probe:
        sock = probe.dup()
    return connect(
        f"ws://{host}:{port}", sock=sock, subprotocols=[f"viser-v{module.viser.__version__}"], proxy=None,
        origin=origin or f"http://{host}:{port}",
    )  # fmt: skip


def test_a_page_that_is_served_here_hears_the_match(theatre: Theatre) -> None:
    with visit(theatre) as page:
        assert len(page.recv(timeout=30)) > 1000


@pytest.mark.parametrize(
    "stranger", [{"origin": "http://evil.example"}, {"host": "evil.example"}], ids=["another site", "a rebound name"]
)
def test_a_page_of_another_site_hears_nothing(theatre: Theatre, stranger: dict[str, str]) -> None:
    with visit(theatre, **stranger) as page, pytest.raises(ConnectionClosed) as closed:
        page.recv(timeout=30)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == GOING_AWAY


def test_one_page_too_many_is_told_so(theatre: Theatre, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "VIEWERS", 1)
    with visit(theatre) as first:
        assert first.recv(timeout=30)
        with visit(theatre) as second, pytest.raises(ConnectionClosed, match="close one"):
            second.recv(timeout=30)


def test_what_is_no_more_on_the_field_is_taken_away(theatre: Theatre) -> None:
    nodes = theatre.server.scene
    assert nodes.get_handle_by_name("/robots/P2AT/paint") is not None
    theatre.show(Scene(), FRAME)
    assert nodes.get_handle_by_name("/robots/P2AT/paint") is None
    theatre.show(scene_at(5.0), FRAME)
    assert nodes.get_handle_by_name("/robots/P2AT/paint") is not None


def test_no_viewer_opens_a_tunnel_to_the_internet(theatre: Theatre) -> None:
    assert theatre.server.request_share_url() is None


def test_a_port_that_somebody_has_is_no_other_port(theatre: Theatre) -> None:
    second = Theatre(ROBOTS, "127.0.0.1", theatre.server.get_port(), "test")
    with pytest.raises(LaunchError, match="not free"):
        second.open()


@pytest.mark.thorough
def test_a_node_and_a_replay_show_the_match_to_a_browser(recorded) -> None:
    """One browser sees a running match, with the buttons that choose a camera, and then a recorded one."""
    keys = Keys("test")
    node = ThreeNode("three", Mailbox(), keys, Theatre(ROBOTS, "127.0.0.1", free_port(), "test"), robots=ROBOTS)
    match = synthetic.SyntheticMatch(keys)
    with chromium(*WEBGL) as browser:
        node.start()
        try:
            page = Visitor(browser, f"http://127.0.0.1:{node.theatre.server.get_port()}", (240, 150))
            number = 0
            deadline = time.monotonic() + 120.0
            while "Sharks" not in page.page.content() and time.monotonic() < deadline:
                number += 1
                match.step(node, number * FRAME, number)
                page.page.wait_for_timeout(20)
            page.wait_text(".board", "Minnows")
            assert not page.page.get_by_role("button", name="Follow").is_visible(), "it hides the field"
            page.page.get_by_text("View", exact=True).click()
            page.page.get_by_role("button", name="Follow").click()
            for _ in range(20):
                number += 1
                match.step(node, number * FRAME, number)
                page.page.wait_for_timeout(20)
            assert len(node.theatre.followed & set(synthetic.NAMES)) == 1
            assert _colours(page) > 50
            page.close()
        finally:
            node.stop()
        replay = ThreeReplay(
            Theatre(ROBOTS, "127.0.0.1", port := free_port(), "test"), Timeline(read_recorded(recorded))
        )
        seen: list[Visitor] = []

        def wait(_seconds: float) -> bool:
            if not seen:
                seen.append(Visitor(browser, f"http://127.0.0.1:{port}", (240, 150)))
            seen[0].page.wait_for_timeout(30)
            return "Pause" in seen[0].page.content() and "Minnows" in seen[0].page.content()

        replay.run(wait)


def _colours(page: Visitor) -> int:
    """How many colours the picture in three dimensions has."""
    found: int = page.page.evaluate(
        """() => {
            const canvas = [...document.querySelectorAll("canvas")].find((one) => one.dataset.engine);
            const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
            copy.drawImage(canvas, 0, 0);
            const data = new Uint32Array(copy.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
            return new Set(data).size;
        }"""
    )
    return found
