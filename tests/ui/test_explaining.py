"""The card that tells why a call was made: how it is asked for, worked out and drawn."""

import threading
import time

import pygame
import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call
from vrg.bus.topics import Keys
from vrg.coordinator.proof import Measure, Relation
from vrg.errors import LaunchError
from vrg.testing.views import synthetic
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.plots.proof import Proof
from vrg.ui.scene import Scene, SceneBody
from vrg.ui.window.card import CardPainter
from vrg.ui.window.explaining import Card, Explainer
from vrg.ui.window.spectator import Spectator
from vrg.ui.window.text import Fonts

CALL = Call(number=7, rule="tag", text="ann is tagged by bob", players=(), poses=(), clock=12.3)


def worked_out(explainer: Explainer) -> Card:
    """The card when nothing more comes."""
    deadline = time.monotonic() + 60.0
    while explainer.card is not None and explainer.card.busy and time.monotonic() < deadline:
        explainer.look()
        time.sleep(0.02)
    assert explainer.card is not None
    return explainer.card


def test_without_a_run_folder_the_rule_is_told_and_where_to_ask() -> None:
    explainer = Explainer(None)
    explainer.ask(CALL, "sharks-and-minnows")
    card = explainer.card
    assert card is not None
    assert card.heading == "Call 7, 0:12.3: ann is tagged by bob"
    assert card.lines[0].startswith("Rule (thesis 4.3): A minnow whose outline")
    assert "`vrg run why`" in card.lines[1]
    assert not card.busy
    assert not explainer.look()


@pytest.mark.parametrize("kind", [LaunchError, KeyError])
def test_what_cannot_be_known_stands_on_the_card(kind: type[Exception]) -> None:
    def refusing(number: int) -> Proof:
        raise kind(f"expected a run folder, found none for call {number}")

    explainer = Explainer(refusing)
    explainer.ask(CALL, "sharks-and-minnows")
    assert explainer.card is not None
    assert explainer.card.busy
    assert "expected a run folder, found none for call 7" in worked_out(explainer).lines[-1]


def test_a_card_that_was_closed_shows_nothing_when_its_proof_comes() -> None:
    goes_on = threading.Event()

    def slow(_number: int) -> Proof:
        goes_on.wait(60.0)
        return Proof("late", ())

    explainer = Explainer(slow)
    explainer.ask(CALL, "sharks-and-minnows")
    explainer.close()
    goes_on.set()
    assert explainer.card is None
    assert not explainer.look()


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080), (400, 300)])
def test_a_card_with_its_picture_stays_inside_its_area(size: tuple[int, int]) -> None:
    surface, area = pygame.Surface(size), pygame.Rect(0, 0, size[0] * 2 // 3, size[1])
    bodies = [SceneBody("ann", Pose(1.0, 1.0, 0.0), 0.5, 0.4, "minnow", "active", False, ())]
    measure = Measure("distance", 0.3, Relation.AT_MOST, 0.3, ends=((1.0, 1.0), (2.0, 1.0)))
    proof = Proof("Call 7", (), Scene(bodies=tuple(bodies)), (0.0, 0.0, 3.0, 2.0), (measure,), ((1.0, None),))
    lines = ("A line. " * 30, "Another one.")
    plate = CardPainter(Fonts()).draw(surface, area, Card("Call 7: " + "tagged " * 25, lines, proof), 1.0)
    assert area.contains(plate)
    pixels = pygame.surfarray.array3d(surface)
    xs, ys = (pixels == palette.CAUTION).all(axis=-1).nonzero()
    assert all(plate.collidepoint(x, y) for x, y in zip(xs, ys, strict=True))
    assert bool(len(xs)) == (size[1] > 400), "where there is no room, the words come first"


def test_the_list_of_keys_and_a_card_take_each_others_place(keys: Keys) -> None:
    window, match = Spectator("window", Mailbox(), keys, size=(1280, 720)), synthetic.SyntheticMatch(keys)
    match.step(window, synthetic.TAGGED_AT, 0)
    match.step(window, synthetic.TAGGED_AT + 5.0, 1)

    def pressed(key: int, number: int) -> bytes:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0))
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=key, mod=0))
        match.step(window, synthetic.TAGGED_AT + 5.0, number)
        return pygame.image.tobytes(pygame.display.get_surface(), "RGB")

    listed = pressed(pygame.K_F1, 2)
    card = pressed(pygame.K_w, 3)
    assert (window.help, window.explainer.card is not None) == (False, True)
    assert pressed(pygame.K_F1, 4) == listed, "nothing of the card sticks out"
    assert pressed(pygame.K_F1, 5) == card
    window.stop()


def test_a_click_on_a_call_in_the_window_asks_why_and_another_click_closes_the_card(keys: Keys) -> None:
    window = Spectator("spectator", Mailbox(), keys, size=(1280, 720))
    match = synthetic.SyntheticMatch(keys)
    try:
        for tick in range(400):
            match.step(window, tick / 10, tick)
        assert window.panel is not None
        area, call = window.panel._shown[0]
        assert window.panel.call_at((area.left - 1, area.centery)) is None
        before = pygame.image.tobytes(pygame.display.get_surface(), "RGB")
        click(area.center)
        match.step(window, 40.0, 400)
        assert window.explainer.card is not None
        assert window.explainer.card.heading.endswith(call.text)
        assert pygame.image.tobytes(pygame.display.get_surface(), "RGB") != before
        click((5, 5))
        match.step(window, 40.1, 401)
        assert window.explainer.card is None
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_w, mod=0))
        match.step(window, 40.2, 402)
        assert window.explainer.card is not None
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_ESCAPE, mod=0))
        match.step(window, 40.3, 403)
        assert window.explainer.card is None
    finally:
        window.stop()


def click(place: tuple[int, int]) -> None:
    pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=pygame.BUTTON_LEFT, pos=place))
