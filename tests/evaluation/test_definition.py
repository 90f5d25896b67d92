"""What the definition of an experiment depends on, and what the written match files say."""

from pathlib import Path

import pytest

from vrg.config.loading import load_match
from vrg.evaluation.contenders import contenders
from vrg.evaluation.experiment import define, written

CODE = (
    "from vrg.agents import STILL, Strategy\n\n\nclass Ann(Strategy):\n    def act(self, view):\n        return STILL\n"
)


@pytest.fixture
def files(match: Path) -> list[Path]:
    """Two files of one name in two folders."""
    found = []
    for folder in ("a", "b"):
        path = match.parent / folder / "player.py"
        path.parent.mkdir()
        path.write_text(CODE, encoding="utf-8")
        found.append(path)
    return found


@pytest.mark.parametrize("changed", [0, 1])
def test_of_two_files_of_one_name_both_count(match: Path, files: list[Path], changed: int) -> None:
    found = contenders([f"{file}:Ann" for file in files])
    before = define(load_match(match), found, seed=0, limit=100.0)
    files[changed].write_text(CODE + "\n# changed\n", encoding="utf-8")
    after = define(load_match(match), found, seed=0, limit=100.0)
    assert [difference.endswith("has changed") for difference in after.differences(before)] == [True]


def test_what_the_match_file_says_of_a_team_is_replaced(match: Path, files: list[Path]) -> None:
    match.write_text(
        match.read_text(encoding="utf-8") + '\n[teams.sharks]\nstrategy = "a/player.py:Ann"\n', encoding="utf-8"
    )
    setup = written(load_match(match), {"sharks": "sharks-and-minnows", "minnows": "sharks-and-minnows"})
    assert "player.py" not in setup.text
    assert setup.text.count('strategy = "sharks-and-minnows"') == len(setup.players) + 1
