"""Each step of the lessons can be reached, and not by the code with which a student begins."""

import ast
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from vrg.errors import ConfigError
from vrg.launch.fork_server import ForkServer
from vrg.launch.sandbox.seal import missing
from vrg.runs.run_folder import RunFolder
from vrg_class.lesson import Step, first_code, languages, lesson_of, shipped
from vrg_class.trial import TrialSpec, play
from vrg_class.tries import others_of, setup_of, teams_of
from vrg_league.game_process import server_for

SOLUTIONS = Path(__file__).parent / "solutions"
GAMES = ("sharks-and-minnows", "roboflag")
STEPS = [
    (game, step) for game in GAMES for step in lesson_of(shipped(game))  # type: ignore[arg-type]
]  # fmt: skip
TRIED = "03"
"""How the name of the step of each game begins that `make test` plays; all are played by `make test-all`."""
PLAYED = [
    pytest.param(
        game, step, id=f"{game}: {step.name}", marks=[] if step.name.startswith(TRIED) else [pytest.mark.thorough]
    )
    for game, step in STEPS
]


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    found = server_for("roboflag", "planar", "vrg.playing.strategy_process")
    yield found
    found.close()


def tried(step: Step, code: str, place: Path, server: ForkServer) -> list[dict[str, Any]]:
    """Try a step: what is reported."""
    (place / "code.py").write_text(code, encoding="utf-8")
    teams = teams_of(setup_of(step.match, {}))
    own = step.head.team or teams[0]
    players = {own: str(place / "code.py")} | (dict.fromkeys(others_of(teams, own), step.other) if step.other else {})
    found: list[str] = []
    spec = TrialSpec(
        setup=setup_of(step.match, players), team=own, goal=step.head.goal.model_dump(exclude_none=True),
        seconds=step.head.seconds, sealed=missing() is None,
    )  # fmt: skip
    play(spec, RunFolder(place / "run"), found.append, server)
    return [json.loads(text) for text in found]


@pytest.mark.parametrize(("game", "step"), PLAYED)
def test_a_step_can_be_reached(game: str, step: Step, tmp_path: Path, server: ForkServer) -> None:
    code = (SOLUTIONS / game / f"{step.name}.py").read_text(encoding="utf-8")
    found = tried(step, code, tmp_path, server)
    assert not [one for one in found if one["t"] == "error"]
    assert found[-1]["goal"]["reached"] is not None, found[-1]


@pytest.mark.parametrize(("game", "step"), PLAYED)
def test_the_first_code_does_not_reach_it(game: str, step: Step, tmp_path: Path, server: ForkServer) -> None:
    folder = shipped(game)
    assert folder is not None
    found = tried(step, first_code(folder, "en"), tmp_path, server)
    assert found[-1]["goal"]["reached"] is None


def test_a_game_has_ten_steps() -> None:
    assert [sum(of == game for of, _ in STEPS) for game in ("sharks-and-minnows", "roboflag")] == [10, 10]
    assert shipped("pursuit-evasion") is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Drive.", "expected a table between two lines"),
        ("+++\ntitle = 3\n+++\n", "title"),
        ('+++\ntitle = "Drive"\nmatch = "x"\ngoal = { zome = "safe" }\n+++\n', "zome"),
        ("+++\ntitle = \n+++\n", "01-drive.md: "),
    ],
)
def test_what_is_wrong_with_a_step_is_named(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "01-drive.md").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=words):
        lesson_of(tmp_path)
    with pytest.raises(ConfigError, match="found none"):
        lesson_of(tmp_path / "nowhere")


@pytest.mark.parametrize("game", GAMES)
def test_the_first_five_steps_are_there_in_other_languages_with_the_same_code(game: str) -> None:
    folder = shipped(game)
    assert folder is not None
    assert languages(folder) == {"de", "es", "fr"}

    def code(text: str) -> list[str]:
        """What stands in blocks of code."""
        return [line for line in text.splitlines() if line.startswith("    ")]

    for step in lesson_of(folder)[:5]:
        english = step.told("en")
        for language in languages(folder):
            told = step.told(language)
            assert told.title != english.title or told.text != english.text, (step.name, language)
            assert code(told.text) == code(english.text), (step.name, language)
            assert bool(told.hint) == bool(english.hint), (step.name, language)
            first = first_code(folder, language)
            assert ast.dump(ast.parse(first)) == ast.dump(ast.parse(first_code(folder, "en")))
    assert lesson_of(folder)[-1].told("de") == lesson_of(folder)[-1].told("en")
