"""Students' code in sandboxes, in a real match with seats."""

import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from tests.requirements import missing as lacking
from tests.system.cheating import CHEATING
from tests.system.harness import Match, long_match, wait_until
from vrg.config.loading import load_match
from vrg.launch.sandbox.seal import missing
from vrg.seats.folder import LOCAL_HOSTS, KeysFolder

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


@pytest.fixture(autouse=True)
def _can_be_sealed() -> None:
    reason = missing()
    if reason is not None:
        lacking(reason)


def text_of(folder: Path, name: str, *, cheat: str = "cid", strategy: str = "") -> str:
    """A match in which everybody's strategy is a file, and one player cheats."""
    text = long_match(name)
    (folder / "honest.py").write_text(HONEST)
    (folder / "shark.py").write_text(HONEST)
    for player in ("shark", "ann", "bob", "cid"):
        file = (
            "shark.py:Honest" if player == "shark" else strategy if player == cheat and strategy else "honest.py:Honest"
        )
        text = text.replace(f'name = "{player}"', f'name = "{player}"\nstrategy = "{folder}/{file}"')
    return text


def test_sealed_players_get_in_again_after_the_router_has_died(start: Callable[..., Match], tmp_path: Path) -> None:
    match = start(text_of(tmp_path, "sealed"), seats=True)
    observer = match.observer
    for name in ("shark", "ann", "bob", "cid"):
        status = Path(f"/proc/{match.child(name).pid}/status").read_text()
        assert re.search(r"^Seccomp:\s2$", status, re.MULTILINE)
        assert re.search(r"^CapEff:\s0+$", status, re.MULTILINE)
    players = {name: match.child(name).pid for name in ("ann", "bob", "cid")}
    match.lose_router()
    observer.wait_until(lambda: observer.moving("ann", "bob", "cid"), "sealed players to move again")
    assert {name: match.child(name).pid for name in players} == players, "none of them was started again"
    notes = match.run.path / "players" / "ann" / "notes"
    wait_until(lambda: float(notes.read_text() or 0) > 1.0, "notes in the player's folder")


def test_a_cheat_harms_only_itself_and_is_named(start: Callable[..., Match], tmp_path: Path) -> None:
    text = text_of(tmp_path, "cheated", strategy="cheat.py:Cheat")
    keys = tmp_path / "keys"
    (tmp_path / "cheat.py").write_text(CHEATING.format(keys=str(keys)))
    (tmp_path / "match.toml").write_text(text)
    roster = load_match(tmp_path / "match.toml").roster
    lasts = timedelta(days=1)
    KeysFolder(keys).make(roster.match, roster.seats, datetime.now(UTC), lasts=lasts, hosts=list(LOCAL_HOSTS))
    match = start(text, seats=keys)
    observer = match.observer
    others = {name: match.child(name).pid for name in ("world", "coordinator", "router", "shark", "ann", "bob")}
    observer.wait_until(
        lambda: "disqualified" in match.said() and "cid" in match.said(), "the cheat to be disqualified"
    )
    log = match.log("cid")
    said = re.findall(r"cheat: (\w+) (\w+)", log)
    assert len(said) >= 19
    assert {how for _, how in said} == {"refused"}
    words = r"cid: it fails too often: PermissionError: .* the sandbox refused it: .* \(cheat\.py, line \d+, in act\)"
    assert re.search(words, match.said())
    assert {name: match.child(name).pid for name in others} == others, "nobody else was started again"
    assert not (tmp_path / "evil").exists()
    observer.wait_until(lambda: observer.moving("ann", "bob"), "the others to play on")
    assert observer.playing


def test_a_match_file_switches_sandboxes_off(start: Callable[..., Match], tmp_path: Path) -> None:
    text = "sandbox = false\n" + text_of(tmp_path, "unsealed")
    match = start(text, seats=True, environment={"VRG_PLAYER_FOLDER": str(tmp_path)})
    wait_until(lambda: float((tmp_path / "notes").read_text() or 0) > 1.0, "notes where a sealed player cannot write")
    assert not (match.run.path / "players").exists()
