"""How the shipped mouse solves the mazes of a collection: the steps from cell to cell beside those of a shortest way.

For each maze, as text with `o---o` posts, a match is played until the mouse has completed a run over known cells. Steps
are those of the cell in which the centre of the mouse is, from the true poses: to the middle for the first time, in the
run, and all.
"""

import argparse
import itertools
import logging
import math
import tempfile
from pathlib import Path

from vrg.agents import View
from vrg.config.loading import load_match, match_path
from vrg.errors import ConfigError
from vrg.files import read_text
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.runs.run_folder import RunFolder
from vrg.types import Twist
from vrg_games.micromouse.maze import CELL, START, Cell, Maze, from_text, goal_cells
from vrg_games.micromouse.player import FloodFill

TIME = 600.0
"""The match time at most, s."""


def driven(maze: Maze) -> list[Cell]:
    """The cells in which the mouse has been one after the other."""
    cells: list[Cell] = [START]
    running = False

    def act(mouse: FloodFill, view: View) -> Twist:
        nonlocal running
        running, pose = mouse.mode == "Run", view.me.pose
        if pose and (cell := (math.floor(pose.x / CELL), math.floor(pose.y / CELL))) != cells[-1]:
            cells.append(cell)
        return decide(mouse, view)

    decide, FloodFill.act = FloodFill.act, act  # type: ignore[method-assign]
    try:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "maze.toml").write_text(maze.toml)
            text = read_text(match_path("micromouse")).replace('"maze"\n\n', '"maze.toml"\n\n')
            (folder / "match.toml").write_text(text.replace("time = 180.0", f"time = {TIME}"))
            setup, goals = load_match(folder / "match.toml"), goal_cells(maze.size)
            with open_journal(setup, RunFolder(folder)) as journal:
                in_process.play(setup, journal, pace=lambda now: now < TIME and not (running and cells[-1] in goals))
    finally:
        FloodFill.act = decide  # type: ignore[method-assign]
    return cells


def main() -> None:
    """Play in the mazes of a folder, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="of text files, such as mazefiles/classic")
    parser.add_argument("--every", type=int, default=10, help="play in one of so many (10)")
    options = parser.parse_args()
    logging.disable(logging.WARNING)
    mazes = {}
    for file in sorted(options.folder.glob("*.txt")):
        try:
            mazes[file.stem] = from_text(read_text(file))
        except ConfigError as error:
            print(f"{file.name}: {error}")
    print(f"{len(mazes)} mazes are read\n{'maze':40} shortest  first  run  all")
    sums = [0, 0, 0]
    for name, maze in itertools.islice(mazes.items(), None, None, options.every):
        cells, goals = driven(maze), goal_cells(maze.size)
        first = next((number for number, cell in enumerate(cells) if cell in goals), None)
        arrived = cells[-1] in goals
        run = len(cells) - 1 - max(number for number, cell in enumerate(cells) if cell == START) if arrived else None
        print(f"{name:40} {maze.steps:8} {first!s:>6} {run!s:>4} {len(cells) - 1:4}", flush=True)
        if run is not None and first is not None:
            sums = [sums[0] + maze.steps, sums[1] + first, sums[2] + run]
    print(f"{'those that were solved':40} {sums[0]:8} {sums[1]:6} {sums[2]:4}")


if __name__ == "__main__":
    main()
