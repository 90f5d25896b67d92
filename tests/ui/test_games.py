"""A game of another package is shown in its own colours and words, and one that is not installed is shown too."""

import io
from importlib.metadata import EntryPoint

import pygame
import pytest
from matplotlib.colors import to_rgb
from rich.console import Console

from tests.ui import synthetic
from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.colours import GREY, ORANGE, PURPLE
from vrg.games import GAMES, UNKNOWN_GAME, game_of
from vrg.games.game import Game, Marker, Moment, Role
from vrg.recording.recorder import Recorder
from vrg.ui import plot
from vrg.ui.draw import Painter
from vrg.ui.plot import plot_trajectories
from vrg.ui.table import status_line, table

CAPTURE = Game(
    name="capture",
    settings="",
    rules="",
    strategy="",
    match="",
    roles=(Role("runner", "reds", PURPLE, Marker.DIAMOND), Role("guard", "blues", ORANGE, Marker.SQUARE)),
    round_word="half",
    out_of_play=frozenset({"jailed"}),
    moments={"flag": Moment("*", "flag taken")},
)

PLAYERS = [
    m.PlayerStatus(name=name, team=team, role=role, state=state, may_move=True, radius=0.3)
    for name, team, role, state in (
        ("bruce", "blues", "guard", "active"),
        ("nemo", "reds", "runner", "active"),
        ("marlin", "reds", "runner", "jailed"),
    )
]
CHANGES = {"game": "capture", "players": PLAYERS, "score": {"reds": 3, "blues": 1}, "round": 2, "rounds": 2}


@pytest.fixture
def installed(monkeypatch):
    """The game is an entry point of a package outside VRG."""
    entry = EntryPoint("capture", "tests.ui.test_games:CAPTURE", "vrg.games")
    monkeypatch.setattr("vrg.registry.plugins", lambda group: {"capture": entry} if group == "vrg.games" else {})
    monkeypatch.setattr(GAMES, "_found", {})
    assert game_of("capture") == CAPTURE


def pixels(surface, area, colour):
    """How many pixels of about this colour there are in an area."""
    places = [(x, y) for x in range(area.left, area.right) for y in range(area.top, area.bottom)]
    near = [max(abs(a - b) for a, b in zip(surface.get_at(place)[:3], colour, strict=True)) <= 6 for place in places]
    return sum(near)


def painted(scene):
    surface = pygame.Surface((1280, 800))
    view = Painter().draw(surface, scene)

    def about(name):
        pose = next(body.pose for body in scene.bodies if body.name == name)
        x, y = view.point(pose.x, pose.y)
        return pygame.Rect(round(x) - 14, round(y) - 14, 28, 28)

    return surface, about


def text_of(renderable):
    console = Console(file=io.StringIO(), force_terminal=True, color_system="truecolor", width=120)
    console.print(renderable)
    return console.file.getvalue()


def recorded(path, keys, **changes):
    """A recording of 2 s in which nemo takes the flag."""
    recorder = Recorder("recorder", Mailbox(), keys, path)
    match = synthetic.Match(keys)
    call = m.Call(number=1, rule="flag", text="", players=("nemo",), poses=(synthetic.pose_at("nemo", 1.0),), clock=1.0)
    match.say(recorder.mailbox, keys.referee_event, call, 1.0, 0)
    for tick in range(20):
        match.step(recorder, tick / 10, tick, **changes)
    recorder.stop()
    return path


@pytest.fixture
def drawn(monkeypatch):
    """The axes of each plot that is made."""
    kept = []
    made = plot._figure

    def keep(*args):
        figure, panels, metre = made(*args)
        kept.extend(panels)
        return figure, panels, metre

    monkeypatch.setattr(plot, "_figure", keep)
    return kept


@pytest.mark.usefixtures("installed")
def test_the_window_draws_another_packages_game_in_its_colours(scene_at):
    scene = scene_at(5.0, **CHANGES)
    assert [body.out_of_play for body in scene.bodies[:4]] == [False, False, False, True]
    surface, about = painted(scene)
    for name, colour in (("bruce", ORANGE), ("nemo", PURPLE), ("marlin", GREY)):
        assert pixels(surface, about(name), colour) > 60, name
    for plate, colour in ((620, PURPLE), (860, ORANGE)):
        assert pixels(surface, pygame.Rect(plate, 38, 60, 6), colour) > 100, "a team has the colour of its first role"


@pytest.mark.usefixtures("installed")
def test_the_table_shows_another_packages_game_in_its_colours_and_words(scene_at):
    scene = scene_at(5.0, **CHANGES)
    assert status_line(scene) == "0:05.0  Play Round, half 2 of 2; reds 3, blues 1; 2 of 3 players in play"
    text = text_of(table(scene))
    for sign, colour in (("◆", PURPLE), ("■", ORANGE), ("✕", GREY)):
        assert f"38;2;{';'.join(map(str, colour))}m{sign}" in text
    assert "half 2 of 2" in text
    assert "Capture" in text


@pytest.mark.usefixtures("installed")
def test_the_plot_marks_the_calls_that_another_packages_game_names(keys, drawn, tmp_path):
    changes = {**CHANGES, "round": 1}
    plot_trajectories(recorded(tmp_path / "match.mcap", keys, **changes), tmp_path / "plot.png")
    [axes] = drawn
    assert axes.get_title() == "Half 1"
    assert "nemo 0:01.0" in [text.get_text() for text in axes.texts]
    stars = [line for line in axes.lines if line.get_marker() == "*"]
    assert len(stars) == 1
    legend = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert {"flag taken", "end, runner", "end, guard", "end, jailed"} <= set(legend)
    ends = {line.get_marker() for line in axes.lines}
    assert {"D", "s", "X"} <= ends
    jailed = next(line for line in axes.lines if line.get_marker() == "X")
    assert to_rgb(jailed.get_color()) == to_rgb("0.75")


def test_a_game_that_is_not_installed_here_is_shown_in_every_view(scene_at, keys, drawn, tmp_path):
    assert game_of("capture") is UNKNOWN_GAME
    scene = scene_at(5.0, **CHANGES)
    surface, about = painted(scene)
    for name, role in (("bruce", "guard"), ("nemo", "runner")):
        assert pixels(surface, about(name), UNKNOWN_GAME.style(role).colour) > 60, name
    assert status_line(scene) == "0:05.0  Play Round, round 2 of 2; reds 3, blues 1; 3 of 3 players in play"
    assert "Capture" in text_of(table(scene)), "its name is known"
    plot_trajectories(recorded(tmp_path / "match.mcap", keys, **{**CHANGES, "round": 1}), tmp_path / "plot.png")
    [axes] = drawn
    assert axes.get_title() == "Round 1"
    assert "nemo 0:01.0" in [text.get_text() for text in axes.texts], "which calls matter is not known: all are marked"
    assert "flag" in [text.get_text() for text in axes.figure.legends[0].get_texts()]
