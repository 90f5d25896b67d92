"""The card that tells why a call was made: how it is asked for, worked out and drawn."""

import time
from pathlib import Path

import pygame
import pytest

from tests.ui import synthetic
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call
from vrg.bus.topics import Keys
from vrg.ui.card import CardPainter
from vrg.ui.explaining import Card, Explainer
from vrg.ui.spectator import Spectator
from vrg.ui.text import Fonts

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
    assert "`vrg run why RUN --call 7`" in card.lines[1]
    assert not card.busy
    assert not explainer.look()


def test_what_cannot_be_told_is_said_on_the_card(tmp_path: Path) -> None:
    explainer = Explainer(tmp_path)
    explainer.ask(CALL, "sharks-and-minnows")
    assert explainer.card is not None
    assert explainer.card.busy
    assert "expected a run folder" in worked_out(explainer).lines[-1]


def test_closing_it_ends_what_is_being_worked_out(tmp_path: Path) -> None:
    explainer = Explainer(tmp_path)
    explainer.ask(CALL, "sharks-and-minnows")
    process = explainer._process
    assert process is not None
    explainer.close()
    assert explainer.card is None
    assert process.returncode is not None
    assert not explainer.look()


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080), (400, 300)])
def test_a_card_with_its_picture_stays_inside_its_area(size: tuple[int, int], tmp_path: Path) -> None:
    picture = pygame.Surface((800, 600))
    picture.fill((255, 0, 255))
    pygame.image.save(picture, tmp_path / "why-7.png")
    surface, area = pygame.Surface(size), pygame.Rect(0, 0, size[0] * 2 // 3, size[1])
    card = Card("Call 7: " + "ann is tagged by bob " * 5, ("A line. " * 30, "Another one."), tmp_path / "why-7.png")
    plate = CardPainter(Fonts()).draw(surface, area, card, 1.0)
    assert area.contains(plate)
    pixels = [(x, y) for x in range(0, size[0], 5) for y in range(0, size[1], 5)]
    coloured = [place for place in pixels if surface.get_at(place)[0] > 200 and surface.get_at(place)[1] < 60]
    assert all(plate.collidepoint(place) for place in coloured)
    assert bool(coloured) == (size[1] > 400), "where there is no room, the words come first"


def test_a_picture_that_cannot_be_read_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "why-7.png").write_bytes(b"no picture")
    surface = pygame.Surface((800, 600))
    CardPainter(Fonts()).draw(surface, surface.get_rect(), Card("Call 7", (), tmp_path / "why-7.png"), 1.0)


def test_a_click_on_a_call_in_the_window_asks_why_and_another_click_closes_the_card(keys: Keys) -> None:
    window = Spectator("spectator", Mailbox(), keys, size=(1280, 720))
    match = synthetic.Match(keys)
    try:
        for tick in range(400):
            match.step(window, tick / 10, tick)
        area, call = window._panel._shown[0]
        assert window._panel.call_at((area.left - 1, area.centery)) is None
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
