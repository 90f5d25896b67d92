"""Micromouse: mazes and their files, the rules on numbers, and whole matches of the mouse that is shipped."""

import json
import math
import subprocess
import sys
from collections import deque
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

import vrg
from vrg.agents.strategy import View
from vrg.coordinator.rulebook import NOBODY, Contestant, Disqualification, Observation, RuleBook
from vrg.errors import ConfigError
from vrg.hal.sensors.laser import Laser
from vrg.hal.sim.map import load_map
from vrg.testing.command_line import invoke
from vrg.testing.rulebook import RuleBookContract
from vrg.types import Pose, Twist
from vrg_games.micromouse import GAME, MAP, MOUSE
from vrg_games.micromouse.maze import (
    CELL,
    EAST,
    NORTH,
    START,
    Maze,
    edge,
    edges,
    flood,
    from_maz,
    from_text,
    generated,
    goal_cells,
)
from vrg_games.micromouse.mouse import MICROMOUSE
from vrg_games.micromouse.player import FloodFill, Localisation
from vrg_games.micromouse.rules import Micromouse, Settings

SMALL = """\
o---o---o---o---o
|               |
o   o---o---o   o
|   | G   G |   |
o   o   o   o   o
|   | G   G     |
o   o---o---o   o
| S |           |
o---o---o---o---o
"""


def maze_of(seed: int, size: int = 16) -> Maze:
    return generated(np.random.default_rng(seed), size)


def steps_in_text(text: str) -> int:
    """The steps of a shortest way from S to the nearest G: breadth-first over the signs of the text."""
    rows = text.splitlines()
    [start] = [(r, row.index("S")) for r, row in enumerate(rows) if "S" in row]
    queue, seen = deque([(start, 0)]), {start}
    while queue:
        (row, column), steps = queue.popleft()
        if rows[row][column] == "G":
            return steps
        for down, right in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            near = (row + 2 * down, column + 4 * right)
            if rows[row + down][column + 2 * right] == " " and near not in seen:
                seen.add(near)
                queue.append((near, steps + 1))
    raise AssertionError("no way")


@pytest.mark.parametrize("seed", range(20))
def test_the_flood_counts_the_steps_that_a_search_over_the_text_counts(seed: int) -> None:
    maze = maze_of(seed)
    assert maze.steps == steps_in_text(maze.text)


def test_a_maze_that_was_written_is_read_again() -> None:
    for seed in range(20):
        maze = maze_of(seed, size=8 + 2 * (seed % 5))
        assert from_maz(maze.maz) == maze
        assert from_text(maze.text) == maze


def test_a_maze_as_text_is_that_of_the_collections() -> None:
    maze = from_text(SMALL)
    assert maze.text == SMALL
    assert maze.size == 4
    assert maze.steps == steps_in_text(SMALL) == 9


def test_a_maz_file_has_its_cells_in_columns_from_the_south_west() -> None:
    maz = from_text(SMALL).maz
    assert len(maz) == 16
    assert maz[0] == 0b1110, "the start cell is open to the north alone"
    assert maz[1] == 0b1010, "the next one is the cell in its north"
    assert maz[4] == 0b1101, "and that in the east of the start cell is as many cells later as a column has"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (SMALL.replace("| S |", "| S  "), "open to the north alone"),
        (SMALL.replace("o---o---o---o---o\n|  ", "o   o---o---o---o\n|  ", 1), "walls all around"),
        (SMALL.replace("G     |", "G |   |"), "no way"),
        (SMALL[: len(SMALL) // 2], "even number|all around"),
        ("", "even number"),
        ("What is this?\nNo maze.\n" * 8, "all around"),
    ],
)
def test_what_is_no_maze_is_refused_in_words(text: str, why: str) -> None:
    with pytest.raises(ConfigError, match=why):
        from_text(text)


def test_cells_of_a_maz_file_must_agree_on_their_walls() -> None:
    maz = bytearray(from_text(SMALL).maz)
    maz[5] ^= 0b0001
    with pytest.raises(ConfigError, match="agree"):
        from_maz(bytes(maz))
    for length in (0, 1, 15, 255, 257):
        with pytest.raises(ConfigError):
            from_maz(bytes(length))


@pytest.mark.parametrize("seed", range(10))
def test_a_new_maze_is_as_the_rules_want_it(seed: int) -> None:
    maze = maze_of(seed)
    assert maze_of(seed) == maze, "a seed makes one maze"
    assert len(flood([START], lambda place: place not in maze.walls)) == 256, "every cell can be reached"
    goals = goal_cells(16)
    posts = [(x, y) for x in range(17) for y in range(17) if (x, y) != (8, 8)]
    around = {
        post for x, y, side in maze.walls for post in ((x + 1, y + 1), (x, y + 1) if side == NORTH else (x + 1, y))
    }
    assert around == set(posts), "at least one wall touches every post but that in the middle"
    entrances = [place for goal in goals for place in {edge(goal, side) for side in range(4)} - maze.walls]
    assert len(set(entrances)) == 5, "the four places between the cells of the middle, and one entrance"


def test_a_map_has_a_wall_for_each_of_the_maze() -> None:
    map_ = load_map(MAP)
    assert MAP.read_text() == maze_of(9).toml
    assert len(map_.boxes) == len(maze_of(9).walls)
    for x, y, side in edges(16):
        there = (
            Pose((x + 0.5) * CELL, (y + 1) * CELL, 0.0)
            if side == NORTH
            else Pose((x + 1) * CELL, (y + 0.5) * CELL, 0.0)
        )
        assert map_.footprint_clear(there, 0.02, 0.02) == ((x, y, side) not in maze_of(9).walls)


def made(*words: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "vrg_games.micromouse", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_command_writes_a_map_of_a_file_or_of_a_seed(tmp_path: Path) -> None:
    (tmp_path / "mine.maz").write_bytes(maze_of(5).maz)
    (tmp_path / "yours.txt").write_text(SMALL)
    for what in ("7", str(tmp_path / "mine.maz"), str(tmp_path / "yours.txt")):
        done = made(what, "--output", str(tmp_path))
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "maze-7.toml").read_text() == maze_of(7).toml
    assert (tmp_path / "mine.toml").read_text() == maze_of(5).toml
    assert "9 steps to the middle" in done.stdout
    assert len(load_map(tmp_path / "yours.toml").boxes) == len(from_text(SMALL).walls)
    refused = made(str(tmp_path / "nothing.maz"))
    assert refused.returncode == 1
    assert "Traceback" not in refused.stderr


def contestant(x: float = 0.09, y: float = 0.09) -> Contestant:
    return Contestant(
        name="jerry", role="mouse", start=Pose(x, y, math.pi / 2), size=MICROMOUSE.size, v_max=MICROMOUSE.v_max
    )


def seen(x: float, y: float, time: float = 0.0) -> Observation:
    return Observation({"jerry": Pose(x, y, 0.0)}, time=time)


class TestTheRuleBook(RuleBookContract):
    @pytest.fixture
    def book(self) -> RuleBook:
        return Micromouse(Settings(time=240.0), [contestant()], 7)

    @pytest.fixture
    def ready(self) -> Observation:
        return seen(0.09, 0.09)


@pytest.fixture
def book() -> Micromouse:
    return Micromouse(Settings(time=240.0), [contestant()], 7)


def test_a_run_begins_where_the_start_cell_ends_also_between_two_looks(book: Micromouse) -> None:
    verdict = book.judge(book.initial(), seen(0.09, 0.15, 9.9), seen(0.09, 0.21, 10.0), 10.0)
    assert [call.rule for call in verdict.calls] == ["run"]
    assert verdict.calls[0].poses[0].y == pytest.approx(0.18)
    assert verdict.state.begun == pytest.approx(9.95)
    assert verdict.state.numbers["run"] == pytest.approx(9.95)


def test_a_score_is_the_time_of_the_run_and_a_thirtieth_of_the_time_before_it(book: Micromouse) -> None:
    state = structs.replace(book.initial(), runs=2, begun=60.0)
    verdict = book.judge(state, seen(1.0, 1.35, 79.9), seen(1.52, 1.35, 80.0), 80.0)
    assert [call.rule for call in verdict.calls] == ["goal"]
    assert verdict.calls[0].poses[0].x == pytest.approx(7 * CELL)
    assert "run 2: 19.95 s, score 21.95 s" in verdict.calls[0].text
    assert verdict.state.numbers["best"] == pytest.approx(21.95)
    assert book.score(verdict.state) == {MOUSE: 21805}, "hundredths of a second below the time"
    slower = structs.replace(verdict.state, begun=100.0)
    assert book.score(book.judge(slower, seen(1.0, 1.35, 199.9), seen(1.3, 1.35, 200.0), 200.0).state) == {MOUSE: 21805}


def test_the_middle_counts_nothing_without_a_run_and_a_run_once(book: Micromouse) -> None:
    way = seen(1.0, 1.35, 1.0), seen(1.3, 1.35, 1.1)
    assert not book.judge(book.initial(), *way, 1.1).calls
    ended = book.judge(structs.replace(book.initial(), begun=0.5), *way, 1.1).state
    assert not book.judge(ended, *way, 2.1).calls


def test_a_run_that_comes_back_to_the_start_is_over_and_another_can_begin(book: Micromouse) -> None:
    state = structs.replace(book.initial(), runs=1, begun=1.0)
    verdict = book.judge(state, seen(0.09, 0.2, 5.0), seen(0.09, 0.1, 5.1), 5.1)
    assert [call.rule for call in verdict.calls] == ["home"]
    assert verdict.state.begun is None
    verdict = book.judge(verdict.state, seen(0.09, 0.1, 6.0), seen(0.09, 0.2, 6.1), 6.1)
    assert [call.rule for call in verdict.calls] == ["run"]
    assert verdict.state.runs == 2


def test_a_whole_run_between_two_looks_is_judged(book: Micromouse) -> None:
    verdict = book.judge(book.initial(), seen(0.09, 0.09, 0.0), seen(1.44, 1.44, 10.0), 10.0)
    assert [call.rule for call in verdict.calls] == ["run", "goal"]


def test_the_match_ends_with_the_time_and_a_run_that_ends_later_does_not_count(book: Micromouse) -> None:
    state = structs.replace(book.initial(), runs=1, begun=1.0)
    verdict = book.judge(state, seen(1.0, 1.35, 239.9), seen(1.3, 1.35, 241.0), 241.0)
    assert [call.rule for call in verdict.calls] == ["time_up"]
    assert verdict.round_over
    assert book.next_round(verdict.state, seen(1.0, 1.0)).winner == NOBODY
    assert book.next_round(verdict.state.with_points(MOUSE, 7), seen(1.0, 1.0)).winner == MOUSE


def test_who_is_disqualified_runs_no_more(book: Micromouse) -> None:
    state = structs.replace(book.initial(), disqualified={"jerry": Disqualification(why="a test")})
    assert [call.rule for call in book.judge(state, seen(0, 0), seen(0, 0), 1.0).calls] == ["forfeit"]


def test_one_mouse_begins_in_the_start_cell() -> None:
    with pytest.raises(ConfigError, match="one mouse"):
        Micromouse(Settings(), [], 7)
    with pytest.raises(ConfigError, match="outside the start cell"):
        Micromouse(Settings(), [contestant(x=0.27)], 7)


@pytest.mark.parametrize("line", ["size = 15", "size = 2", "time = 0.0", 'maze = "x"'])
def test_a_mistake_in_the_rules_is_shown_with_its_line(line: str, tmp_path: Path) -> None:
    (tmp_path / "match.toml").write_text(GAME.default_match().read_text().replace("time = 180.0", line))
    done = invoke("check", str(tmp_path / "match.toml"))
    assert done.exit_code == 1
    assert "match.toml:7" in str(done.exception)


def test_the_mouse_notes_the_walls_around_it() -> None:
    place = Localisation(16, 0.03)
    ranges = np.array([0.084, 0.119, 0.25, 0.119, 0.084], dtype="<f4")
    scan = Laser(angle_min=-math.pi / 2, angle_step=math.pi / 4, range_max=0.25, data=ranges.tobytes())
    place.move(Pose(0.0, 0.0, 0.0))
    place.move(Pose(0.18, 0.0, 0.0))
    place.see(scan)
    assert place.walls[edge((0, 1), EAST)] is True
    assert place.walls[edge((0, 1), NORTH)] is False
    assert place.pose.y == pytest.approx(0.27, abs=0.01)


def match_in(maze: Maze, folder: Path) -> Path:
    (folder / "maze.toml").write_text(maze.toml)
    text = GAME.default_match().read_text().replace('map = "maze"', 'map = "maze.toml"')
    (folder / "match.toml").write_text(text)
    return folder / "match.toml"


@pytest.mark.parametrize("seed", [1, 2])
def test_the_mouse_finds_the_middle_and_a_later_run_has_a_better_score(seed: int, tmp_path: Path) -> None:
    run = vrg.play("micromouse", seed=seed, engine="planar", runs=tmp_path, record=False)
    calls = [call for call in run.calls if call.rule == "goal"]
    assert len(calls) >= 2
    assert run.winner == MOUSE
    assert run.score[MOUSE] > 14000
    assert "run 2" in calls[1].text
    assert vrg.judge(run).disagreements == []


def test_the_mouse_uses_neither_the_poses_nor_the_map_of_the_framework(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, act, lost = match_in(maze_of(4), tmp_path), FloodFill.act, Pose(math.nan, math.nan, math.nan)
    seeing = vrg.play(file, engine="planar", runs=tmp_path / "seeing", record=False)

    def blind(self: FloodFill, view: View) -> Twist:
        players = tuple(structs.replace(player, pose=None, mark=None) for player in view.referee.players)
        referee = structs.replace(view.referee, players=players)
        return act(self, structs.replace(view, pose=lost, obstacles=(), referee=referee))

    monkeypatch.setattr(FloodFill, "act", blind)
    run = vrg.play(file, engine="planar", runs=tmp_path / "blind", record=False)
    assert [call.text for call in run.calls] == [call.text for call in seeing.calls]
    assert run.winner == MOUSE


def test_the_calls_are_proved_by_where_the_border_is(tmp_path: Path) -> None:
    run = vrg.play(match_in(maze_of(4), tmp_path), engine="planar", runs=tmp_path, record=False)
    listed = json.loads(invoke("run", "why", str(run.path), "--json").output)
    proved = {call["rule"]: call for call in listed}
    assert {"run", "goal", "time_up"} <= proved.keys()
    shown = invoke("run", "why", str(run.path), "--call", str(proved["goal"]["number"])).output
    assert "distance of mouse's centre from the border of the middle: 0 m (at most 0 m)" in shown
