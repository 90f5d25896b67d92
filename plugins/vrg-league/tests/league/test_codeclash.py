"""The arena of CodeClash in the examples, in the place of whose classes there are the few that it uses."""

import importlib.util
import logging
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import pytest
from experiments import with_vrg

from vrg.testing.command_line import Vrg

ARENA = Path(__file__).parents[4] / "examples" / "codeclash" / "vrg_arena.py"
STILL = (
    "from vrg.agents import STILL, Strategy\n\n\nclass Own(Strategy):\n    def act(self, view):\n        return STILL\n"
)


NAMES = ("ann", "gpt-4.1")


class Place:
    """A folder in the place of a container."""

    def __init__(self, folder: Path, root: Path) -> None:
        self._folder, self._root = folder, root

    def execute(self, command: str, timeout: int) -> dict[str, Any]:
        for name in NAMES:
            command = command.replace(f"cp /{name}/", f"cp {self._root}/{name}/")
        done = subprocess.run(
            ["bash", "-c", command], cwd=self._folder, env=with_vrg(), capture_output=True, text=True, check=False,
            timeout=timeout,
        )  # fmt: skip
        return {"returncode": done.returncode, "output": done.stdout + done.stderr}


@pytest.fixture
def arena(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    class CodeArena:
        game_config: ClassVar[dict[str, Any]] = {"sims_per_round": 2}
        logger = logging.getLogger("arena")
        log_env = tmp_path / "logs"
        environment = Place(tmp_path, tmp_path)

        def log_round(self, _: int) -> Path:
            return self.log_env

    known = {
        "codeclash.agents.player": {"Player": object},
        "codeclash.arenas.arena": {"CodeArena": CodeArena, "RoundStats": object},
        "codeclash.cli.app": {"app": None},
        "codeclash.constants": {"RESULT_TIE": "Tie"},
    }
    for name in ("codeclash", *(name.rpartition(".")[0] for name in known), *known):
        module = ModuleType(name)
        vars(module).update(known.get(name, {}))
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(sys.modules["codeclash"], "arenas", sys.modules["codeclash.arenas"], raising=False)
    spec = importlib.util.spec_from_file_location("vrg_arena", ARENA)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    monkeypatch.setattr(found, "PLACE", str(tmp_path / "round"))
    (tmp_path / "logs").mkdir()
    return found.VRGArena()


def told(arena: Any, players: Sequence[Any]) -> Any:
    scores = {player.name: SimpleNamespace(score=None) for player in players}
    stats = SimpleNamespace(scores={}, details=[], winner=None, player_stats=scores)
    arena.get_results(players, 0, stats)
    return stats


def test_players_find_the_games_and_no_texts_of_others(arena: Any) -> None:
    players = [SimpleNamespace(name=name) for name in NAMES]
    table = arena.log_env / "games.csv"
    table.write_text(
        "first,second,first_team,second_team,problem,first_points,first_score,second_score,play_again\n"
        "p1_ann,p2_gpt_4_1,sharks,minnows,,1,3,0,vrg play\n"
        "p1_ann,p2_gpt_4_1,minnows,sharks,ValueError: do as I say,0.5,1,1,vrg play\n"
    )
    stats = told(arena, players)
    assert (stats.winner, stats.scores) == ("ann", {"ann": 1.5, "gpt-4.1": 0.5})
    assert stats.details[0] == "ann (sharks) against gpt-4.1 (minnows): 3 to 0"
    text = table.read_text()
    assert "gpt-4.1" in text
    assert "do as I say" not in text + str(stats)


@pytest.mark.thorough
def test_players_are_checked_and_play_both_sides(arena: Any, vrg: Vrg, tmp_path: Path) -> None:
    assert vrg("new", "player", "player").status == 0
    assert vrg("new", "match", "match").status == 0
    players = [SimpleNamespace(name=name, environment=Place(tmp_path / name, tmp_path)) for name in NAMES]
    for player in players:
        (tmp_path / player.name).mkdir()
        for file in ("match.toml", "player.py"):
            shutil.copy(tmp_path / file, tmp_path / player.name / file)
    other = tmp_path / NAMES[1] / "player.py"
    other.write_text(STILL)
    assert [arena.validate_code(player) for player in players] == [(True, None)] * 2
    arena.execute_round(players)
    assert [path.name for path in (tmp_path / "logs").iterdir()] == ["games.csv"], "nobody finds the code of others"
    stats = told(arena, players)
    assert (stats.winner, stats.scores) == (NAMES[0], {NAMES[0]: 2.0, NAMES[1]: 0.0})
    other.write_text("class x(:")
    valid, why = arena.validate_code(players[1])
    assert (valid, why) == (False, "it cannot play: `vrg league check player.py --match match.toml` tells why")
    (tmp_path / "logs" / "games.csv").unlink()
    arena.execute_round(players)
    stats = told(arena, players)
    assert (stats.winner, stats.scores) == (NAMES[0], {NAMES[0]: 1.0, NAMES[1]: 0.0}), "who fails here loses"
