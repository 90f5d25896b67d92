"""What is exported of recorded runs: what players saw and did, and which runs are refused."""

import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from click.testing import Result
from hypothesis import given
from hypothesis import strategies as st
from making import short_match
from msgspec import structs
from pyarrow import parquet
from test_training import imitate

from vrg.agents.strategy import Action, Strategy, View, decided
from vrg.config.loading import load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup, read_setup
from vrg.errors import ConfigError, LaunchError
from vrg.hal.models.pioneer import P2AT
from vrg.recording.recorded import RecordedMatch, read_recorded
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.types import Twist
from vrg_learn.action import twist_of
from vrg_learn.environment import MatchEnvironment
from vrg_learn.episode import Episode
from vrg_learn.learning import Learning, learning_of
from vrg_learn.matches import match_of
from vrg_learn.observation import observe
from vrg_learn.policy import load
from vrg_learn.record import MatchRecord
from vrg_learn.recorded import DrivenBy, RecordedDecision, decisions, wanted
from vrg_learn.table import Heading, read

SHORT = {"sharks-and-minnows": "passes = 1\npass_limit = 6.0", "roboflag": "round_time = 14.0\nsudden_death = 0.5"}
SEEN = 2e-3
"""The largest difference of a value without noise: odometry counts ticks, one of which in 20 ms is 1 mm/s."""

Kept = dict[tuple[int, str], tuple[np.ndarray, Twist]]
Runs = dict[str, tuple[Path, Kept]]


class Witness(Strategy):
    """Plays by another strategy, and keeps what it sees and wants, by the time in ms and the player."""

    def __init__(self, strategy: Strategy, learning: Learning, kept: Kept) -> None:
        super().__init__(strategy.name, strategy.robot)
        self.seed, self._strategy, self._learning, self._kept = strategy.seed, strategy, learning, kept

    def act(self, view: View) -> Action:
        action = decided(self._strategy, view)[0]
        self._kept[round(view.time * 1000), self.name] = observe(view, self._learning), action.twist
        return action


def played(match: Path, runs: Path, kept: Kept) -> Path:
    """The run folder of a match without noise, by its strategies, of which is kept what players see and want."""
    setup = structs.replace(match_of(match, engine="planar", lasers=False), noise=False)
    learning, record = learning_of(setup.game), MatchRecord(runs, setup)
    witness = partial(Witness, learning=learning, kept=kept)
    episode = Episode(setup, (), journal=record.journal, watchers=[record.recorder], wrap=witness)
    episode.start()
    while not episode.over:
        episode.decide({})
    episode.close(linger=True)
    record.close(episode.state)
    [run] = runs.iterdir()
    return run


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    """A run folder of a short match of each game, with what its players saw and wanted."""
    found = {}
    for game, rules in SHORT.items():
        folder, kept = tmp_path_factory.mktemp(game), Kept()
        found[game] = played(short_match(folder, game, rules), folder / "runs", kept), kept
    return found


@pytest.fixture
def sharks(runs: Runs) -> Path:
    return runs["sharks-and-minnows"][0]


@pytest.fixture
def flags(runs: Runs) -> Path:
    return runs["roboflag"][0]


def recorded_in(run: Path) -> RecordedMatch:
    return read_recorded(RunFolder(run).recordings())


def rebuilt(run: Path) -> tuple[MatchSetup, list[RecordedDecision]]:
    setup = read_setup(RunFolder(run).setup)
    return setup, list(decisions(setup, recorded_in(run)))


def export(*runs: Path, output: Path) -> Result:
    return invoke("run", "export", *map(str, runs), "--output", str(output))


@pytest.mark.parametrize("game", SHORT)
def test_what_players_saw_and_did_is_rebuilt_from_the_recording(game: str, runs: Runs) -> None:
    run, kept = runs[game]
    setup, found = rebuilt(run)
    assert len(found) > 40 * len(setup.players)
    limits = rulebook_of(setup).speed_limits()
    for decision in found:
        name = decision.me.name
        seen, want = kept[round(decision.time * 1000), name]
        # A blow of another robot turns no wheels.
        close = np.abs(decision.observation - seen) < SEEN
        assert close.mean() > 0.75, (decision.time, name)
        if not decision.able:
            continue
        robot = setup.player(name).robot
        limit = limits.get(name, robot.v_max)
        again = robot.limited(twist_of(decision.action, (robot.v_max, robot.w_max)), limit)
        sent = robot.limited(want, limit)
        assert (again.v, again.w) == pytest.approx((sent.v, sent.w), abs=5e-3), "w_max is rounded"
    exact = [bool((np.abs(d.observation - kept[round(d.time * 1000), d.me.name][0]) < SEEN).all()) for d in found]
    assert np.mean(exact) > 0.98


def test_who_drove_is_told(flags: Path) -> None:
    setup, found = rebuilt(flags)
    led = [decision for decision in found if decision.driver is DrivenBy.REFEREE]
    assert led, "a tagged player is driven home"
    assert {decision.me.state for decision in led} == {"tagged"}
    assert not any(decision.able for decision in led)
    recorded = recorded_in(flags)
    half = recorded.poses[len(recorded.poses) // 2][0]
    recorded.reports["red1"] = [
        (stamp, structs.replace(report, manual=stamp >= half, mode="Manual"))
        for stamp, report in recorded.reports["red1"]
    ] + [(half, structs.replace(recorded.reports["red1"][0][1], manual=True, mode="Manual"))]
    recorded.reports["red1"].sort(key=lambda report: report[0])
    by = {(d.driver, d.time >= half) for d in decisions(setup, recorded) if d.me.name == "red1"}
    assert by - {(DrivenBy.REFEREE, False)} == {(DrivenBy.STRATEGY, False), (DrivenBy.HUMAN, True)}


@pytest.mark.parametrize("mode", ["Referee", "Learning", "Manual"])
def test_the_mode_of_a_strategy_does_not_tell_who_drove(mode: str, flags: Path) -> None:
    setup, found = rebuilt(flags)
    recorded = recorded_in(flags)
    for reports in recorded.reports.values():
        reports[:] = [(stamp, structs.replace(report, mode=mode)) for stamp, report in reports]
    again = list(decisions(setup, recorded))
    assert [(d.driver, d.able) for d in again] == [(d.driver, d.able) for d in found]


def test_a_player_that_learned_was_driven_by_a_program(tmp_path: Path) -> None:
    env = MatchEnvironment("sharks-and-minnows", learners=["player1"], max_time=2.0, record=tmp_path / "runs")
    env.reset(seed=1)
    while env.agents:
        env.step({"player1": np.ones(2, np.float32)})
    [run] = (tmp_path / "runs").iterdir()
    by = {(d.me.name == "player1", d.driver) for d in rebuilt(run)[1]}
    assert by == {(True, DrivenBy.PROGRAM), (False, DrivenBy.STRATEGY)}


@given(v=st.floats(-3.0, 3.0), w=st.floats(-6.0, 6.0), share=st.floats(0.1, 1.0))
def test_a_motion_that_was_cut_is_one_from_which_the_same_follows(v: float, w: float, share: float) -> None:
    limit = share * P2AT.v_max
    sent = P2AT.limited(Twist(v, w), limit)
    found = wanted(sent, P2AT, limit)
    again, whole = P2AT.limited(found, limit), P2AT.limited(found)
    assert (again.v, again.w) == pytest.approx((sent.v, sent.w), abs=1e-5)
    assert (whole.v, whole.w) == pytest.approx((found.v, found.w), abs=1e-5), "the robot can do it"


def test_a_gap_of_the_recording_has_no_decisions(sharks: Path) -> None:
    setup, whole = rebuilt(sharks)
    recorded = recorded_in(sharks)
    middle = whole[len(whole) // 2].time
    del_from, del_to = middle - 1.0, middle + 1.0
    recorded.poses[:] = [entry for entry in recorded.poses if not del_from < entry[0] < del_to]
    times = {decision.time for decision in decisions(setup, recorded)}
    assert times == {d.time for d in whole if not del_from < d.time < del_to}


def test_between_recorded_instants_places_are_interpolated(sharks: Path) -> None:
    """As in a match of several processes, whose recorder may hear the world at other instants than players do."""
    setup, whole = rebuilt(sharks)
    recorded = recorded_in(sharks)
    recorded.poses[:] = recorded.poses[::2]
    found = {(d.time, d.me.name): d.observation for d in decisions(setup, recorded)}
    errors = [np.abs(found[d.time, d.me.name] - d.observation) for d in whole if (d.time, d.me.name) in found]
    assert len(errors) > 0.95 * len(whole)
    assert np.mean(errors) < 0.02


def test_runs_become_one_table(sharks: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    shutil.copytree(sharks, again)
    file = tmp_path / "pairs.parquet"
    done = export(sharks, again, output=file)
    assert done.exit_code == 0, done.output
    setup, found = rebuilt(sharks)
    table = parquet.read_table(file)
    assert len(table) == 2 * len(found)
    assert set(table["run"].to_pylist()) == {sharks.name, "again"}
    assert set(table["strategy"].to_pylist()) == {setup.players[0].strategy}
    assert table.schema.field("time").metadata == {b"unit": b"s"}
    assert table.schema.field("observation").type == pa.list_(pa.float32(), len(found[0].observation))
    row = table.slice(100, 1).to_pylist()[0]
    assert (row["time"], row["player"], row["role"]) == (found[100].time, found[100].me.name, found[100].me.role)
    assert row["observation"] == found[100].observation.tolist()
    game, pairs = read(file, role="shark")
    able = [d for d in found if d.able and d.me.role == "shark"]
    assert (game, len(pairs.actions)) == (setup.game, 2 * len(able))
    np.testing.assert_array_equal(pairs.observations[: len(able)], [d.observation for d in able])
    np.testing.assert_array_equal(pairs.actions[: len(able)], [d.action for d in able])
    won = {team for team, won in zip(table["team"].to_pylist(), table["won"].to_pylist(), strict=True) if won}
    assert len(won) == 1
    with pytest.raises(ConfigError, match=r"role: expected one of \w+, \w+, got whale"):
        read(file, role="whale")
    with pytest.raises(ConfigError, match="driver: expected one of strategy, got human"):
        read(file, driver="human")


def test_a_table_without_what_is_asked_for_is_refused(tmp_path: Path) -> None:
    file, schema = tmp_path / "pairs.parquet", Heading.of(match_of("roboflag", engine=None, lasers=None)).schema

    def written(*, able: bool) -> None:
        row: dict[str, object] = dict.fromkeys(schema.names) | {"able": able, "team": "red"}
        parquet.write_table(pa.Table.from_pylist([row], schema), file)

    written(able=False)
    with pytest.raises(ConfigError, match="expected decisions of players that might move, found none"):
        read(file, team="red")
    written(able=True)
    with pytest.raises(ConfigError, match="none of the chosen ones is"):
        read(file, team="red", won=True)


def test_a_network_learns_from_the_file(flags: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, policy = tmp_path / "pairs.parquet", tmp_path / "policy.npz"
    assert export(flags, output=file).exit_code == 0
    words = f"imitate.py --from {file} --team red --driver strategy --minutes 0.01 --output {policy}".split()
    monkeypatch.setattr("sys.argv", words)
    imitate.main()
    learned = load(policy)
    assert learned.game == "roboflag"
    assert str(len(read(file, team="red")[1].actions)) in learned.trained


def test_what_imitate_cannot_use_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    old = tmp_path / "old.npz"
    np.savez(old, observations=np.zeros((3, 5), np.float32), actions=np.zeros((3, 2), np.float32))
    text = tmp_path / "text.parquet"
    text.write_text("no table")

    def refused(*words: str) -> str:
        monkeypatch.setattr("sys.argv", ["imitate.py", *words])
        with pytest.raises(SystemExit) as end:
            imitate.main()
        return capsys.readouterr().err if end.value.code == 2 else str(end.value.code)

    assert "--team, --winners: expected --from" in refused("--winners", "--team", "red")
    for words in ("--match", "roboflag"), ("--games", "3"), ("--pairs", str(old)):
        assert f"{words[0]}: expected none of these with --from" in refused("--from", str(text), *words)
    assert "--games: " in refused("--pairs", str(old), "--games", "3")
    assert "cannot be read" in refused("--from", str(text))
    assert "got ((5,), (2,)): delete it" in refused("--pairs", str(old))
    broken = tmp_path / "broken.npz"
    broken.write_text("no pairs")
    assert "expected pairs that --pairs has kept" in refused("--pairs", str(broken))
    assert "nowhere" in refused("--match", "nowhere")


def test_a_torn_recording_gives_what_it_has(sharks: Path, tmp_path: Path) -> None:
    torn = Path(shutil.copytree(sharks, tmp_path / "torn"))
    [part] = RunFolder(torn).recordings()
    part.write_bytes(part.read_bytes()[: part.stat().st_size * 2 // 3])
    done = export(torn, output=tmp_path / "pairs.parquet")
    assert done.exit_code == 0, done.output
    assert "recording.mcap ends in the middle" in done.output
    table = parquet.read_table(tmp_path / "pairs.parquet")
    whole = rebuilt(sharks)[1]
    assert 0 < len(table) < len(whole)
    assert table["time"].to_pylist() == [d.time for d in whole[: len(table)]]
    assert set(table["won"].to_pylist()) == {None}, "how it ended is not known"


def test_runs_without_what_is_needed_are_refused(sharks: Path, flags: Path, tmp_path: Path) -> None:
    file = tmp_path / "pairs.parquet"

    def refused(*paths: Path) -> str:
        done = export(*paths, output=file)
        assert isinstance(done.exception, LaunchError | ConfigError), done.output
        assert list(tmp_path.glob("*.p*")) == [], "no part of a file is left"
        return str(done.exception)

    assert "sharks-and-minnows with 96 values" in refused(sharks, flags)
    bare = Path(shutil.copytree(sharks, tmp_path / "bare"))
    (bare / "recording.mcap").unlink()
    assert "expected a recording" in refused(sharks, bare)
    (bare / "recording.mcap").write_bytes(b"no recording at all, but long enough")
    assert "its recording cannot be read" in refused(sharks, bare)
    nowhere = export(sharks, output=tmp_path / "nowhere" / "pairs.parquet")
    assert "cannot be written" in str(nowhere.exception)
    folder = export(sharks, output=Path("."))
    assert isinstance(folder.exception, ConfigError)
    assert "expected the path of a file, got a folder: pairs.parquet" in str(folder.exception)
    assert "got this one twice" in refused(sharks, sharks.parent / "." / sharks.name)
    namesake = Path(shutil.copytree(sharks, tmp_path / sharks.name))
    assert "expected folders of different names" in refused(sharks, namesake)
    hunters = load_match(match_path("pursuit-evasion"))
    with pytest.raises(ConfigError, match="expected a game in which all poses are published"):
        list(decisions(hunters, read_recorded(())))
    blind = structs.replace(read_setup(RunFolder(flags).setup), sight=3.0)
    with pytest.raises(ConfigError, match="expected a match in which teams see everybody"):
        list(decisions(blind, read_recorded(())))


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "pairs.parquet"
    file.write_text("no table")
    with pytest.raises(ConfigError, match=r"cannot be read.*vrg run export"):
        read(file)
    parquet.write_table(pa.table({"able": [True]}), file)
    with pytest.raises(ConfigError, match="expected decisions of recorded matches"):
        read(file)
    heading = b'{"format":1,"game":"roboflag","observation":["x"],"action":["v","w"]}'
    parquet.write_table(pa.table({"able": [True]}).replace_schema_metadata({"vrg": heading}), file)
    with pytest.raises(ConfigError, match="expected what this version of VRG shows in roboflag"):
        read(file)
