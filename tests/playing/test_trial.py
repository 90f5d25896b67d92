"""Strategies of strangers are checked without running them as oneself."""

import sys
import tempfile
from pathlib import Path

import pytest

from vrg.errors import ConfigError
from vrg.launch import pulses
from vrg.launch.sandbox.seal import missing
from vrg.playing import apart
from vrg.playing.trial import trial
from vrg.testing.command_line import invoke
from vrg.testing.processes.match import short_match
from vrg.testing.requirements import missing as lacking

ATTACK = """
from pathlib import Path
from vrg.agents import Strategy

try:
    Path({target!r}).touch()
except PermissionError:
    pass


class Mine(Strategy):
    pass
"""


@pytest.fixture(autouse=True)
def _can_be_sealed() -> None:
    if (reason := missing()) is not None:
        lacking(reason)


@pytest.fixture
def attack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file that a strategy wants to write when it is imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))  # matches of others on this computer are none of these tests'
    monkeypatch.setattr("vrg.launch.running._answers", lambda _: False)
    (tmp_path / "mine.py").write_text(ATTACK.format(target=str(tmp_path / "attacked")))
    text = short_match("m").replace('name = "ann"', 'name = "ann"\nstrategy = "mine.py:Mine"')
    (tmp_path / "match.toml").write_text(text)
    return tmp_path / "attacked"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["check", "match.toml"], "Mine"),
        (["official", "substitute", "ann", "mine.py:Mine", "nowhere"], "expected a match that runs on this machine"),
        (["practice", "mine.py:Mine", "--map", "nowhere"], "`act`"),
        (["new", "match", "x", "mine.py:Mine"], ""),
    ],
)
def test_no_command_that_checks_a_strategy_first_runs_it_first(attack: Path, arguments: list[str], said: str) -> None:
    done = invoke(*arguments)
    assert said in f"{done.output}{done.exception}"
    assert not attack.exists()
    assert not any("mine" in name for name in sys.modules if name.startswith("vrg_strategy"))


def test_what_is_wrong_with_a_strategy_is_told_with_its_place_and_one_with_a_name_is_found(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text("class Mine:\n    pass\n\n\nclass Other(\n")
    with trial() as tried:
        with pytest.raises(ConfigError, match=r"bad\.py:Mine: cannot be imported.*bad\.py, line 5"):
            tried.find("bad.py:Mine", tmp_path)
        tried.find("sharks-and-minnows", tmp_path)
        with pytest.raises(ConfigError, match="expected one of"):
            tried.find("sharks-and-minnow", tmp_path)


HALF = """
import os, time
for fd in range(3, 20):
    try:
        os.write(fd, b"\\0")
    except OSError:
        pass
time.sleep(3600)
"""


@pytest.mark.parametrize("code", ["while True:\n    pass\n", HALF], ids=["endless", "begins to answer and never ends"])
def test_an_import_that_does_not_end_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str) -> None:
    monkeypatch.setattr(apart, "LOADING_TIME", 1.0)
    monkeypatch.setattr(pulses, "IDLE_TIMEOUT", 1.0)
    (tmp_path / "loop.py").write_text(code)
    with (
        trial() as tried,
        pytest.raises(ConfigError, match=r"while it is made, the strategy (has|is not)"),
    ):
        tried.find("loop.py:Mine", tmp_path)


DEEP = "os.chdir(own)\nfor _ in range(3000):\n    os.mkdir('d')\n    os.chdir('d')\n"
DISK = "for i in range(9):\n    open(f'{own}/{i}', 'wb').write(bytes(40_000_000))\n"


@pytest.mark.parametrize(
    ("code", "said"),
    [
        (DEEP, "it nests more than 50 folders"),
        (DISK, "it keeps [0-9]+ MB in [0-9] files"),
        ("os._exit(0)\n", "the strategy ends its program when it is imported or made"),
    ],
    ids=["deep", "disk", "exit"],
)
def test_what_a_file_makes_while_it_is_checked_is_bounded_and_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, said: str
) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    head = "import os, time\nown = os.environ['VRG_PLAYER_FOLDER']\n"
    (tmp_path / "bad.py").write_text(f"{head}{code}time.sleep(3600)\n")
    with trial() as tried, pytest.raises(ConfigError, match=rf"bad\.py:Mine: .*{said}"):
        tried.find("bad.py:Mine", tmp_path)
    assert list(temporary.iterdir()) == []
