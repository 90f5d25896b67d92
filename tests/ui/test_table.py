"""The match as text."""

import dataclasses
import io
import re
import subprocess
import sys

import pytest
from rich.console import Console

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Stage
from vrg.bus.node import Tick
from vrg.testing.views import synthetic
from vrg.ui.table import TerminalTable, status_line, table


def shown(keys, console, until, period=0.25, **changes):
    node = TerminalTable("table", Mailbox(), keys, console=console)
    match = synthetic.SyntheticMatch(keys)
    for number in range(int(until / period) + 1):
        match.step(node, number * period, number, **changes)
    node.stop()
    node.stop()
    return console.file.getvalue()


def test_a_log_gets_each_call_once_and_a_status_every_five_seconds(keys):
    lines = shown(keys, Console(file=io.StringIO(), width=60), 16.0).splitlines()
    assert [line.split()[0] for line in lines] == ["0:00.0", "0:05.0", "0:09.0", "0:10.0", "0:12.5", "0:15.0"]
    assert lines[2].endswith("gill is inactive."), "a call is one line, however long"
    assert "5 of 7 players in play" in lines[-1]


def test_a_log_tells_a_halt_and_how_it_is_left_when_it_begins_and_with_each_status(keys):
    text = shown(keys, Console(file=io.StringIO()), 6.0, halted="a cable", way_out="Plug it in, then resume")
    assert text.count("HALT: a cable. Plug it in, then resume") == 2


def test_the_table_needs_neither_a_window_library_nor_a_plotting_one():
    """The launcher shows it, which waits for neither."""
    program = "import sys, vrg.ui.table; assert not {'pygame', 'matplotlib', 'numpy'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=300)


def test_reasons_that_change_all_the_time_do_not_fill_a_log(keys):
    node = TerminalTable("table", Mailbox(), keys, console=(console := Console(file=io.StringIO())))
    match = synthetic.SyntheticMatch(keys)
    for number in range(20):
        match.step(node, number * 0.25, number, waiting=[f"nemo is {number / 10} m from its mark"])
    assert console.file.getvalue().count("Waiting for: nemo is 0.0 m from its mark") == 1
    assert len(console.file.getvalue().splitlines()) == 2


def test_what_is_waited_for_is_told_in_one_line(keys):
    far = [f"player{number} is {number}.5 m from its mark" for number in range(9)]
    text = shown(keys, Console(file=io.StringIO()), 1.0, stage=Stage.INITIALIZE, waiting=far)
    [line] = [line for line in text.splitlines() if line.startswith("Waiting for")]
    assert line.endswith("; player1 is 1.5 m from its mark and 7 more")


def test_a_log_leaves_the_end_to_the_calls_and_to_what_follows(keys):
    text = shown(keys, Console(file=io.StringIO()), 16.0, stage=Stage.GAME_OVER, winner="sharks")
    assert "SHARKS WIN" not in text
    assert "players in play" not in text


def test_a_log_has_no_escape_codes(keys):
    assert "\x1b" not in shown(keys, Console(file=io.StringIO()), 13.0)


def test_before_the_referee_speaks_a_log_says_nothing(keys):
    console = Console(file=io.StringIO())
    node = TerminalTable("table", Mailbox(), keys, console=console)
    for number in range(100):
        node.mailbox.handover(number * 0.25)
        node.tick(Tick(number * 0.25))
    assert console.file.getvalue() == ""


def test_a_terminal_gets_a_table_in_place(keys):
    console = Console(file=io.StringIO(), force_terminal=True, width=100, height=40)
    text = shown(keys, console, 13.0)
    assert "\x1b[" in text
    for word in ("Sharks and Minnows", "bruce", "minnow", "inactive", "0:13.0", "squirt is out of bounds"):
        assert word in text


def written(scene, width=120, height=None):
    """The table of a scene on a terminal of this size."""
    console = Console(file=io.StringIO(), width=width, height=height)
    console.print(table(scene) if height is None else table(scene, width, height))
    return console.file.getvalue()


def with_players(scene, *names, **changes):
    """The scene with changed players; without names, all of them."""
    players = [dataclasses.replace(p, **changes) if not names or p.name in names else p for p in scene.players]
    return dataclasses.replace(scene, players=tuple(players))


@pytest.mark.parametrize("name", ["bruce", "gill"])
def test_the_table_shows_place_and_heading(scene_at, name):
    line = next(line for line in written(scene_at(13.5)).splitlines() if f" {name} " in line)
    pose = synthetic.pose_at(name, 13.5)
    assert f"{pose.x:.2f}" in line
    assert f"{pose.y:.2f}" in line
    assert "°" in line


def test_what_ails_a_player_is_in_the_table_whole(scene_at):
    fault = "axis two (node five) latched: overvoltage while it braked, says its drive"
    text = written(with_players(scene_at(10.0), "nemo", fault=fault), 100)
    assert fault.split() == [word for word in text.split() if word in fault.split()], "wrapped"


def many(scene, count, name="player"):
    """The scene with so many players."""
    players = [dataclasses.replace(scene.players[i % 7], name=f"{name}{i + 1}") for i in range(count)]
    return dataclasses.replace(scene, players=tuple(players))


@pytest.mark.parametrize("size", [(80, 24), (100, 30), (60, 24), (120, 60)])
@pytest.mark.parametrize("count", [2, 7, 16, 24])
@pytest.mark.parametrize("changes", [{}, {"halted": "a cable " * 12, "way_out": "`vrg official resume` goes on"}])
def test_everybody_and_the_last_call_fit_onto_a_terminal(scene_at, size, count, changes):
    width, height = size
    scene = many(scene_at(13.5, **changes), count)
    lines = written(scene, width, height).splitlines()
    assert len(lines) <= height
    assert max(map(len, lines)) <= width
    text = " ".join(lines)
    assert all(f" player{number} " in text for number in range(1, count + 1))
    assert "squirt is out" in text
    if changes:
        assert "resume" in text
    assert "0:12.5" in text, "a call has its time"


@pytest.mark.parametrize("size", [(80, 24), (60, 24), (120, 30), (4, 2), (20, 5), (1, 1)])
@pytest.mark.parametrize("count", [0, 1, 7, 24])
def test_faults_long_names_and_tiny_terminals_break_nothing(scene_at, size, count):
    width, height = size
    fault = "axis 2 (node 5) has latched: overvoltage at 58.2 V while it braked, as its drive says of itself; wait"
    scene = many(scene_at(13.5), count, "a-very-long-name-of-a-robot-")
    lines = written(with_players(scene, fault=fault), width, height).splitlines()
    if width >= 60:
        assert len(lines) <= height
        text = "\n".join(lines)
        assert all(re.search(rf"…\S*t-{i + 1}\b", text) for i in range(count)), "all names differ"
        assert "0:12.5" in text


def test_speed_and_battery_are_told_where_there_is_room(scene_at):
    text = written(with_players(scene_at(10.0), speed=-0.04, battery=0.156))
    assert " 0.0 " in text
    assert " 16% " in text


def test_words_of_players_are_no_markup(scene_at):
    assert "[red]x[/]" in written(scene_at(5.0, halted="[red]x[/]", score={"[b]": 1}))


def test_words_have_the_terminals_own_colours(scene_at):
    """On a light ground, light colours cannot be read. A sign is large enough in any colour."""
    lines = Console(file=io.StringIO(), width=100).render_lines(table(scene_at(13.5)))
    styled = [(part.text, part.style.color) for line in lines for part in line if part.style is not None]
    own = {text.strip() for text, colour in styled if colour is not None and colour.triplet is not None}
    assert own == {"▲", "●", "✕"}


def test_no_color_is_honoured(scene_at, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    console = Console(file=io.StringIO(), force_terminal=True, color_system="truecolor", width=100)
    console.print(table(scene_at(13.5)))
    assert "38;2" not in console.file.getvalue()


def test_the_status_line(scene_at):
    assert status_line(scene_at(13.5)) == (
        "0:13.5  Play Round, pass 1 of 2; sharks 2, minnows 0; 5 of 7 players in play"
    )
