"""How the user of a replay takes a match up from an instant: the choice, and the window with a made-up brancher."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pygame
import pytest

from tests.ui.pictures import content
from vrg.recording.recorded import read_recorded
from vrg.testing.views import synthetic
from vrg.ui.branching import Choice, Taken
from vrg.ui.plots.proof import Proof
from vrg.ui.timeline import Timeline
from vrg.ui.window.replay import ReplayWindow

PLAYERS = ("ann", "bob")
STRATEGIES = ("bold", "shy", "wild")


def test_a_player_is_chosen_and_then_its_strategy() -> None:
    choice = Choice(12.3, PLAYERS, STRATEGIES)
    assert choice.card.heading == "From 0:12.3 on, who plays another strategy?"
    assert choice.card.lines[:2] == ("▶ ann", "    bob")
    then = choice.move(1).take()
    assert isinstance(then, Choice)
    assert then.card.heading == "From 0:12.3 on, bob plays which strategy?"
    assert then.move(-1).take() == ("bob", "wild")
    assert then.move(1).move(1).move(1).at == 0


def test_a_long_list_shows_the_part_around_the_mark() -> None:
    choice = Choice(0.0, [f"p{n:02d}" for n in range(40)], STRATEGIES)
    for _ in range(30):
        choice = choice.move(1)
    rows = choice.card.lines[:-1]
    assert len(rows) == 14
    assert "▶ p30" in rows


@dataclass
class Made:
    """A brancher that says what the test wants."""

    cannot: str = ""
    players: tuple[str, ...] = PLAYERS
    strategies: tuple[str, ...] = STRATEGIES
    begun: list[tuple[float, str, str]] = field(default_factory=list)
    said: list[Taken | str] = field(default_factory=list)
    busy: bool = False

    def begin(self, time: float, player: str, strategy: str) -> None:
        self.begun.append((time, player, strategy))
        self.busy = True

    def look(self) -> Taken | str | None:
        found = self.said.pop(0) if self.said else None
        self.busy = self.busy and not isinstance(found, Taken)
        return found

    def close(self) -> None:
        self.busy = False


@pytest.fixture
def brancher() -> Made:
    return Made()


@pytest.fixture
def window(recorded: Path, brancher: Made) -> Iterator[ReplayWindow]:
    timeline = Timeline(read_recorded(recorded), obstacles=synthetic.OBSTACLES)
    window = ReplayWindow(timeline, title="test", size=(1280, 720), brancher=brancher)
    window.open()
    window.frame(0.0)
    yield window
    window.close()


def press(window: ReplayWindow, *keys: int) -> None:
    for key in keys:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0, unicode=""))
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=key, mod=0))
        window.frame(0.0)


def test_f_asks_and_the_match_that_comes_of_it_is_shown_from_that_instant(window: ReplayWindow, brancher: Made) -> None:
    press(window, pygame.K_RIGHT)
    before, time = content(), window.playback.time
    press(window, pygame.K_f)
    assert content() != before
    assert not window.playback.playing
    press(window, pygame.K_DOWN, pygame.K_RETURN, pygame.K_DOWN, pygame.K_RETURN)
    assert brancher.begun == [(time, "bob", "shy")]
    brancher.said = ["10 s of match time are played"]
    window.frame(0.0)
    card = window.card
    assert card is not None
    assert card.lines == ("10 s of match time are played",)
    brancher.said = [Taken(window._timeline, "Bob wins.", lambda number: Proof(f"Call {number}", ()))]
    window.frame(0.0)
    assert window.card is None
    assert window.note == "Bob wins."
    assert window.playback.time == pytest.approx(time)
    assert window.playback.playing


def test_enter_that_is_held_takes_one_name_alone(window: ReplayWindow, brancher: Made) -> None:
    press(window, pygame.K_f)
    for _ in range(5):
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_RETURN, mod=0, unicode=""))
    window.frame(0.0)
    assert brancher.begun == []
    assert window.card is not None
    assert "ann plays which strategy?" in window.card.heading


def test_escape_breaks_off(window: ReplayWindow, brancher: Made) -> None:
    press(window, pygame.K_f, pygame.K_ESCAPE)
    assert window.card is None
    press(window, pygame.K_f, pygame.K_RETURN, pygame.K_RETURN)
    assert brancher.busy
    press(window, pygame.K_ESCAPE)
    assert not brancher.busy
    assert window.card is None


def test_a_match_that_cannot_be_taken_up_says_why(window: ReplayWindow, brancher: Made) -> None:
    brancher.cannot = "expected a match that was played in one process"
    press(window, pygame.K_f)
    card = window.card
    assert card is not None
    assert card.lines == (brancher.cannot,)
