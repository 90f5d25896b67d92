"""Folders of keys: who can read them, what is handed out, and what is wrong with them."""

import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from vrg.errors import ConfigError, CredentialsError
from vrg.launch.folder_lock import KEYS_LOCK
from vrg.launch.match_keys import check_keys, keys_for
from vrg.seats.credentials import find_credentials
from vrg.seats.folder import LOCAL_HOSTS, KeysFolder
from vrg.seats.seat import Roster, Seat, SeatKind

ROSTER = Roster("final", {"ann": "red", "Łukasz": "blue"})
ANN, LUKASZ, ROUTER = Seat(SeatKind.PLAYER, "ann"), Seat(SeatKind.PLAYER, "Łukasz"), Seat(SeatKind.ROUTER)
NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
DAY = timedelta(days=1)


@pytest.fixture
def folder(tmp_path: Path) -> KeysFolder:
    made = KeysFolder(tmp_path / "keys")
    made.make("final", ROSTER.seats, NOW)
    return made


def test_a_folder_that_was_there_before_stays_as_open_as_it_was(folder: KeysFolder, tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    folder.hand_out([ANN], shared)
    assert stat.S_IMODE(shared.stat().st_mode) == 0o1777
    assert stat.S_IMODE((shared / "player.ann").stat().st_mode) == 0o700


def test_every_seat_has_keys_of_the_authority_which_only_their_owner_can_read(folder: KeysFolder) -> None:
    paths = [folder.path, *folder.path.rglob("*")]
    for path in paths:
        mode = stat.S_IMODE(path.stat().st_mode)
        assert mode == (0o700 if path.is_dir() else 0o600), path
    names = {path.name for path in paths if path.is_file()}
    assert names == {"ca.crt", "ca.key", "seat.crt", "seat.key"}
    found = {entry.credentials.common_name: entry for entry in folder.entries()}
    assert set(found) == {seat.common_name for seat in ROSTER.seats}
    assert all(entry.genuine for entry in found.values())


def test_what_is_handed_out_is_all_that_the_seat_needs_and_nothing_else(folder: KeysFolder, tmp_path: Path) -> None:
    made = folder.hand_out([ANN, LUKASZ], tmp_path / "stick")
    assert made == [tmp_path / "stick" / seat.common_name for seat in (ANN, LUKASZ)]
    files = sorted(
        str(path.relative_to(tmp_path / "stick")) for path in (tmp_path / "stick").rglob("*.*") if path.is_file()
    )
    wanted = [f"{seat.common_name}/{name}" for seat in (ANN, LUKASZ) for name in ("ca.crt", "seat.crt", "seat.key")]
    assert files == sorted(wanted)
    assert (
        find_credentials(tmp_path / "stick", [ANN]).private_key.read_bytes()
        == (folder.path / "player.ann" / "seat.key").read_bytes()
    )
    check_keys(KeysFolder(tmp_path / "stick"), "final", [ANN, LUKASZ], NOW)
    with pytest.raises(CredentialsError, match=r"expected the keys of the seat official or window, found those of"):
        find_credentials(tmp_path / "stick", [Seat(SeatKind.OFFICIAL), Seat(SeatKind.WINDOW)])


def test_a_seat_without_keys_is_not_handed_out(folder: KeysFolder, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"expected the keys of player\.eve, found those of .*player\.ann"):
        folder.hand_out([ANN, Seat(SeatKind.PLAYER, "eve")], tmp_path / "stick")
    assert not (tmp_path / "stick").exists()


def test_renewed_keys_last_longer_and_are_of_the_same_authority_where_that_is(
    folder: KeysFolder, tmp_path: Path
) -> None:
    before = {entry.credentials.common_name: entry.validity for entry in folder.entries()}
    authority = (folder.path / "authority" / "ca.crt").read_bytes()
    more = Roster("final", {**ROSTER.teams, "eve": "red"})
    folder.renew("final", more.seats, NOW + 20 * DAY)
    after = {entry.credentials.common_name: entry for entry in folder.entries()}
    assert all(after[name].validity.ends == told.ends + 20 * DAY for name, told in before.items())
    assert after["player.eve"].genuine
    assert after["router"].validity.hosts == before["router"].hosts, "what it was reached by, it still is"
    assert (folder.path / "player.ann" / "ca.crt").read_bytes() == authority
    folder.renew("final", ROSTER.seats, NOW, hosts=["10.0.0.5", "localhost"])
    (router,) = [entry for entry in folder.entries() if entry.credentials.common_name == "router"]
    assert router.validity.hosts == (*LOCAL_HOSTS, "10.0.0.5")
    folder.hand_out([ANN], tmp_path / "laptop")
    with pytest.raises(ConfigError, match="renew keys where they were made"):
        KeysFolder(tmp_path / "laptop").renew("final", [ANN], NOW)


def test_a_match_has_an_authority_of_its_own(folder: KeysFolder) -> None:
    with pytest.raises(ConfigError, match=r"expected the authority of the match cup \(VRG cup\), found VRG final"):
        folder.renew("cup", ROSTER.seats, NOW)
    with pytest.raises(ConfigError, match=r"expected keys of the match cup \(VRG cup\), found some of VRG final"):
        check_keys(folder, "cup", ROSTER.seats, NOW)


def test_a_seat_of_an_older_authority_is_not_taken_for_one_of_this_match(folder: KeysFolder, tmp_path: Path) -> None:
    other = KeysFolder(tmp_path / "other")
    other.make("final", ROSTER.seats, NOW)
    other.hand_out([ANN], folder.path)
    genuine = {entry.credentials.common_name: entry.genuine for entry in folder.entries()}
    assert [name for name, good in genuine.items() if not good] == ["player.ann"]
    with pytest.raises(ConfigError, match=r"player\.ann is not one of this authority"):
        check_keys(folder, "final", ROSTER.seats, NOW)
    for file in (folder.path / "authority").iterdir():
        file.unlink()
    assert {entry.credentials.common_name: entry.genuine for entry in folder.entries()} == genuine, "by the router's"


def test_another_authority_leaves_no_keys_of_the_old_one(folder: KeysFolder) -> None:
    (folder.path / "notes.txt").write_text("mine")
    (folder.path / "world" / "notes.txt").write_text("mine")
    folder.make("final", [ANN, ROUTER], NOW, keep_authority=False)
    assert {path.name for path in folder.path.iterdir()} == {"player.ann", "router", "world", "notes.txt"}
    assert [path.name for path in (folder.path / "world").iterdir()] == ["notes.txt"]
    check_keys(folder, "final", [ANN, ROUTER], NOW)


@pytest.mark.parametrize("name", ["ca.key", "ca.crt"])
def test_an_authority_that_was_torn_is_told(folder: KeysFolder, name: str) -> None:
    (folder.path / "authority" / name).write_bytes(b"-----BEGIN")
    with pytest.raises(ConfigError, match=r"make another (authority|one) with `vrg keys init --replace`"):
        folder.renew("final", [ANN], NOW)


def test_keys_that_others_can_read_are_refused(folder: KeysFolder) -> None:
    key = folder.path / "player.ann" / "seat.key"
    key.chmod(0o640)
    with pytest.raises(CredentialsError, match=r"others on this machine can read .* \(mode 640\): run `chmod 600"):
        find_credentials(folder.path, [ANN])


@pytest.mark.parametrize("name", ["seat.key", "ca.crt"])
def test_a_missing_file_is_told(folder: KeysFolder, name: str) -> None:
    (folder.path / "player.ann" / name).unlink()
    with pytest.raises(CredentialsError, match=f"{name}: expected a file of the seat player.ann: No such file"):
        find_credentials(folder.path, [ANN])


def test_a_folder_that_is_missing_or_broken_is_told(folder: KeysFolder, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="expected a folder of keys: No such file"):
        KeysFolder(tmp_path / "nothing").entries()
    (folder.path / "player.ann" / "seat.crt").write_text("nothing")
    with pytest.raises(ConfigError, match=r"player\.ann: expected the keys of a seat"):
        folder.entries()


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(ConfigError, match="keys cannot be written"):
        KeysFolder(tmp_path / "file" / "keys").make("final", [ANN], NOW)


def test_a_match_is_not_started_with_keys_that_will_be_refused(folder: KeysFolder, tmp_path: Path) -> None:
    seats = [*ROSTER.seats, Seat(SeatKind.PLAYER, "eve")]
    with pytest.raises(ConfigError, match=r"the seat player\.eve has no keys: run `vrg keys renew MATCH`"):
        check_keys(folder, "final", seats, NOW)
    with pytest.raises(ConfigError, match=r"the certificate of the seat world has expired on 2026-03-31 12:00 UTC"):
        check_keys(folder, "final", ROSTER.seats, NOW + 31 * DAY)
    other = KeysFolder(tmp_path / "other")
    other.make("final", ROSTER.seats, NOW)
    (folder.path / "player.ann" / "seat.crt").write_bytes((other.path / "player.ann" / "seat.crt").read_bytes())
    with pytest.raises(ConfigError, match=r"player\.ann is not one of this authority"):
        check_keys(folder, "final", ROSTER.seats, NOW)
    for name in ("seat.crt", "seat.key"):
        (folder.path / "player.ann" / name).write_bytes((folder.path / "world" / name).read_bytes())
    with pytest.raises(ConfigError, match=r"player\.ann is not one of this authority"):
        check_keys(folder, "final", ROSTER.seats, NOW)


def test_keys_for_one_run_are_private_and_gone_with_it() -> None:
    with keys_for(ROSTER, None, NOW) as made:
        assert stat.S_IMODE(made.stat().st_mode) == 0o700
        check_keys(KeysFolder(made), "final", ROSTER.seats, NOW)
        assert not KeysFolder(made).has_authority, "nobody can make further keys"
        assert not list(made.rglob("ca.key"))
    assert not made.exists()
    with pytest.raises(RuntimeError), keys_for(ROSTER, None, NOW) as made:
        raise RuntimeError
    assert not made.exists(), "also if the run fails"


def test_the_next_launcher_deletes_keys_that_a_killed_one_has_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    left, strange = tmp_path / "vrg-keys-left", tmp_path / "vrg-keys-strange"
    left.mkdir()
    (left / KEYS_LOCK).touch()
    strange.mkdir()
    with keys_for(ROSTER, None, NOW) as first, keys_for(ROSTER, None, NOW) as second:
        assert not left.exists()
        assert strange.exists(), "nothing tells that a launcher has made it"
        assert first.exists(), "its launcher lives"
        assert second.exists()
    assert not first.exists()


def test_given_keys_are_checked_and_kept(folder: KeysFolder) -> None:
    with keys_for(ROSTER, folder.path, NOW) as used:
        assert used == folder.path
    assert folder.has_authority
    with pytest.raises(ConfigError, match="has expired"), keys_for(ROSTER, folder.path, NOW + 40 * DAY):
        pass
