"""A league: versions, which games it plays, its pages, and who gets to know which error."""

import base64
import gzip
import os
import re
import signal
import stat
from pathlib import Path

import pytest
from experiments import OWN
from test_matchmaking import game

from vrg.testing.command_line import Vrg
from vrg_league.contenders import Unable
from vrg_league.folder import read_records
from vrg_league.games import GameRecord
from vrg_league.league import folder as league_folder
from vrg_league.league.folder import Version, playing
from vrg_league.league.league import _half
from vrg_league.running import Experiment


def version(number: int, problem: str = "", entry: str = "ann") -> Version:
    return Version(entry=entry, number=number, digest=str(number), file=f"{entry}.py", since="", problem=problem)


def test_a_version_that_has_failed_the_check_leaves_the_one_before_in_play() -> None:
    assert playing([]) == {}
    assert playing([version(1, "it fails")]) == {}
    found = playing([version(1), version(2), version(3, "it fails"), version(1, entry="bob")])
    assert {entry: v.number for entry, v in found.items()} == {"ann": 2, "bob": 1}
    assert playing([version(1), version(2), version(1)])["ann"].number == 1


def test_the_other_half_of_a_pair_of_games_comes_first_if_both_still_play() -> None:
    games = [game("ann.1", "bob.1", number, 1.0).game for number in (0, 1, 2)]
    assert _half(games, ["ann.1", "bob.1"]) == (games[0].pairing, 3)
    assert _half(games, ["ann.2", "bob.1"]) is None
    assert _half(games[:2], ["ann.1", "bob.1"]) is None
    odd = game("ann.1", "bob.1", 3, 1.0).game
    assert _half([*games[:2], odd], ["ann.1", "bob.1"]) == (odd.pairing, 2)


def files(folder: Path, **entries: str) -> Path:
    """A folder of entries, by what they return."""
    folder.mkdir(exist_ok=True)
    for name, action in entries.items():
        (folder / f"{name}.py").write_text(f"{OWN}{action}\n")
    return folder


def rows(league: Path) -> list[GameRecord]:
    return read_records(league / "games.jsonl", GameRecord)


def versions(league: Path) -> list[tuple[str, int, bool]]:
    return [(v.entry, v.number, not v.problem) for v in read_records(league / "versions.jsonl", Version)]


LAZY, AHEAD = "return STILL", "return Twist(v=0.7, w=0.0)"
SECRET = "raise ValueError('<b>the idea of cem</b>')"
LATE = "if view.time > 3.0:\n            raise ValueError('<i>the idea of dora</i>')\n        return STILL"


def test_a_league_goes_on_with_what_its_authors_change(vrg: Vrg, tmp_path: Path) -> None:
    folder = files(tmp_path / "class", ann=LAZY, bob=AHEAD, cem=SECRET)
    os.mkfifo(folder / "pipe.py")
    first = vrg("league", "play", "class", "--match", "tiny.toml", "--games", "2", "--jobs", "2")
    assert first.status == 0, first.err
    league = folder / "league"
    assert versions(league) == [("ann", 1, True), ("bob", 1, True), ("cem", 1, False)]
    assert [row.game.pairing.labels for row in rows(league)] == [("ann.1", "bob.1")] * 2
    assert {row.winner for row in rows(league)} == {"bob.1"}

    # What is played does not change with the files; only a new version does.
    (folder / "ann.py").write_text(f"{OWN}{AHEAD}  # new\n")
    (folder / "bob.py").write_text("no Python at all")
    (folder / "cem.py").write_text(f"{OWN}{LATE}\n")
    second = vrg("league", "play", "class", "--games", "3")
    assert second.status == 0, second.err
    assert "bob: version 2 does not pass the check" in second.out
    assert versions(league)[3:] == [("bob", 2, False), ("ann", 2, True), ("cem", 2, False)]
    assert [row.game.pairing.labels for row in rows(league)[2:]] == [("ann.2", "bob.1")] * 3
    assert (league / "versions" / "ann.1" / "ann.py").read_text() == f"{OWN}{LAZY}\n"

    # The third game was half of a pair; whose file is gone plays no more, and an author may go back.
    (folder / "bob.py").unlink()
    (folder / "ann.py").write_text(f"{OWN}{LAZY}\n")
    files(folder, dora=AHEAD)
    third = vrg("league", "play", "class", "--games", "2")
    assert third.status == 0, third.err
    assert versions(league)[6:] == [("ann", 1, True), ("dora", 1, True)]
    assert [row.game.pairing.labels for row in rows(league)[5:]] == [("ann.1", "dora.1")] * 2
    index = (league / "pages" / "index.html").read_text()
    assert "withdrawn: bob" in index
    assert "no version has passed the check: cem" in index

    # Errors are for their authors alone.
    errors = league / "errors"
    assert {file.name for file in errors.iterdir()} == {"bob.txt", "cem.txt", "pipe.txt"}
    assert all(stat.S_IMODE(file.stat().st_mode) == 0o600 for file in errors.iterdir())
    assert "the idea of dora" in (errors / "cem.txt").read_text()
    assert stat.S_IMODE(league.stat().st_mode) == 0o700
    pages = {page.name: page.read_text() for page in (league / "pages").iterdir()}
    assert set(pages) == {"index.html", "cross.html", *(f"entry-{n}.html" for n in range(1, 5))} | {
        f"{kind}-{n}.html" for n in range(1, 8) for kind in ("game", "watch")
    }
    for page, text in pages.items():
        shown = text
        if page.startswith("watch"):
            data = re.search('id="recorded">([^<]+)', text)
            assert data is not None
            shown = gzip.decompress(base64.b64decode(data[1])).decode()
            assert "begins" in shown, "the calls"
        for never in ("the idea of", "ValueError", "SyntaxError", "<script", "http:", str(tmp_path)):
            assert never not in shown, page
        for name in re.findall('href="([^"]+)"', text):
            assert name in pages

    leader = vrg("league", "check", str(folder / "dora.py"), "--league", "class")
    assert leader.status == 0, leader.out
    assert "as sharks against dora 1" in leader.out


@pytest.mark.thorough
def test_the_settings_of_a_league_are_fixed_and_its_games_are_played_again(vrg: Vrg, tmp_path: Path) -> None:
    folder = files(tmp_path / "class", ann=LAZY, bob=AHEAD)
    assert vrg("league", "play", "class", "--match", "tiny.toml", "--games", "1").status == 0
    league = folder / "league"
    # What the games depend on is fixed.
    for option in (("--engine", "pybullet"), ("--limit", "20"), ("--seed", "1"), ("--lasers",)):
        refused = vrg("league", "play", "class", *option)
        assert refused.status == 1
        assert f"{option[0]}: the league was made with another value" in refused.err
    assert "leave it out, or make another league with --output" in refused.err
    assert len(rows(league)) == 1
    assert vrg("league", "play", "class", "--games", "1", "--match", "tiny.toml", "--limit", "3600").status == 0
    assert [row.game.number for row in rows(league)] == [0, 1]

    # Each game is played again by its command, byte for byte.
    assert (
        "vrg play matches/ann.1.vs.bob.1/match.toml --lockstep --seed 0"
        in (league / "pages" / "game-1.html").read_text()
    )
    match = league / "matches" / "ann.1.vs.bob.1" / "match.toml"
    assert vrg("play", str(match), "--lockstep", "--seed", "0", "--headless", "--no-record").status == 0
    [journal] = (tmp_path / "runs").glob("*/journal.jsonl")
    assert journal.read_bytes() == (league / "kept" / "ann.1.vs.bob.1-0" / "journal.jsonl").read_bytes()

    # Another release of VRG is taken only if that is wanted.
    definition = league / "experiment.json"
    definition.write_text(re.sub(r'"vrg": "[^"]*"', '"vrg": "0.0"', definition.read_text()))
    refused = vrg("league", "play", "class", "--games", "1")
    assert refused.status == 1
    assert "the release of VRG is" in refused.err
    assert "--new-release continues anyway" in refused.err
    assert vrg("league", "play", "class", "--games", "1", "--new-release").status == 0
    assert len(rows(league)) == 3


def test_a_check_does_what_a_league_does_and_names_what_fails(vrg: Vrg, tmp_path: Path) -> None:
    files(tmp_path, mine=LAZY, late=LATE, raises=SECRET)
    good = vrg("league", "check", "mine.py", "--match", "tiny.toml")
    assert good.status == 0, good.out
    assert "as minnows against sharks-and-minnows: lost" in good.out
    (tmp_path / "mine.py").rename(tmp_path / "sharks-and-minnows.py")
    same = vrg("league", "check", "sharks-and-minnows.py", "--match", "tiny.toml")
    assert "as sharks against sharks-and-minnows-2: " in same.out
    bad = vrg("league", "check", "raises.py", "--match", "tiny.toml")
    assert bad.status == 1
    assert "it fails alone: " in bad.out
    assert "the idea of cem</b> (raises.py, line 6, in act)" in bad.out
    assert vrg("league", "check", "nowhere.py", "--match", "tiny.toml").status == 1
    assert "expected either --match" in vrg("league", "check", "mine.py").err


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_check_that_is_broken_off_does_not_say_that_the_entry_can_play(
    vrg: Vrg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    count = Experiment.count

    def ending(self: Experiment, row: GameRecord) -> None:
        count(self, row)
        signal.raise_signal(number)

    monkeypatch.setattr(Experiment, "count", ending)
    files(tmp_path, mine=LAZY)
    done = vrg("league", "check", "mine.py", "--match", "tiny.toml", "--jobs", "1")
    assert done.status == 128 + number
    assert "it was broken off before all games were played, so it is not known whether it can play" in done.out
    assert "in a league" not in done.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("class",), "there is no league yet: name its game or match file"),
        (("nowhere", "--match", "tiny.toml"), "nowhere: expected a folder of strategies"),
        (("class", "--match", "practice"), "expected a match of two teams"),
    ],
)
def test_a_league_that_cannot_be_made_is_an_error(
    vrg: Vrg, tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    files(tmp_path / "class", ann=LAZY)
    done = vrg("league", "play", *arguments)
    assert done.status == 1
    assert words in done.err
    assert not (tmp_path / "nowhere").exists()


def test_strangers_code_is_not_played_unsealed(vrg: Vrg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files(tmp_path / "class", ann=LAZY)
    monkeypatch.setattr("vrg.launch.sandbox.seal.missing", lambda: "no Landlock here")
    done = vrg("league", "play", "class", "--match", "tiny.toml")
    assert done.status == 1
    assert "which this machine cannot do: no Landlock here" in done.err


def test_a_version_whose_trial_took_too_long_is_tried_again(
    vrg: Vrg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = files(tmp_path / "class", ann=LAZY)
    command = ("league", "play", "class", "--match", "tiny.toml", "--games", "1")
    with monkeypatch.context() as patched:
        slow = Unable("it took too long", overdue=True)
        patched.setattr("vrg_league.league.league.unable", lambda _setup, found, *_, **__: dict.fromkeys(found, slow))
        assert "does not pass the check" in vrg(*command).out
    assert "ann: version 1 plays from now on" in vrg(*command).out
    assert versions(folder / "league") == [("ann", 1, False), ("ann", 1, True)]


def test_a_league_that_was_interrupted_while_it_was_made_is_made_by_the_next_call(
    vrg: Vrg, match: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files(match.parent / "class", ann=LAZY)
    command = ("league", "play", "class", "--match", "tiny.toml", "--games", "1")
    with monkeypatch.context() as patched:
        patched.setattr(league_folder, "keep", _interrupt)
        assert vrg(*command).status != 0
    done = vrg(*command)
    assert done.status == 0, done.out + done.err
    assert "0 games played, 0 in all" in done.out
    again = vrg("league", "play", "class", "--match", "tiny.toml", "--games", "1", "--lasers")
    assert again.status == 1
    assert "--lasers: the league was made with another value" in again.err


def _interrupt(*_: object, **__: object) -> None:
    raise KeyboardInterrupt
