"""Students' code in sandboxes, in a real match with seats."""

import contextlib
import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from tests.system.cheating import CHEATING
from vrg.config.loading import load_match
from vrg.launch.sandbox.seal import missing
from vrg.seats.folder import LOCAL_HOSTS, KeysFolder
from vrg.testing.processes.arena import Arena
from vrg.testing.processes.match import LiveMatch, long_match
from vrg.testing.requirements import missing as lacking
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

HONEST = """
import os
from pathlib import Path

from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer


class Honest(SharksAndMinnowsPlayer):
    def act(self, view):
        Path(os.environ["VRG_PLAYER_FOLDER"], "notes").write_text(str(view.time))
        return super().act(view)
"""
"""A strategy that takes notes."""
HONEST_MINNOWS = ("ann", "bob")


@pytest.fixture(scope="module", autouse=True)
def _can_be_sealed() -> None:
    reason = missing()
    if reason is not None:
        lacking(reason)


def text_of(folder: Path) -> str:
    """A match in which everybody's strategy is a file, and cid cheats."""
    text = long_match("sealed")
    files = dict.fromkeys(("ann", "bob"), "honest.py:Honest") | {"shark": "shark.py:Honest", "cid": "cheat.py:Cheat"}
    for player, file in files.items():
        text = text.replace(f'name = "{player}"', f'name = "{player}"\nstrategy = "{folder}/{file}"')
    return text


def noted(path: Path) -> bool:
    """Whether there are notes of a player that has played for a while: one may be at writing them."""
    with contextlib.suppress(FileNotFoundError):
        return float(path.read_text() or 0) > 1.0
    return False


@pytest.fixture(scope="module")
def sealed(arena: Arena, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[LiveMatch, Path]]:
    """A match of sealed players, one of whom cheats, and the folder of their strategies."""
    folder = tmp_path_factory.mktemp("sealed")
    text, keys = text_of(folder), folder / "keys"
    for name in ("honest.py", "shark.py"):
        (folder / name).write_text(HONEST)
    (folder / "cheat.py").write_text(CHEATING.format(keys=str(keys)))
    (folder / "match.toml").write_text(text)
    roster = load_match(folder / "match.toml").roster
    lasts = timedelta(days=1)
    KeysFolder(keys).make(roster.match, roster.seats, datetime.now(UTC), lasts=lasts, hosts=list(LOCAL_HOSTS))
    match = arena.start(text, seats=keys, movers=HONEST_MINNOWS)
    yield match, folder
    match.close()


def test_a_cheat_harms_only_itself_and_is_named(sealed: tuple[LiveMatch, Path]) -> None:
    match, folder = sealed
    observer = match.observer
    others = {name: match.child(name).pid for name in ("world", "coordinator", "router", "shark", *HONEST_MINNOWS)}
    words = r"cid: it fails too often: PermissionError: .* the sandbox refused it: .* \(cheat\.py, line \d+, in act\)"
    observer.wait_until(
        lambda: "disqualified" in match.said() and re.search(words, match.said()), "the cheat to be disqualified"
    )
    log = match.log("cid")
    said = re.findall(r"cheat: (\w+) (\w+)", log)
    assert len(said) >= 13
    assert {how for _, how in said} == {"refused"}
    # A busy machine may keep a process from running for so long that the launcher takes it to hang.
    late = {name for name in others if f"{name} hangs" in match.said()}
    same = {name for name in others if name not in late and match.child(name).pid == others[name]}
    assert same | late == set(others), "nobody else was started again"
    assert not (folder / "evil").exists()
    assert observer.playing or observer.stalled
    observer.wait_moving(*HONEST_MINNOWS)


@pytest.mark.thorough
def test_sealed_players_get_in_again_after_the_router_has_died(sealed: tuple[LiveMatch, Path]) -> None:
    match, _ = sealed
    for name in ("shark", *HONEST_MINNOWS):
        (strategy,) = match.child(name).children()
        status = Path(f"/proc/{strategy.pid}/status").read_text()
        assert re.search(r"^Seccomp:\s2$", status, re.MULTILINE)
        assert re.search(r"^CapEff:\s0+$", status, re.MULTILINE)
    players = {name: match.child(name).pid for name in HONEST_MINNOWS}
    match.lose_router()
    assert {name: match.child(name).pid for name in players} == players, "none of them was started again"
    wait_until(lambda: noted(match.run.path / "players" / "ann" / "notes"), "notes in the player's folder")
