"""A match that is taken up from an instant with another strategy is the same before it, and another one after it."""

import io
import json
import shutil
from collections.abc import Callable
from contextlib import redirect_stdout
from datetime import datetime
from pathlib import Path
from threading import Event as Stop
from unittest import mock

import pytest

from tests.recording.recordings import messages_of
from vrg.bus.messages import Call, Stage
from vrg.commands.runs.replay import changes_of
from vrg.config.loading import load_match
from vrg.config.rules import rulebook_of
from vrg.config.setup import read_setup, write_setup
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.judging import judge_again
from vrg.errors import ConfigError, LaunchError
from vrg.games import strategies_of
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.playing.branch import last_instant, play_branch
from vrg.playing.brancher import ReplayLine, replay_line
from vrg.runs.change import Change, branch_of
from vrg.runs.judged import judge_run
from vrg.runs.keeping import keep
from vrg.runs.result import conclusion, write_result
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY

LAZY = """
from vrg.agents import Action, Strategy, Twist
class Lazy(Strategy):
    def act(self, view):
        return Action(Twist(0.0, 0.0), "Wait")
"""
NOW = datetime(2026, 11, 23)
INSTANT = 4.0


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """A match that was played in one process."""
    home = tmp_path_factory.mktemp("home")
    (home / "tiny.toml").write_text(TINY)
    setup = load_match(home / "tiny.toml").at_rate(0.0)
    folder = RunFolder.create(home / "runs", setup.name, NOW)
    keep(setup, folder)
    write_setup(setup, folder.setup)
    with open_journal(setup, folder) as journal:
        recorder = recorder_node(setup, folder)
        ending = in_process.play(setup, journal, watchers=[recorder], logs=folder.logs)
    assert ending.state.stage is Stage.GAME_OVER
    write_result(setup, folder, ending.state, "game over")
    return folder


def test_the_last_line_tells_who_has_won_and_why(run: RunFolder) -> None:
    result = json.loads(run.result.read_text())
    said = next(call["text"] for call in result["calls"] if call["rule"] == "game_over")
    assert conclusion(result).lower() == said.removeprefix("game over: ").lower()
    assert ": " in conclusion(result)


@pytest.fixture
def lazy(tmp_path: Path) -> str:
    (tmp_path / "lazy.py").write_text(LAZY)
    return f"{tmp_path / 'lazy.py'}:Lazy"


def taken_up(
    of: RunFolder, runs: Path, change: Change, progress: Callable[[float], object] = id, stop: Stop | None = None
) -> RunFolder:
    """The match as it goes on; the picture of it is made by the command only, as it takes long."""
    with mock.patch("vrg.playing.branch.plot"):
        return play_branch(of, [change], runs, NOW, progress=progress, stop=stop or Stop())  # type: ignore[arg-type]


def test_it_is_the_same_up_to_the_instant_and_another_one_from_there(run: RunFolder, tmp_path: Path, lazy: str) -> None:
    new = taken_up(run, tmp_path / "runs", Change(INSTANT, "shark", lazy))
    before, after = ([(e.tick.time, e.digest) for e in read_evidence(f.evidence)] for f in (run, new))
    same = [tick for tick in before if tick[0] < INSTANT - 1e-6]
    assert after[: len(same)] == same
    assert before != after
    shark = {e.tick.time: e.tick.field.poses["shark"] for e in read_evidence(new.evidence)}
    end = max(shark)
    assert abs(shark[end].x - shark[5.0].x) + abs(shark[end].y - shark[5.0].y) < 0.05, "it stands from then on"
    branch = branch_of(new)
    assert branch is not None
    assert str(branch) == "from 4.0 s on shark plays lazy.py:Lazy"
    assert Path(branch.of) == run.path.resolve()
    assert json.loads(new.result.read_text())["ended"] == "game over"
    assert new.recordings()
    assert branch_of(run) is None


def test_a_match_that_was_taken_up_can_be_again_with_both_changes(run: RunFolder, tmp_path: Path, lazy: str) -> None:
    first = taken_up(run, tmp_path / "runs", Change(INSTANT, "shark", lazy))
    Path(lazy.partition(":")[0]).unlink()  # the run folder has a copy
    second = taken_up(first, tmp_path / "runs", Change(6.0, "ann", "sharks-and-minnows"))
    branch = branch_of(second)
    assert branch is not None
    assert [change.player for change in branch.changes] == ["shark", "ann"]
    with pytest.raises(LaunchError, match=r"was itself continued at 4\.0 s"):
        taken_up(first, tmp_path / "runs", Change(2.0, "ann", "sharks-and-minnows"))


def test_a_match_that_is_not_the_same_is_refused_and_leaves_nothing(run: RunFolder, tmp_path: Path, lazy: str) -> None:
    other = RunFolder(tmp_path / "other")
    shutil.copytree(run.path, other.path)
    other.match_file.write_text(other.match_file.read_text().replace("x = 3.0", "x = 3.1"))
    with pytest.raises(LaunchError, match=r"cannot be repeated: up to 4\.0 s the referee saw something else"):
        taken_up(other, tmp_path / "runs", Change(INSTANT, "shark", lazy))
    assert not list((tmp_path / "runs").glob("*"))


def test_what_makes_no_sense_is_told_before_anything_is_played(run: RunFolder, tmp_path: Path, lazy: str) -> None:
    runs = tmp_path / "runs"
    with pytest.raises(LaunchError, match=r"expected an instant from 0 to \d+\.\d s of match time, got 999"):
        taken_up(run, runs, Change(999.0, "shark", lazy))
    with pytest.raises(ConfigError, match="nobody"):
        taken_up(run, runs, Change(INSTANT, "nobody", lazy))
    with pytest.raises(ConfigError, match=r"nowhere\.py"):
        taken_up(run, runs, Change(INSTANT, "shark", "nowhere.py:Lazy"))
    assert not list(runs.glob("*"))


def test_a_match_of_several_processes_cannot_be_repeated(run: RunFolder, tmp_path: Path) -> None:
    other = RunFolder(tmp_path / "other")
    shutil.copytree(run.path, other.path)
    other.events.write_text("")
    with pytest.raises(LaunchError, match="expected a match that was played in steps"):
        last_instant(other)


def test_it_can_be_broken_off_and_is_where_nobody_reads_on(run: RunFolder, tmp_path: Path, lazy: str) -> None:
    def progress(_time: float) -> None:
        raise BrokenPipeError

    stop = Stop()
    stop.set()
    change = Change(INSTANT, "shark", lazy)
    with pytest.raises(LaunchError, match="broken off"):
        taken_up(run, tmp_path / "runs", change, stop=stop)
    with pytest.raises(BrokenPipeError):
        taken_up(run, tmp_path / "runs", change, progress)
    assert not list((tmp_path / "runs").glob("*"))


def test_the_command_tells_how_both_ended(run: RunFolder, tmp_path: Path, lazy: str) -> None:
    Path(lazy.partition(":")[0]).write_text(f'print({{"debug": 1}})\nprint("{{}}")\n{LAZY}')
    command = ["run", "replay", str(run.path), "--at", "4", "--play", f"shark={lazy}", "--runs", str(tmp_path / "runs")]
    done = invoke(*command, "--json")
    assert done.exit_code == 0, done.output
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    new = RunFolder(Path(lines[-1]["run"]))
    assert "{'debug': 1}" in (new.logs / "shark.log").read_text(), "a stranger's code decides in a process of its own"
    assert lines[0] == {"time": 0.02}
    assert lines[-1]["ending"].startswith("From 4.0 s on shark plays lazy.py:Lazy: Minnows win")
    assert "Recorded: " in lines[-1]["ending"]
    assert new.plot.is_file()
    lacking = invoke("run", "replay", str(run.path), "--play", "shark=x")
    assert "expected --at too" in str(lacking.exception)
    wrong = invoke("run", "replay", str(run.path), "--at", "4", "--play", "shark")
    assert "expected PLAYER=STRATEGY" in str(wrong.exception)


def test_the_name_of_a_player_and_of_its_team_is_that_of_the_player(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY.replace('"ann"', '"minnows"'))
    setup = load_match(tmp_path / "tiny.toml")
    for name, players in (("minnows", ["minnows"]), ("bob", ["bob"]), ("sharks", ["shark"])):
        changes = changes_of(setup, INSTANT, [f"{name}=sharks-and-minnows"], ["rules.passes=3"])
        assert [(change.time, change.player) for change in changes] == [(INSTANT, ""), *((INSTANT, p) for p in players)]
    with pytest.raises(ConfigError, match="--play: expected one of sharks, minnows, shark, bob, got 'ann'"):
        changes_of(setup, INSTANT, ["ann=sharks-and-minnows"], [])


def test_what_else_is_printed_tells_nothing_of_the_progress() -> None:
    for line in (b"{'debug': 1}", b'{"debug": 1}', b'{"time": "late"}', b"[1]", b"\xff", b""):
        assert replay_line(line) == ReplayLine()
    assert replay_line(b'{"time": 4.5}').time == 4.5
    assert replay_line(b'{"run": "/r", "ending": "it ended"}').run == "/r"


def test_the_strategies_of_a_game_are_those_of_its_package() -> None:
    assert strategies_of("sharks-and-minnows") == ["sharks-and-minnows"]
    assert "hail-mary" in strategies_of("roboflag")
    assert "pursuer" not in strategies_of("roboflag")
    assert strategies_of("no such game") == []


def judged_again(folder: RunFolder, *, by_changes: bool = True) -> list[str]:
    setup = read_setup(folder.setup)
    if by_changes:
        return list(map(str, judge_run(setup, folder)[1]))
    records = read_journal(folder.journal)[1]
    return list(map(str, judge_again(rulebook_of(setup), read_evidence(folder.evidence), records).disagreements))


def test_a_rule_changes_at_the_instant_and_the_match_is_judged_again_by_both(run: RunFolder, tmp_path: Path) -> None:
    new = taken_up(run, tmp_path / "runs", Change(INSTANT, settings={"rules.passes": 2}))
    assert judged_again(run) == judged_again(new) == []
    assert judged_again(new, by_changes=False)
    rounds = [
        max((call.text for call in read_calls(folder) if call.rule == "begin"), default="") for folder in (run, new)
    ]
    assert rounds[0] == "pass 1 of 1 begins"
    assert rounds[1] == "pass 2 of 2 begins"
    assert str(branch_of(new)) == "from 4.0 s on rules.passes is 2"


def test_another_seed_changes_the_noise_from_the_instant_on_and_nothing_before(run: RunFolder, tmp_path: Path) -> None:
    new = taken_up(run, tmp_path / "runs", Change(INSTANT, settings={"seed": 99}))
    there, here = (readings_of(folder) for folder in (run, new))
    differing = min(time for time in there if there[time] != here.get(time))
    assert INSTANT <= differing <= INSTANT + 1.0, "the next reading of a sensor that measures once a second"


@pytest.mark.parametrize("settings", [{"rules.passes": 1, "seed": 3}, {"radio.delay": 0.3}])
def test_only_what_is_changed_differs_from_then_on(run: RunFolder, tmp_path: Path, settings: dict[str, float]) -> None:
    """The noise of sensors stays, unless the seed is another one."""
    new = taken_up(run, tmp_path / "runs", Change(INSTANT, settings=settings))
    before, after = readings_of(run), readings_of(new)
    assert list(before) == list(after) or set(before) <= set(after)
    assert all(before[time] == after[time] for time in before)
    if "radio.delay" not in settings:
        assert new.journal.read_bytes() == run.journal.read_bytes()


def readings_of(folder: RunFolder) -> dict[float, bytes]:
    [recording] = folder.recordings()
    found = messages_of(recording, topics="/view/ann/gps/main")
    return {message.log_time / 1e9: message.data for _, _, message in found}


def read_calls(folder: RunFolder) -> list[Call]:
    return [call for record in read_journal(folder.journal)[1] for call in record.calls]


@pytest.mark.parametrize(
    ("field", "value", "wrong"),
    [
        ("rules.nonsense", 1, r"rules\.nonsense: unknown field"),
        ("rules.passes", -1, r"passes"),
        ("players.ann", 1, r"players\.ann: expected a field of \[rules\] or \[radio\]"),
        ("radio", 1, r"radio: expected a field of"),
    ],
)
def test_what_cannot_be_changed_is_refused(run: RunFolder, tmp_path: Path, field: str, value: int, wrong: str) -> None:
    with pytest.raises(ConfigError, match=wrong):
        taken_up(run, tmp_path / "runs", Change(INSTANT, settings={field: value}))


def test_strategies_of_one_name_and_the_modules_beside_them_are_kept_apart(run: RunFolder, tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "helper.py").write_text(f"WHO = {name!r}\n")
        text = LAZY.replace("class Lazy", "from helper import WHO\nprint('by', WHO)\n\n\nclass Lazy")
        (tmp_path / name / "player.py").write_text(text)
    changes = [
        Change(4.0, player, f"{tmp_path}/{name}/player.py:Lazy") for player, name in (("shark", "one"), ("ann", "two"))
    ]
    with redirect_stdout(io.StringIO()) as said:
        new = play_branch(run, changes, tmp_path / "runs", NOW, progress=lambda _time: None, stop=Stop())  # type: ignore[arg-type]
    assert set(said.getvalue().split("\n")) == {"by one", "by two", ""}
    kept = sorted(path.read_text() for path in (new.path / "substitute").glob("*/helper.py"))
    assert kept == ["WHO = 'one'\n", "WHO = 'two'\n"]


def test_a_run_is_repeated_with_the_code_of_its_files_sealed_unless_that_is_not_wanted(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    mark = tmp_path / "mark"
    writes = f"import contextlib\nwith contextlib.suppress(OSError):\n    open({str(mark)!r}, 'w')\n"
    (home / "lazy.py").write_text(LAZY.replace("class Lazy", f"{writes}\n\nclass Lazy"))
    text = TINY.replace("passes = 1", "passes = 1\npass_limit = 4.0")
    (home / "m.toml").write_text(text.replace('name = "ann"', 'name = "ann"\nstrategy = "lazy.py:Lazy"'))
    runs = ["--runs", str(home / "runs")]
    assert invoke("play", str(home / "m.toml"), "--in-process", "--headless", "--rate", "max", *runs).exit_code == 0
    (first,) = (home / "runs").iterdir()
    ways = (([], "sandboxed: the code of ann can only play", False), (["--no-sandbox"], "not sandboxed", True))
    for options, said, written in ways:
        mark.unlink(missing_ok=True)
        done = invoke("run", "repeat", str(first), *runs, *options)
        assert said in done.stderr
        assert "The same: " in done.stdout
        assert mark.exists() is written
    # A strategy that took over in an earlier branch is sealed, too, and one that the run's match file alone names.
    mark.unlink()
    taken = ["--at", "3", "--play", f"bob={home / 'lazy.py'}:Lazy", *runs, "--json"]
    plain = RunFolder(Path(shutil.copytree(first, home / "plain")))
    plain.match_file.write_text(text)
    write_setup(load_match(plain.match_file).at_rate(read_setup(plain.setup).rate), plain.setup)
    assert invoke("run", "repeat", str(plain.path), *runs).exit_code == 1, "ann was another one"
    branched = invoke("run", "replay", str(first), *taken)
    branch = Path(json.loads(branched.stdout.splitlines()[-1])["run"])
    (branch / "match.toml").write_text((branch / "match.toml").read_text().replace('strategy = "lazy.py:Lazy"', ""))
    assert "sandboxed: the code of bob can only play" in invoke("run", "repeat", str(branch), *runs).stderr
    plain.match_file.write_text(text.replace('name = "ann"', f'name = "ann"\nstrategy = "{home / "lazy.py"}:Lazy"'))
    assert "sandboxed: the code of ann can only play" in invoke("run", "repeat", str(plain.path), *runs).stderr
    assert not mark.exists()
