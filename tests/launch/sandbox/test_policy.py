"""What a player's process may reach, by its match."""

import os
import sys
from collections.abc import Iterator
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.config.code_files import imported
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.launch.sandbox import player_policy as reach
from vrg.launch.sandbox.player_policy import libraries, policy_of
from vrg.launch.sandbox.policy import Access, SealPolicy, readable
from vrg.runs.run_folder import RunFolder
from vrg.testing import matches
from vrg.testing.processes.match import short_match

TREE = {
    Path("/a"): [Path("/a/b"), Path("/a/c"), Path("/a/f")],
    Path("/a/b"): [Path("/a/b/x"), Path("/a/b/y")],
    Path("/a/c"): [Path("/a/c/z")],
}
LEAVES = [Path(name) for name in ("/a/b/x", "/a/b/y", "/a/c/z", "/a/f")]


def entries(folder: Path) -> list[Path]:
    return TREE.get(folder, [])


@given(hidden=st.sets(st.sampled_from([*TREE, *LEAVES])))
def test_all_that_is_not_hidden_can_be_read_and_nothing_else(hidden: set[Path]) -> None:
    found = list(readable(Path("/a"), hidden, entries))
    for leaf in LEAVES:
        secret = any(leaf.is_relative_to(place) for place in hidden)
        assert any(leaf.is_relative_to(place) for place in found) is not secret


def test_a_folder_without_secrets_is_one_entry() -> None:
    assert list(readable(Path("/a"), {Path("/b")}, entries)) == [Path("/a")]
    assert list(readable(Path("/a"), {Path("/a/b/x")}, entries)) == [Path("/a/b/y"), Path("/a/c"), Path("/a/f")]


@pytest.fixture
def afresh() -> Iterator[None]:
    """What other packages add is looked up in the test, and after it."""
    reach._plugins.cache_clear()
    yield
    reach._plugins.cache_clear()


@pytest.mark.usefixtures("afresh")
def test_a_package_that_adds_to_vrg_can_be_read_wherever_it_lies(monkeypatch: pytest.MonkeyPatch) -> None:
    """After `pip install -e` it may be in a folder that is not on Python's path."""
    spec = ModuleSpec("minds", None, is_package=True)
    spec.submodule_search_locations = ["/far/away/minds"]
    monkeypatch.setattr(reach, "plugin_packages", lambda: frozenset({"minds"}))
    monkeypatch.setattr(reach, "find_spec", {"minds": spec}.__getitem__)
    assert Path("/far/away/minds") in libraries()


@pytest.mark.usefixtures("afresh")
def test_a_game_beside_the_match_can_be_read_by_all_where_the_others_play_by_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After `pip install -e .` in the folder of a game, its default strategy is no secret of the team that uses it."""
    (tmp_path / "minds").mkdir()
    (tmp_path / "minds/__init__.py").touch()
    (tmp_path / "red.py").write_text("import minds\n")
    match = written(tmp_path, shark="red.py:S", ann="minds:S", bob="minds:S", cid="minds:S")
    run = RunFolder(tmp_path / "runs/now")
    code = tmp_path / "minds/__init__.py"
    assert not allowed(policy_of(match, "shark", run=run), code, Access.READ)
    spec = ModuleSpec("minds", None, is_package=True)
    spec.submodule_search_locations = [str(tmp_path / "minds")]
    monkeypatch.setattr(reach, "plugin_packages", lambda: frozenset({"minds"}))
    monkeypatch.setattr(reach, "find_spec", {"minds": spec}.__getitem__)
    reach._plugins.cache_clear()
    assert all(allowed(policy_of(match, name, run=run), code, Access.READ) for name in ("shark", "ann"))


def written(folder: Path, **strategies: str) -> MatchSetup:
    """A match in which players play by these strategies."""
    text = short_match("m")
    for player, strategy in strategies.items():
        text = text.replace(f'name = "{player}"', f'name = "{player}"\nstrategy = "{strategy}"')
    return matches.written(folder, text)


@pytest.fixture
def match(tmp_path: Path) -> MatchSetup:
    """A match with a strategy for each team, a module that both import, and runs, keys and notes beside them."""
    for name in ("red", "blue"):
        (tmp_path / f"{name}.py").write_text(f'import shared\nimport {name}_tricks\nFILES = ["{name}.bin"]\n')
        (tmp_path / f"{name}_tricks.py").touch()
    for name in ("shared.py", "red.bin", "blue.bin", "diary.txt"):
        (tmp_path / name).touch()
    for name in ("runs/now/logs", "runs/now/players", "runs/before", "keys/player.ann", "keys/player.bob"):
        (tmp_path / name).mkdir(parents=True)
    return written(tmp_path, shark="red.py:S", ann="blue.py:S", bob="blue.py:S", cid="blue.py:S")


def policy(match: MatchSetup, name: str = "ann") -> SealPolicy:
    base = Path(match.base)
    return policy_of(match, name, run=RunFolder(base / "runs/now"), keys=base / "seats")


def allowed(wanted: SealPolicy, path: Path, access: Access) -> bool:
    return any(path.is_relative_to(place) and access in what for place, what in wanted.files)


def test_a_player_reads_what_it_needs_and_no_more(match: MatchSetup) -> None:
    base, wanted = Path(match.base), policy(match)
    needed = {
        "blue.py", "blue_tricks.py", "shared.py", "blue.bin", "runs/now/players/ann/notes",
    }  # fmt: skip
    others = {
        "match.toml", "red.py", "red_tricks.py", "red.bin", "diary.txt", "keys/player.ann/seat.key",
        "keys/player.bob/seat.key", "seats/player.ann/seat.key", "keys/authority/ca.key", "runs/before/red.py",
        "runs/now/red.py", "runs/now/world.snapshot", "runs/now/setup.json", "runs/now/setups/bob.json",
        "runs/now/secret", "runs/now/logs/referee.log", "runs/now/logs/ann.json", "runs/now/players/bob/notes",
    }  # fmt: skip
    found = {path for path in needed | others if allowed(wanted, base / path, Access.READ)}
    assert found == needed, f"cannot read {needed - found}, but can read {found - needed}"


def test_a_player_writes_in_its_folder_alone(match: MatchSetup) -> None:
    run = Path(match.base) / "runs/now"
    wanted = policy(match)
    writable = {place for place, what in wanted.files if Access.WRITE in what and not place.is_relative_to("/dev")}
    assert writable == {run / "players/ann"}
    assert {place for place, what in wanted.files if Access.MAKE in what} == {run / "players/ann"}
    assert wanted.folder == run / "players/ann"


def test_a_player_reaches_no_port_and_is_pinned_where_that_is_wanted(match: MatchSetup) -> None:
    base = Path(match.base)
    pinned = policy_of(match, "ann", run=RunFolder(base / "runs/now"), pinned=True)
    assert (policy(match).ports, policy(match).core) == ((), None)
    assert pinned.core == match.player("ann").number


def test_nobody_reads_another_process_of_the_system(match: MatchSetup) -> None:
    for place in ("/proc/1/mem", "/dev/mem", "/tmp/x", "/etc/shadow", "/dev/shm/x", "/root/.ssh/id"):
        assert not allowed(policy(match), Path(place), Access.READ), place


def test_players_are_sealed_by_default_with_seats_if_their_strategy_is_a_file_and_without_if_it_is_a_strangers(
    match: MatchSetup, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    built_in = match.substituted("ann", "sharks-and-minnows")
    assert match.sandboxed("ann", seats=True)
    assert not match.sandboxed("ann", seats=False)
    assert not built_in.sandboxed("ann", seats=True)
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "new.py"
    elsewhere.touch()
    assert match.substituted("ann", f"{elsewhere}:S").sandboxed("ann", seats=False), "outside the match's folder"
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    assert match.sandboxed("ann", seats=False), "of another user"
    assert not built_in.sandboxed("ann", seats=False)


@pytest.mark.parametrize("wanted", [True, False])
def test_the_match_file_decides_about_sandboxes(match: MatchSetup, wanted: bool) -> None:
    decided = load_match(Path(match.origin), sandbox=wanted)
    for seats in (True, False):
        assert decided.sandboxed("ann", seats=seats) is wanted
        assert decided.substituted("ann", "sharks-and-minnows").sandboxed("ann", seats=seats) is wanted


def test_a_stranger_does_not_name_what_it_may_read(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What its text names is its own only if it is: no keys, no runs, and nothing of another team."""
    outside = tmp_path_factory.mktemp("outside") / "secret"
    hidden = ("keys/referee/seat.key", "runs/old/setup.json", ".ssh/id", ".hidden", "seat.key")
    files = [*hidden, "bob/plan.bin", "bob/bob.py"]
    for name in [*files, "match.toml", "mine.bin"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    outside.touch()
    (tmp_path / "linked").symlink_to(outside)
    named = [*files, "match.toml", "mine.bin", "linked", str(outside), "../secret", "."]
    (tmp_path / "ann.py").write_text(f"import bob\nFILES = {named}\n")
    (tmp_path / "bob" / "bob.py").write_text('import tricks\nFILES = ["plan.bin"]\n')
    match = written(tmp_path, shark="bob/bob.py:S", ann="ann.py:S")
    policy_of_ann = policy_of(match, "ann", run=RunFolder(tmp_path / "runs/now"))
    paths = [*(tmp_path / name for name in [*files, "match.toml", "mine.bin", "linked"]), outside]
    assert [path for path in paths if allowed(policy_of_ann, path, Access.READ)] == [tmp_path / "mine.bin"]
    assert imported(tmp_path / "ann.py", [tmp_path / "bob" / "bob.py"]) == [tmp_path / "mine.bin"]
    # On another machine the match lies in the run folder.
    there = policy_of(match, "ann", run=RunFolder(tmp_path))
    (tmp_path / "ann.py").write_text('FILES = ["secret", "setup.json", "journal.jsonl"]\n')
    for name in ("secret", "setup.json", "journal.jsonl"):
        (tmp_path / name).touch()
        assert not allowed(there, tmp_path / name, Access.READ)
    monkeypatch.setattr("vrg.config.code_files._homes", lambda: {tmp_path})
    assert imported(tmp_path / "ann.py") == []


def test_keys_in_a_folder_of_libraries_are_hidden(match: MatchSetup, monkeypatch: pytest.MonkeyPatch) -> None:
    base = Path(match.base)
    (base / "seats" / "player.ann").mkdir(parents=True)
    (base / "notes.py").touch()
    monkeypatch.setattr("sys.path", [*sys.path, str(base)])
    assert allowed(policy(match), base / "notes.py", Access.READ)
    assert not allowed(policy(match), base / "seats/player.ann/seat.key", Access.READ)


def test_libraries_are_readable_also_where_runs_lie(match: MatchSetup, monkeypatch: pytest.MonkeyPatch) -> None:
    """As with `--runs .` in the folder of a project that has its own environment."""
    base = Path(match.base)
    library = base / "runs" / "environment"
    (library / "lib").mkdir(parents=True)
    monkeypatch.setattr("sys.path", [*sys.path, str(library)])
    assert allowed(policy(match), library / "lib" / "numpy.py", Access.READ)
    assert not allowed(policy(match), base / "runs" / "before" / "red.py", Access.READ)


def test_to_import_a_strategy_of_others_is_not_enough_to_read_it(match: MatchSetup) -> None:
    base = Path(match.base)
    (base / "blue.py").write_text("import shared\nimport blue_tricks\nif False:\n    import red\n")
    assert not allowed(policy(match), base / "red.py", Access.READ)
    assert allowed(policy(match), base / "shared.py", Access.READ)


@pytest.mark.parametrize("package", [False, True])
def test_a_strategy_that_is_named_as_a_module_is_hidden_and_sealed_too(tmp_path: Path, package: bool) -> None:
    where = tmp_path / "red" / "__init__.py" if package else tmp_path / "red.py"
    where.parent.mkdir(exist_ok=True)
    where.touch()
    (tmp_path / "blue.py").touch()
    match = written(tmp_path, shark="red:S", ann="blue:S")
    assert not allowed(policy(match), where, Access.READ)
    assert allowed(policy(match, "shark"), where, Access.READ)
    assert allowed(policy(match, "shark"), tmp_path, Access.LIST), "Python finds it in a list of the folder"
    assert match.sandboxed("shark", seats=True)


def test_on_another_machine_substitutes_of_others_are_hidden(match: MatchSetup) -> None:
    """There the match file lies in the run folder itself."""
    base = Path(match.base)
    for name in ("1", "2"):
        (base / "substitutes" / name).mkdir(parents=True)
        (base / "substitutes" / name / "new.py").touch()
    (base / ".agent").touch()
    played = match.substituted("ann", "substitutes/2/new.py:S")
    run = RunFolder(base)
    of_ann = policy_of(played, "ann", run=run)
    of_bob = policy_of(played, "bob", run=run)
    assert allowed(of_ann, base / "substitutes/2/new.py", Access.READ)
    assert not allowed(of_ann, base / "substitutes/1/new.py", Access.READ)
    assert not allowed(of_bob, base / "substitutes/1/new.py", Access.READ)
    assert not allowed(of_bob, base / ".agent", Access.READ)
