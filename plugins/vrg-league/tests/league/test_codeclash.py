"""The arena of CodeClash in the examples, in the place of whose classes there are the few that it uses."""

import importlib.util
import logging
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import pytest

from tests.command_line import Vrg, with_vrg

ARENA = Path(__file__).parents[4] / "examples" / "codeclash" / "vrg_arena.py"
STILL = (
    "from vrg.agents import STILL, Strategy\n\n\nclass Own(Strategy):\n    def act(self, view):\n        return STILL\n"
)


class Place:
    """A folder in the place of a container."""

    def __init__(self, folder: Path, root: Path) -> None:
        self._folder, self._root = folder, root

    def execute(self, command: str, timeout: int) -> dict[str, Any]:
        for name in ("ann", "bob"):
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

    def checked(done: dict[str, Any], **_: Any) -> None:
        assert done["returncode"] == 0, done["output"]

    known = {
        "codeclash.agents.player": {"Player": object},
        "codeclash.arenas.arena": {"CodeArena": CodeArena, "RoundStats": object},
        "codeclash.cli.app": {"app": None},
        "codeclash.constants": {"RESULT_TIE": "Tie"},
        "codeclash.utils.environment": {"assert_zero_exit_code": checked},
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


@pytest.mark.thorough
def test_players_are_checked_and_play_both_sides(arena: Any, vrg: Vrg, tmp_path: Path) -> None:
    assert vrg("new", "player", "player").status == 0
    assert vrg("new", "match", "match").status == 0
    players = [SimpleNamespace(name=name, environment=Place(tmp_path / name, tmp_path)) for name in ("ann", "bob")]
    for player in players:
        (tmp_path / player.name).mkdir()
        for file in ("match.toml", "player.py"):
            shutil.copy(tmp_path / file, tmp_path / player.name / file)
    (tmp_path / "bob" / "player.py").write_text(STILL)
    assert [arena.validate_code(player) for player in players] == [(True, None)] * 2
    arena.execute_round(players)
    assert not list((tmp_path / "logs").rglob("*.py")), "nobody finds the code of others"
    stats = SimpleNamespace(
        scores={}, details=[], winner=None, player_stats={name: SimpleNamespace(score=None) for name in ("ann", "bob")}
    )
    arena.get_results(players, 0, stats)
    assert (stats.winner, stats.scores) == ("ann", {"ann": 2.0, "bob": 0.0})
    assert len(stats.details) == 2
    (tmp_path / "bob" / "player.py").write_text("class x(:")
    valid, why = arena.validate_code(players[1])
    assert not valid
    assert "SyntaxError" in why
