"""Which matches the commands of officials reach, without any match that runs."""

import os
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest
from msgspec import structs

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease
from vrg.bus.session import open_router, open_session
from vrg.bus.topics import Keys
from vrg.commands import estop as stopping
from vrg.commands.estop import STOPPING
from vrg.commands.matches import folders_of_keys, keys_of
from vrg.config.targets import whole_target
from vrg.errors import BusError, ConfigError, CredentialsError
from vrg.launch.endpoints import free_endpoint
from vrg.launch.running import RunningMatch, registered
from vrg.seats.credentials import PRIVATE_KEY, Credentials, credentials_of, find_credentials
from vrg.seats.folder import KeysFolder
from vrg.seats.seat import Roster, Seat, SeatKind
from vrg.testing.command_line import invoke
from vrg.testing.views import synthetic


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


def test_a_match_has_the_keys_that_are_typed_or_its_own_or_those_of_the_variable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    here, elsewhere, open_to_all = "tls/127.0.0.1:5", "tls/10.0.0.5:1", "tcp/10.0.0.5:1"
    typed, own, others = Path("/typed"), Path("/own"), Path("/others")
    with listed("left", "right", right="/own"):
        assert keys_of(elsewhere, None) is None
        monkeypatch.setenv("VRG_KEYS", "/others")
        assert folders_of_keys(here, typed) == [typed, own, others]
        assert keys_of(here, None) == own
        assert keys_of(here, typed) == keys_of(open_to_all, typed) == typed
        assert keys_of(elsewhere, None) == others
        assert keys_of(open_to_all, None) is None


ROSTER = Roster("final", {"ann": "red", "Łukasz": "blue"}, hosts=("pi",))


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> KeysFolder:
    folder = KeysFolder(tmp_path_factory.mktemp("keys") / "keys")
    folder.make(ROSTER.match, ROSTER.seats, datetime.now(UTC))
    return folder


@pytest.mark.parametrize("seat", [seat for seat in ROSTER.seats if seat.kind not in ("router", "host")], ids=str)
def test_every_seat_that_takes_part_stops_all_robots(keys: KeysFolder, tmp_path: Path, seat: Seat) -> None:
    keys.hand_out([Seat(SeatKind.HOST, "pi"), seat], tmp_path / "stick")
    assert [found.common_name for found in credentials_of(tmp_path / "stick", STOPPING)] == [seat.common_name]


def test_a_stop_is_an_officials_where_there_is_one_with_good_keys(keys: KeysFolder, tmp_path: Path) -> None:
    stick = tmp_path / "stick"
    keys.hand_out(ROSTER.seats, stick)
    first = credentials_of(stick, STOPPING)[0]
    assert first.common_name == "official"
    first.private_key.chmod(0o644)
    found = [each.common_name for each in credentials_of(stick, STOPPING)]
    assert found[0] != "official"
    assert found[-1] == "official"


def test_who_may_not_stop_or_release_is_told_so(keys: KeysFolder, tmp_path: Path) -> None:
    stick = tmp_path / "stick"
    keys.hand_out([Seat(SeatKind.HOST, "pi")], stick)
    with pytest.raises(CredentialsError, match=r"expected the keys of a seat that is one of official, commander, .*pi"):
        credentials_of(stick, STOPPING)
    keys.hand_out([Seat(SeatKind.PLAYER, "ann")], stick)
    done = invoke("estop", "--release", "m", "--router", "tls/127.0.0.1:1", "--keys", str(stick))
    assert done.exit_code == 1
    assert "m: " in done.output
    assert "expected the keys of the seat official, found those of host.pi, player.ann" in done.output


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


@contextmanager
def refereed(endpoint: str, credentials: Credentials | None = None) -> Iterator[None]:
    """Run match `m`; its referee, a thread here, reports whether an emergency stop is engaged. It is at first."""
    bus, ended = Keys("m"), threading.Event()
    state = synthetic.state(0.0, estop=True)

    def referee() -> None:
        with open_session(endpoint, credentials=credentials) as session:
            mailbox = Mailbox("coordinator/referee")
            stops, releases = mailbox.subscribe(bus.estop), mailbox.subscribe(bus.estop_release)
            session.attach(mailbox)
            mailbox.publish(bus.referee_state, state)
            while not ended.wait(0.01):
                session.send(mailbox.collect())
                session.receive()
                mailbox.handover(0.0)
                for inlet, estop in ((stops, True), (releases, False)):
                    if inlet.take():
                        mailbox.publish(bus.referee_state, structs.replace(state, estop=estop))

    thread = threading.Thread(target=referee)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def test_a_release_tells_whether_there_was_a_stop() -> None:
    endpoint = free_endpoint()
    with open_router(endpoint), refereed(endpoint):
        first, second = (invoke("estop", "--release", "m", "--router", endpoint) for _ in range(2))
    assert "m: released: continue with" in first.output
    assert "m: no emergency stop was engaged, so there was nothing to release" in second.output


@pytest.mark.parametrize(("typed", "variable"), [((), "keys/"), ((), "./keys"), (("--keys", "keys"), "")])
def test_keys_keep_no_emergency_stop_from_a_match_that_wants_none(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, keys: KeysFolder, typed: tuple[str, ...], variable: str
) -> None:
    monkeypatch.chdir(keys.path.parent)
    monkeypatch.setenv("VRG_KEYS", variable)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    endpoint = free_endpoint()
    with open_router(endpoint), refereed(endpoint):
        with registered(RunningMatch("m", endpoint, "x", os.getpid(), os.getcwd())):
            done = invoke("estop", *typed)
        assert done.output == "m: emergency stop engaged\n"
        if not typed:  # other commands refuse keys for such a match, unless they are those of the variable
            done = invoke("estop", "--release", "m", "--router", endpoint)
            assert "m: released" in done.output


def test_an_emergency_stop_tries_all_keys_that_it_finds_and_none(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, keys: KeysFolder
) -> None:
    others = KeysFolder(tmp_path / "others")
    others.make("others", Roster("others", {"eve": "red"}).seats, datetime.now(UTC))
    own = tmp_path / "own"
    keys.hand_out([Seat(SeatKind.OFFICIAL)], own)
    (own / "official" / PRIVATE_KEY).chmod(0o644)  # as on a stick that knows no users
    monkeypatch.setenv("VRG_KEYS", str(others.path))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    endpoint = free_endpoint().replace("tcp/", "tls/")
    with ExitStack() as stack:
        stack.enter_context(open_router(endpoint, credentials=find_credentials(keys.path, [Seat(SeatKind.ROUTER)])))
        stack.enter_context(refereed(endpoint, find_credentials(keys.path, [Seat(SeatKind.REFEREE)])))
        entry = RunningMatch("m", endpoint, "x", os.getpid(), os.getcwd(), str(tmp_path / "gone"))
        with registered(entry):
            unheard = invoke("estop")
            heard = invoke("estop", "--keys", str(own))
    assert unheard.exit_code == 1
    for said in ("m: the router has not received it", f"{tmp_path / 'gone'}: expected", "for another match"):
        assert said in unheard.output
    assert heard.output == "m: emergency stop engaged\n"
