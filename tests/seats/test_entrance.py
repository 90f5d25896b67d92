"""Who passes at the entrance of a router with seats, and how strangers are kept from holding others up."""

import asyncio
import select
import socket
import ssl
import struct
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import pytest

from tests.bus.bench import free, wait
from vrg.bus import entrance as subject
from vrg.bus.configuration import MAX_MESSAGE_SIZE
from vrg.bus.entrance import _Hall, begins_handshake, entrance
from vrg.bus.session import open_router, open_session
from vrg.bus.stopping import stop_on_signals
from vrg.hosts import host_of, port_of
from vrg.seats.credentials import find_credentials
from vrg.seats.folder import KeysFolder
from vrg.seats.seat import Roster, Seat, SeatKind

ANN, ROUTER = Seat(SeatKind.PLAYER, "ann"), Seat(SeatKind.ROUTER)
DEADLINE = 10.0


@cache
def hello() -> bytes:
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    sent = ssl.MemoryBIO()
    with pytest.raises(ssl.SSLWantReadError):
        context.wrap_bio(ssl.MemoryBIO(), sent).do_handshake()
    return sent.read()


def come(endpoint: str, address: str = "127.0.0.1") -> socket.socket:
    return socket.create_connection((host_of(endpoint), int(port_of(endpoint))), DEADLINE, (address, 0))


def is_closed(connection: socket.socket) -> bool:
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


@contextmanager
def passages() -> Iterator[Callable[..., tuple[socket.socket, socket.socket]]]:
    """Make passages through an entrance: the end of who has come, and that at the listener behind it."""
    with socket.create_server(("127.0.0.1", 0)) as door, ExitStack() as stack:
        endpoint = free("tls")
        stack.enter_context(entrance(endpoint, [f"tls/127.0.0.1:{door.getsockname()[1]}"]))()
        door.settimeout(DEADLINE)

        def pass_through(address: str = "127.0.0.1") -> tuple[socket.socket, socket.socket]:
            guest = stack.enter_context(come(endpoint, address))
            guest.sendall(hello())
            inside = stack.enter_context(door.accept()[0])
            inside.settimeout(DEADLINE)
            return guest, inside

        yield pass_through


@contextmanager
def passage() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Both ends of one passage."""
    with passages() as pass_through:
        yield pass_through()


def test_a_handshake_is_known_by_its_whole_first_message() -> None:
    whole = hello()
    assert begins_handshake(whole) is True
    assert begins_handshake(whole + b"more") is True
    assert {begins_handshake(whole[:length]) for length in range(len(whole))} == {None}


@pytest.mark.parametrize(
    "rubbish",
    [
        b"GET / HTTP/1.1\r\n",
        b"\x16\x02\x00",
        b"\x15\x03\x03\x00\x02",
        b"\x16\x03\x01\x00\x00\x01",
        b"\x16\x03\x01\xff\xff\x01",
        b"\x16\x03\x01\x01\x00\x02",
    ],
    ids=["a web page", "an older protocol", "an alert", "an empty message", "too long", "begins with another message"],
)
def test_what_begins_no_handshake_is_known_at_once(rubbish: bytes) -> None:
    assert begins_handshake(rubbish) is False


def test_bytes_pass_both_ways_and_the_last_before_the_end_too() -> None:
    with passage() as (guest, inside):
        assert begins_handshake(inside.recv(2**15)) is True
        guest.sendall(b"question")
        assert inside.recv(100) == b"question"
        inside.sendall(b"answer")
        inside.close()
        assert guest.recv(100) == b"answer"
        assert is_closed(guest)


def test_the_router_learns_at_once_that_somebody_is_gone() -> None:
    with passage() as (guest, inside):
        inside.recv(2**15)
        guest.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        guest.close()
        assert is_closed(inside)


def test_who_does_not_read_is_sent_no_more_in_the_end() -> None:
    with passage() as (_guest, inside):
        inside.settimeout(0.5)
        with pytest.raises(TimeoutError):
            inside.sendall(bytes(2**27))


def test_who_does_not_begin_a_handshake_is_sent_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "HANDSHAKE_TIMEOUT", 0.1)
    with passage() as (silent, _inside):
        assert is_closed(silent)


def test_of_too_many_who_wait_the_oldest_of_the_largest_crowd_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "MAX_HANDSHAKES", 3)
    with passage() as (oldest, _inside), ExitStack() as stack:
        endpoint = "tls/{}:{}".format(*oldest.getpeername())
        alone = stack.enter_context(socket.create_connection(oldest.getpeername(), DEADLINE, ("127.0.0.2", 0)))
        first = stack.enter_context(come(endpoint))
        others = [stack.enter_context(come(endpoint)) for _ in range(2)]
        assert is_closed(oldest)
        assert is_closed(first)
        assert select.select([alone, *others], [], [], 0)[0] == []


def test_one_address_does_not_take_all_places(monkeypatch: pytest.MonkeyPatch) -> None:
    def let_in(guest: socket.socket, inside: socket.socket) -> bool:
        inside.recv(2**15)
        for _ in range(3):
            inside.sendall(b"!")
            if is_closed(guest):
                return False
            guest.sendall(b"on")
            inside.recv(2)
        return True

    monkeypatch.setattr(subject, "MAX_CONNECTIONS", 2)
    with passages() as pass_through:
        first, second = pass_through(), pass_through()
        assert let_in(*first)
        assert let_in(*second)
        assert not let_in(*pass_through())
        assert let_in(*pass_through("127.0.0.2"))
        second[0].close()
        assert is_closed(second[1])
        assert let_in(*pass_through())


def test_a_router_whose_entrance_fails_ends_so_that_another_one_is_started() -> None:
    with closing(asyncio.new_event_loop()) as loop, stop_on_signals() as stop, socket.create_server(("", 0)) as taken:
        taken.close()
        with pytest.raises(OSError, match="Bad file descriptor"):
            _Hall(loop, []).serve(taken)
        assert stop.is_set()


def test_strangers_do_not_keep_a_seat_out(tmp_path: Path) -> None:
    folder = KeysFolder(tmp_path / "keys")
    folder.make("final", Roster("final", {"ann": "red"}).seats, datetime.now(UTC))
    endpoint = free("tls")
    with ExitStack() as stack:
        stack.enter_context(open_router(endpoint, credentials=find_credentials(folder.path, [ROUTER])))
        for sent in (b"", b"rubbish", hello()) * 100:
            with come(endpoint) as stranger:
                stranger.sendall(sent)
        with open_session(endpoint, credentials=find_credentials(folder.path, [ANN]), patience=1.0) as session:
            assert session.connected


def test_a_picture_of_a_camera_passes_the_entrance_on_its_way_in_and_out(tmp_path: Path) -> None:
    """It is sent in many parts, of which none may wait for long: buffers that are too small keep all from passing."""
    folder = KeysFolder(tmp_path / "keys")
    folder.make("final", Roster("final", {"ann": "red"}).seats, datetime.now(UTC))
    endpoint, key, picture = free("tls"), "vrg/final/picture", bytes(MAX_MESSAGE_SIZE // 2)
    with ExitStack() as stack:
        stack.enter_context(open_router(endpoint, credentials=find_credentials(folder.path, [ROUTER])))
        ann = find_credentials(folder.path, [ANN])
        camera, player = (
            stack.enter_context(open_session(endpoint, credentials=ann, shared_memory=False)) for _ in range(2)
        )
        take = player.collect_raw(key, 1)
        wait(lambda: camera.put_raw(key, picture, b"") or take() == [(key, picture)], "a picture")  # type: ignore[func-returns-value]
