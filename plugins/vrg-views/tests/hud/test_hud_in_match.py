"""A display in a match in one process: its person sends and resets a robot, in its own game and in another one."""

import math
import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

os.environ["SDL_VIDEODRIVER"] = "dummy"


from vrg.bus.lockstep import Lockstep
from vrg.config.loading import load_match, match_path
from vrg.launch.nodes.player import player_node
from vrg.launch.nodes.referee import coordinator_node, open_journal
from vrg.launch.nodes.world import world_node
from vrg.runs.run_folder import RunFolder
from vrg.types import Pose
from vrg_views.hud.helm import Wish
from vrg_views.hud.node import Hud, hud_node


class Game:
    """A match in lockstep, every message through the codec, with the display of one player."""

    def __init__(self, match: str, player: str, folder: Path, stack: ExitStack) -> None:
        setup = load_match(match_path(match), engine="planar", lasers=False)
        run = RunFolder(folder)
        run.prepare()
        journal = stack.enter_context(open_journal(setup, run))
        players = [player_node(setup, p.name) for p in setup.players]
        self.hud: Hud = hud_node(setup, player)
        self.start = setup.player(player).pose
        coordinator = coordinator_node(setup, journal)
        self.executor = Lockstep(world_node(setup), [coordinator, *players, self.hud], strict=True)
        stack.callback(self.executor.stop)

    def run(self, seconds: float) -> None:
        end = self.executor.time + seconds
        while self.executor.time < end:
            self.executor.step()

    def run_until(self, mode: str, limit: float = 60.0) -> None:
        end = self.executor.time + limit
        while self.hud.board.mode != mode:
            assert self.executor.time < end, f"{self.hud.board.mode}, not {mode}, after {limit:g} s"
            self.executor.step()

    @property
    def pose(self) -> Pose:
        pose = self.hud.board.seen.pose
        assert pose is not None
        return pose

    def press(self, wish: Wish) -> None:
        self.hud.desk.want(wish, self.hud.board.seen)

    def away_from(self, x: float, y: float) -> float:
        return math.dist((self.pose.x, self.pose.y), (x, y))


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def test_goto_and_reset_in_the_game_of_the_display(tmp_path: Path, stack: ExitStack) -> None:
    game = Game("hud", "robot1", tmp_path, stack)
    game.run(2.0)
    assert (game.hud.board.mode, game.hud.board.holder) == ("Waiting", "its own strategy")
    assert game.hud.desk.aim(3.0, 0.5), "robot2 and a table are in the way"
    game.press(Wish.GOTO)
    game.run_until("Goto/Arrived")
    assert game.away_from(3.0, 0.5) < 0.3
    assert game.hud.board.holder == "you, at this display"
    game.press(Wish.RESET)
    game.run_until("Reset/Arrived")
    assert game.away_from(game.start.x, game.start.y) < 0.3
    game.press(Wish.WATCH)
    game.run(1.0)
    assert (game.hud.board.mode, game.hud.board.holder) == ("Waiting", "its own strategy")


@pytest.mark.thorough
def test_a_player_of_another_game_is_sent_and_plays_on_when_it_is_given_back(tmp_path: Path, stack: ExitStack) -> None:
    game = Game("sharks-and-minnows", "player1", tmp_path, stack)
    game.run(4.0)
    assert game.hud.board.mode.startswith("Sharks")
    here = game.pose
    assert game.hud.desk.aim(here.x + 1.0, here.y - 1.0)
    game.press(Wish.GOTO)
    game.run_until("Goto/Arrived")
    assert game.away_from(here.x + 1.0, here.y - 1.0) < 0.3
    game.press(Wish.WATCH)
    game.run(1.0)
    assert game.hud.board.mode.startswith("Sharks")
    assert game.hud.board.holder == "its own strategy"
