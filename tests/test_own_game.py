"""The packages in examples/, installed and played as docs/your-own-game.md shows."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from vrg import registry
from vrg.bus.messages import OfficialAction, Stage
from vrg.coordinator.rulebook import Contestant, Disqualification, Observation, RuleBook
from vrg.errors import ConfigError
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.trial import trial
from vrg.types import Pose

ROOT = Path(__file__).parents[1]
LION = ROOT / "examples" / "lion-and-man"
ROBOT = ROOT / "examples" / "my-robot"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment in which both packages are installed."""
    folder = tmp_path_factory.mktemp("installed")
    copies = []
    for package in (LION, ROBOT):
        # Building leaves files beside the sources.
        copy = tmp_path_factory.mktemp(package.name)
        subprocess.run(["cp", "-r", f"{package}/.", str(copy)], check=True, timeout=300)
        copies.append(str(copy))
    install = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--no-index"]
    done = subprocess.run(
        [*install, "--target", str(folder), *copies], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH", "")]))
    return {**os.environ, "PYTHONPATH": path}


def vrg(installed: dict[str, str], folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "vrg", *arguments]
    return subprocess.run(command, cwd=folder, env=installed, capture_output=True, text=True, timeout=300, check=False)


def test_the_lion_catches_the_man(installed: dict[str, str], tmp_path: Path) -> None:
    done = vrg(installed, tmp_path, "play", "lion-and-man", "--in-process", "--headless", "--engine", "planar")
    assert done.returncode == 0, done.stderr
    assert "Lion wins (lion 1, man 0" in done.stdout
    [result] = (tmp_path / "runs").glob("*/result.json")
    assert json.loads(result.read_text())["calls"][-2]["rule"] == "caught"


def test_an_arena_that_is_not_convex_is_refused_with_its_line(installed: dict[str, str], tmp_path: Path) -> None:
    text = (LION / "lion_and_man" / "match.toml").read_text()
    corners = "corners = [[-6.0, -6.0], [6.0, -6.0], [0.0, 0.0], [6.0, 6.0], [-6.0, 6.0]]"
    (tmp_path / "match.toml").write_text(text.replace("radius = 6.0", corners))
    done = vrg(installed, tmp_path, "check", "match.toml")
    assert done.returncode == 1
    assert "match.toml:7" in done.stderr + done.stdout
    assert "convex" in done.stderr + done.stdout


def test_why_the_man_was_caught_is_shown_with_the_rule_and_the_number_that_decided(
    installed: dict[str, str], tmp_path: Path
) -> None:
    played = vrg(installed, tmp_path, "play", "lion-and-man", "--in-process", "--headless", "--engine", "planar")
    assert played.returncode == 0, played.stderr
    calls = json.loads(vrg(installed, tmp_path, "run", "why", "--json").stdout)
    [caught] = [call["number"] for call in calls if call["rule"] == "caught"]
    shown = vrg(installed, tmp_path, "run", "why", "--call", str(caught)).stdout
    assert "A man whose centre comes within the capture distance of the lion's is caught." in shown
    assert re.search(
        r"distance between the centres of the man and the lion: (1|1\.00|0\.99\d*) m \(at most 1 m\)", shown
    )
    judged = vrg(installed, tmp_path, "run", "judge")
    assert judged.returncode == 0, judged.stdout


def test_a_strategy_is_chosen_by_the_name_that_the_package_gives_it(installed: dict[str, str], tmp_path: Path) -> None:
    text = (LION / "lion_and_man" / "match.toml").read_text()
    (tmp_path / "match.toml").write_text(text.replace('name = "rado"', 'name = "rado"\nstrategy = "lion"'))
    done = vrg(installed, tmp_path, "check", "match.toml")
    assert done.returncode == 0, done.stderr
    (tmp_path / "match.toml").write_text(text.replace('name = "rado"', 'name = "rado"\nstrategy = "loin"'))
    assert "did you mean 'lion'" in vrg(installed, tmp_path, "check", "match.toml").stderr


def test_the_robot_with_the_compass_drives_north(installed: dict[str, str], tmp_path: Path) -> None:
    done = vrg(
        installed, tmp_path, "play", str(ROBOT / "match.toml"), "--in-process", "--headless", "--engine", "planar"
    )
    assert done.returncode == 0, done.stderr
    code = (
        "from pathlib import Path; from vrg.recording.reader import read_tracks;"
        f"t = read_tracks(next(Path({str(tmp_path)!r}).glob('runs/*/recording.mcap')))['scout'];"
        "print(t.x[-1], t.y[-1], t.theta[-1])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    x, y, theta = map(float, run.stdout.split())
    assert y > 5.0
    assert abs(x) < 1.5
    assert theta == pytest.approx(1.57, abs=0.1)


def test_the_page_counts_the_lines_right() -> None:
    page = (ROOT / "docs" / "your-own-game.md").read_text()
    counted = re.findall(r"\(\.\./(examples/[^)]+)\) \| (\d+) \|", page)
    assert len(counted) == 10
    for file, lines in counted:
        assert len((ROOT / file).read_text().splitlines()) == int(lines), file


def on_the_page() -> dict[str, Any]:
    """What the examples of the page define that are whole programs."""
    page, names = (ROOT / "docs" / "your-own-game.md").read_text(), dict[str, Any]()
    blocks = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 2
    for block in blocks:
        exec(block, names)
    return names


@pytest.fixture
def walkers() -> list[Contestant]:
    return [
        Contestant(name=team, role=team, start=Pose(x, 0.0, 0.0), size=(0.5, 0.4), v_max=0.7)
        for team, x in (("gold", 0.0), ("blue", 3.0))
    ]


@pytest.mark.parametrize("name", ["Stroll", "Homecoming"])
def test_the_rule_books_of_the_page_keep_the_promises(name: str, walkers: list[Contestant]) -> None:
    book, ready = on_the_page()[name](walkers), Observation({c.name: c.start for c in walkers})
    for seed in range(6):
        trial(book, ready, seed)
    RuleBookContract().test_a_score_that_an_official_sets_stands(book, ready)


def test_the_time_step_of_the_page_tells_who_is_too_fast(walkers: list[Contestant]) -> None:
    book = on_the_page()["Stroll"](walkers)
    before = Observation({c.name: c.start for c in walkers}, time=1.0)
    after = Observation({"gold": Pose(0.04, 0.0, 0.0), "blue": Pose(3.06, 0.0, 0.0)}, time=1.1)
    assert [call.players for call in book.judge(book.initial(), before, after, 1.1).calls] == [("blue",)]
    halted = Observation(after.poses, time=1.0)
    assert not book.judge(book.initial(), before, halted, 1.1).calls


def test_a_score_of_the_page_that_an_official_sets_stands_also_with_players_at_home(walkers: list[Contestant]) -> None:
    book = on_the_page()["Homecoming"](walkers)
    state = book.initial().with_state(["gold"], "home")
    assert book.score(state) == {"gold": 1, "blue": 0}
    state = book.overrule(state, OfficialAction.SET_SCORE, "gold", "9")
    assert book.score(state) == {"gold": 9, "blue": 0}
    assert book.score(state.with_state(["blue"], "home")) == {"gold": 9, "blue": 1}


class TestTheRuleBookOfTheExample(RuleBookContract):
    """The suite that VRG ships, for the example's rule book."""

    @pytest.fixture(autouse=True)
    def _importable(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.syspath_prepend(LION)
        registry.added.cache_clear()

    @pytest.fixture
    def book(self) -> RuleBook:
        from lion_and_man.rules import LionAndMan, Settings  # noqa: PLC0415 - only these tests have it on their path

        return LionAndMan(Settings(), self.contestants(), 7)

    @pytest.fixture
    def ready(self) -> Observation:
        return Observation({c.name: c.start for c in self.contestants()})

    @staticmethod
    def contestants() -> list[Contestant]:
        starts = {"lion": Pose(0.0, 0.0, 0.0), "man": Pose(3.0, 0.0, 0.0)}
        return [Contestant(name=f"a {r}", role=r, start=at, size=(0.5, 0.4), v_max=0.7) for r, at in starts.items()]

    @pytest.mark.parametrize(
        ("lion", "man", "clock", "called", "winner"),
        [
            (1.9, 3.0, 1.0, [], None),
            (2.1, 3.0, 1.0, ["caught"], "lion"),
            (5.0, 1.0, 1.0, ["caught"], "lion"),
            (0.0, 6.1, 1.0, ["out"], "lion"),
            (-7.0, 3.0, 1.0, ["out"], "man"),
            (0.0, 3.0, 120.0, ["time_up"], "man"),
        ],
    )
    def test_who_is_caught_also_in_passing_or_leaves_the_arena_loses_and_the_man_wins_in_the_end(
        self, book: RuleBook, ready: Observation, lion: float, man: float, clock: float, called: list[str], winner: str
    ) -> None:
        end = Observation({"a lion": Pose(lion, 0.0, 0.0), "a man": Pose(man, 0.0, 0.0)})
        judged = book.judge(book.initial(), ready, end, clock)
        assert [call.rule for call in judged.calls] == called
        assert winner is None or book.next_round(judged.state, Observation({})).winner == winner

    def test_who_is_disqualified_has_lost(self, book: RuleBook, ready: Observation) -> None:
        out = structs.replace(book.initial(), disqualified={"a lion": Disqualification(why="a test")})
        judged = book.judge(out, ready, ready, 1.0)
        assert [call.rule for call in judged.calls] == ["forfeit"]
        assert book.next_round(judged.state, ready).winner == "man"

    def test_the_time_is_judged_also_while_a_robot_is_not_reported(self, book: RuleBook, ready: Observation) -> None:
        judged = book.judge(book.initial(), ready, Observation({}), 120.0)
        assert [call.rule for call in judged.calls] == ["time_up"]

    def test_one_lion_and_one_man_are_needed(self) -> None:
        from lion_and_man.rules import LionAndMan, Settings  # noqa: PLC0415 - as above

        with pytest.raises(ConfigError, match="one lion and one man"):
            LionAndMan(Settings(), self.contestants()[:1], 7)

    def test_both_know_where_the_other_is(self, book: RuleBook, ready: Observation) -> None:
        assert all(status.pose is not None for status in book.statuses(book.initial(), Stage.PLAY_ROUND, ready))
