"""A game of another package is shown in its own colours and words, and one that is not installed is shown too."""

import dataclasses
import io
import json
from importlib.metadata import EntryPoint

import pytest
from matplotlib.colors import to_rgb
from msgspec.structs import replace
from rich.console import Console

from tests.recording.recordings import messages_of
from tests.ui.pictures import close_to, colours_near, painted, where
from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.colours import ORANGE, PURPLE, WHITE, dulled, mix
from vrg.games import GAMES, UNKNOWN_GAME, game_of
from vrg.games.game import Game, Marker, Moment, Role
from vrg.recording.recorder import Recorder
from vrg.regions import Rectangle
from vrg.testing.views import synthetic
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.plots.plot import plot_trajectories
from vrg.ui.scene import Flash
from vrg.ui.table import status_line, table
from vrg.ui.web import parts

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
    monkeypatch.setattr("vrg.registry.added", lambda: {"vrg.games": {"capture": entry}})
    monkeypatch.setattr(GAMES, "_found", {})
    assert game_of("capture") == CAPTURE


def text_of(renderable):
    console = Console(file=io.StringIO(), force_terminal=True, color_system="truecolor", width=120)
    console.print(renderable)
    return console.file.getvalue()


def recorded(path, keys, **changes):
    """A recording of 2 s in which nemo takes the flag."""
    recorder = Recorder("recorder", Mailbox(), keys, path)
    match = synthetic.SyntheticMatch(keys)
    call = m.Call(number=1, rule="flag", text="", players=("nemo",), poses=(synthetic.pose_at("nemo", 1.0),), clock=1.0)
    match.say(recorder.mailbox, keys.referee_event, call, 1.0, 0)
    for tick in range(20):
        match.step(recorder, tick / 10, tick, **changes)
    recorder.stop()
    return path


@pytest.mark.usefixtures("installed")
def test_the_window_draws_another_packages_game_in_its_colours(scene_at):
    scene = scene_at(5.0, **CHANGES)
    assert [body.out_of_play for body in scene.bodies[:4]] == [False, False, False, True]
    surface, view = painted(scene)
    for name, colour in (("bruce", ORANGE), ("nemo", PURPLE), ("marlin", dulled(PURPLE))):
        assert close_to(colours_near(surface, where(scene, view, name)), colour) > 60, name
    for plate, colour in ((650, PURPLE), (890, ORANGE)):
        told = close_to(colours_near(surface, (plate, 41), 2), colour)
        assert told > 15, "a team has the colour of its first role"


@pytest.mark.usefixtures("installed")
def test_the_table_shows_another_packages_game_in_its_colours_and_words(scene_at):
    scene = scene_at(5.0, **CHANGES)
    assert status_line(scene) == "0:05.0  Play Round, half 2 of 2; reds 3, blues 1; 2 of 3 players in play"
    text = text_of(table(scene))
    for sign, colour in (("◆", PURPLE), ("■", ORANGE), ("✕", dulled(PURPLE))):
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


@pytest.mark.usefixtures("installed")
def test_what_lies_on_another_packages_field_appears_everywhere(scene_at, keys, drawn, tmp_path):
    """A zone, a thing, a mark and a call that VRG's own games have not: no drawing of VRG is changed for them."""
    court = m.Zone(name="court", kind="court", region=Rectangle(18.0, -24.0, 22.0, -20.0), team="reds")
    cup = m.FieldObject(name="cup", kind="cup", team="blues", x=20.0, y=-28.0)
    player = replace(PLAYERS[1], mark=Pose(24.0, -16.0, 0.0))
    zones = (*synthetic.zones()[:1], court)
    changes = {**CHANGES, "players": [player], "zones": zones, "objects": (cup,), "stage": m.Stage.INITIALIZE}
    scene = scene_at(5.0, **changes)
    scene = dataclasses.replace(scene, flashes=(Flash((23.0, -30.0), "flag taken", 0.0),))
    tint, mark = (mix(palette.FIELD, PURPLE, 0.14), mix(PURPLE, palette.FIELD, 0.45))

    surface, view = painted(scene)
    for colour, at in (
        (tint, (19.0, -23.0)),
        (ORANGE, (20.1, -27.7)),
        (mark, (24.0, -16.0)),
        (palette.CAUTION, (23, -30)),
    ):
        assert close_to(colours_near(surface, view.point(*at), 30), colour, 10) > 10, at

    page = {name: json.loads(part) for name, part in parts.parts(scene).items()}
    assert {"fill": list(tint)}.items() <= page["ground"]["figures"][1]["shapes"][0].items()
    assert page["state"]["objects"][0]["figure"]["shapes"][1]["fill"] == list(ORANGE)
    assert page["looks"]["marks"][0]["shapes"][0]["line"] == list(mark)
    assert page["frame"]["flashes"][0]["label"]["words"] == "FLAG TAKEN"

    playing = {**changes, "stage": m.Stage.PLAY_ROUND, "round": 1}
    path = recorded(tmp_path / "match.mcap", keys, **playing)
    filled = [
        json.loads(message.data)
        for topic in ("/view/field", "/view/scene")
        for *_, message in messages_of(path, topics=topic)[:1]
    ]
    colours = {
        tuple(round(255 * triangle["color"][part]) for part in "rgb")
        for update in filled for entity in update["entities"] for triangle in entity["triangles"]
    }  # fmt: skip
    assert {tint, ORANGE} <= colours

    plot_trajectories(path, tmp_path / "plot.png")
    faces = {tuple(round(255 * part) for part in patch.get_facecolor()[:3]) for patch in drawn[0].patches}
    assert {mix(WHITE, PURPLE, 0.14), ORANGE} <= faces


def test_a_game_that_is_not_installed_here_is_shown_in_every_view(scene_at, keys, drawn, tmp_path):
    assert game_of("capture") is UNKNOWN_GAME
    scene = scene_at(5.0, **CHANGES)
    surface, view = painted(scene)
    for name, role in (("bruce", "guard"), ("nemo", "runner")):
        colour = UNKNOWN_GAME.style(role).colour
        assert close_to(colours_near(surface, where(scene, view, name)), colour) > 60, name
    assert status_line(scene) == "0:05.0  Play Round, round 2 of 2; reds 3, blues 1; 3 of 3 players in play"
    assert "Capture" in text_of(table(scene)), "its name is known"
    plot_trajectories(recorded(tmp_path / "match.mcap", keys, **{**CHANGES, "round": 1}), tmp_path / "plot.png")
    [axes] = drawn
    assert axes.get_title() == "Round 1"
    assert "nemo 0:01.0" in [text.get_text() for text in axes.texts], "which calls matter is not known: all are marked"
    assert "flag" in [text.get_text() for text in axes.figure.legends[0].get_texts()]
