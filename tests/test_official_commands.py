"""Which matches the commands of officials reach, without any match that runs."""

import os
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest
from msgspec import structs

from tests.command_line import invoke
from tests.ui import synthetic
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease
from vrg.bus.session import open_router, open_session
from vrg.bus.topics import Keys
from vrg.commands import estop as stopping
from vrg.commands.matches import keys_of
from vrg.config.targets import whole_target
from vrg.errors import BusError, ConfigError, CredentialsError
from vrg.launch.endpoints import free_endpoint
from vrg.launch.running import RunningMatch, registered
from vrg.seats.folder import KeysFolder
from vrg.seats.seat import Roster, Seat, SeatKind


@pytest.fixture
def ordered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, bool]]:
    """The emergency stops that were ordered, by match. The router of match `dead` does not answer."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    orders: list[tuple[str, bool]] = []

    def order(name: str, _endpoint: str, _keys: Path | None, estop: Estop | EstopRelease) -> None:
        if name == "dead":
            raise BusError("nobody answers")
        orders.append((name, isinstance(estop, Estop)))

    monkeypatch.setattr(stopping, "_order_estop", order)
    return orders


@contextmanager
def listed(*names: str, folder: str | None = None, **keys: str) -> Iterator[None]:
    """Matches of these names run on this machine, begun in a folder (None: this one), some with a folder of keys."""
    with ExitStack() as stack:
        for name in names:
            entry = RunningMatch(
                match=name, router=f"tls/127.0.0.1:{len(name)}", run="x", pid=os.getpid(),
                folder=folder or os.getcwd(), keys=keys.get(name, ""),
            )  # fmt: skip
            stack.enter_context(registered(entry))
        yield


def test_an_emergency_stop_reaches_every_match_that_can_be_reached_and_says_which(
    ordered: list[tuple[str, bool]],
) -> None:
    with listed("left", "dead", "right", folder="/somewhere/else"):
        done = invoke("estop")
    assert done.exit_code == 1
    assert sorted(ordered) == [("left", True), ("right", True)]
    for said in ("left: emergency stop engaged", "right: emergency stop engaged", "dead: nobody answers"):
        assert said in done.output
    with listed("left"):
        assert invoke("estop").exit_code == 0


def test_each_match_that_runs_here_is_stopped_with_its_own_keys_unless_others_are_typed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("VRG_KEYS", "/others")
    used: dict[str, Path | None] = {}
    monkeypatch.setattr(stopping, "_order_estop", lambda name, _at, keys, _order: used.update({name: keys}))
    with listed("left", "right", right="/own"):
        assert invoke("estop").exit_code == 0
        assert used == {"left": Path("/others"), "right": Path("/own")}
        here, elsewhere = "tls/127.0.0.1:5", "tls/10.0.0.5:1"
        assert keys_of(here, Path("/others")) == Path("/own")
        assert keys_of(here, Path("/typed")) == Path("/typed")
        assert keys_of(elsewhere, Path("/others")) == Path("/others")
        assert keys_of(elsewhere, None) is None


ROSTER = Roster("final", {"ann": "red", "Łukasz": "blue"}, hosts=("pi",))


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> KeysFolder:
    folder = KeysFolder(tmp_path_factory.mktemp("keys") / "keys")
    folder.make(ROSTER.match, ROSTER.seats, datetime.now(UTC))
    return folder


@pytest.mark.parametrize("seat", [seat for seat in ROSTER.seats if seat.kind not in ("router", "host")], ids=str)
def test_every_seat_that_takes_part_stops_all_robots(keys: KeysFolder, tmp_path: Path, seat: Seat) -> None:
    keys.hand_out([Seat(SeatKind.HOST, "pi"), seat], tmp_path / "stick")
    found = stopping._credentials_for_order("tls/x:1", tmp_path / "stick", Estop(by="ann"))
    assert found is not None
    assert found.common_name == seat.common_name


def test_a_stop_is_an_officials_where_there_is_one_with_good_keys(keys: KeysFolder, tmp_path: Path) -> None:
    stick = tmp_path / "stick"
    keys.hand_out(ROSTER.seats, stick)
    found = stopping._credentials_for_order("tls/x:1", stick, Estop(by="ann"))
    assert found is not None
    assert found.common_name == "official"
    found.private_key.chmod(0o644)
    other = stopping._credentials_for_order("tls/x:1", stick, Estop(by="ann"))
    assert other is not None
    assert other.common_name != "official"


def test_who_may_not_stop_or_release_is_told_so(keys: KeysFolder, tmp_path: Path) -> None:
    stick = tmp_path / "stick"
    keys.hand_out([Seat(SeatKind.HOST, "pi")], stick)
    with pytest.raises(CredentialsError, match=r"expected the keys of a seat that is one of official, commander, .*pi"):
        stopping._credentials_for_order("tls/x:1", stick, Estop(by="ann"))
    keys.hand_out([Seat(SeatKind.PLAYER, "ann")], stick)
    with pytest.raises(CredentialsError, match=r"expected the keys of the seat official, found those of host.pi, play"):
        stopping._credentials_for_order("tls/x:1", stick, EstopRelease(by="ann"))


def test_a_release_must_say_which_of_several(ordered: list[tuple[str, bool]]) -> None:
    with listed("left", "right"):
        assert isinstance(invoke("estop", "--release").exception, ConfigError)
        invoke("estop", "--release", "left")
    assert ordered == [("left", False)]


def test_somebody_elses_match_must_be_named(ordered: list[tuple[str, bool]]) -> None:
    with listed("theirs", folder="/somewhere/else"):
        for command in (("estop", "--release"), ("official", "resume")):
            done = invoke(*command)
            assert isinstance(done.exception, ConfigError)
            assert "the only match that runs here is theirs, started in /somewhere/else" in str(done.exception)
        invoke("estop", "--release", "theirs")
    assert ordered == [("theirs", False)]


def test_a_module_in_the_working_folder_is_meant_by_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").touch()
    assert whole_target("mine:Mine") == whole_target("mine.py:Mine") == f"{tmp_path / 'mine.py'}:Mine"
    assert whole_target("elsewhere.players:Mine") == "elsewhere.players:Mine"
    assert whole_target("sharks-and-minnows") == "sharks-and-minnows"


def test_a_release_tells_whether_there_was_a_stop() -> None:
    """The referee is a thread here: it reports an emergency stop until it hears of the release."""
    endpoint, keys, ended = free_endpoint(), Keys("m"), threading.Event()
    state = synthetic.state(0.0, estop=True)

    def referee() -> None:
        with open_session(endpoint) as session:
            mailbox = Mailbox("coordinator/referee")
            releases = mailbox.subscribe(keys.estop_release)
            session.attach(mailbox)
            mailbox.publish(keys.referee_state, state)
            while not ended.wait(0.01):
                session.send(mailbox.collect())
                session.receive()
                mailbox.handover(0.0)
                for _ in releases.take():
                    mailbox.publish(keys.referee_state, structs.replace(state, estop=False))

    with open_router(endpoint):
        thread = threading.Thread(target=referee)
        thread.start()
        try:
            first, second = (invoke("estop", "--release", "m", "--router", endpoint) for _ in range(2))
        finally:
            ended.set()
            thread.join()
    assert "m: released: go on with" in first.output
    assert "m: no emergency stop was engaged, so there was nothing to release" in second.output
