"""Who gets in at a router that wants keys, and what those are told who do not."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from tests.bus.bench import free
from vrg.bus.configuration import client_settings, router_settings
from vrg.bus.session import open_router, open_session
from vrg.errors import BusError, CredentialsError
from vrg.seats.authority import SLACK
from vrg.seats.credentials import Credentials, find_credentials
from vrg.seats.folder import KeysFolder
from vrg.seats.handshake import refusal
from vrg.seats.seat import Roster, Seat, SeatKind

ROSTER = Roster("final", {"ann": "red"})
ANN, ROUTER = Seat(SeatKind.PLAYER, "ann"), Seat(SeatKind.ROUTER)
DAY = timedelta(days=1)


def keys(folder: Path) -> KeysFolder:
    found = KeysFolder(folder)
    found.make("final", ROSTER.seats, datetime.now(UTC))
    return found


@pytest.fixture
def renewed(folder: KeysFolder, tmp_path: Path) -> KeysFolder:
    """One without seats, of the same authority."""
    found = KeysFolder(tmp_path / "renewed")
    found.path.mkdir()
    (found.path / "authority").symlink_to(folder.path / "authority")
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> KeysFolder:
    return keys(tmp_path_factory.mktemp("keys") / "good")


@pytest.fixture(scope="module")
def ann(folder: KeysFolder) -> Credentials:
    return find_credentials(folder.path, [ANN])


@pytest.fixture(scope="module")
def endpoint(folder: KeysFolder) -> Iterator[str]:
    found = free("tls")
    with open_router(found, credentials=find_credentials(folder.path, [ROUTER])):
        yield found


def refused(endpoint: str, credentials: Credentials) -> str:
    with pytest.raises(CredentialsError) as told, open_session(endpoint, credentials=credentials, patience=20.0):
        pass
    return str(told.value)


def test_a_seat_with_good_keys_gets_in(endpoint: str, ann: Credentials) -> None:
    assert refusal(endpoint, ann) is None
    with open_session(endpoint, credentials=ann) as session:
        assert session.connected


def test_a_stranger_is_told_that_its_keys_are_of_another_match_and_is_refused_by_the_router_if_it_is_not(
    endpoint: str, ann: Credentials, tmp_path: Path
) -> None:
    stranger = find_credentials(keys(tmp_path / "other").path, [ANN])
    told = refused(endpoint, stranger)
    assert "of another authority: these keys are for another match" in told
    assert "player.ann" in told
    stranger.authority.write_bytes(ann.authority.read_bytes())
    assert "the router does not know the authority of this seat" in refused(endpoint, stranger)


def test_a_seat_that_has_expired_or_is_not_valid_yet_is_told_what_to_do(endpoint: str, renewed: KeysFolder) -> None:
    renewed.renew("final", [ANN], datetime.now(UTC) - 2 * DAY, lasts=DAY)
    told = refused(endpoint, find_credentials(renewed.path, [ANN]))
    assert "the certificate of this seat has expired" in told
    assert "renew the keys by `vrg keys renew`" in told
    renewed.renew("final", [ANN], datetime.now(UTC) + SLACK + DAY)
    assert "or the clock of the router's machine is wrong" in refused(endpoint, find_credentials(renewed.path, [ANN]))


@pytest.mark.parametrize(
    ("began", "how", "said"),
    [
        (-2 * DAY, {"lasts": DAY}, "the router's certificate has expired"),
        (0 * DAY, {"hosts": ["10.0.0.5"]}, "certificate is for other addresses"),
    ],
    ids=["expired", "of another address"],
)
def test_a_router_whose_certificate_is_not_good_is_not_trusted(
    renewed: KeysFolder, ann: Credentials, began: timedelta, how: dict[str, Any], said: str
) -> None:
    renewed.renew("final", [ROUTER], datetime.now(UTC) + began, **how)
    endpoint = free("tls")
    with open_router(endpoint, credentials=find_credentials(renewed.path, [ROUTER])):
        assert said in refused(endpoint, ann)


def test_a_player_cannot_pose_as_the_router(ann: Credentials, folder: KeysFolder) -> None:
    endpoint = free("tls")
    with open_router(endpoint, credentials=ann):
        official = find_credentials(folder.path, [Seat(SeatKind.OFFICIAL)])
        assert "do not accept each other" in refused(endpoint, official)


@pytest.mark.thorough  # zenoh gives up after ten seconds
def test_a_router_without_keys_is_none_for_a_seat(ann: Credentials) -> None:
    endpoint = free("tls")
    with (
        open_router(endpoint.replace("tls/", "tcp/")),
        pytest.raises(BusError, match="expected a router with seats"),
        open_session(endpoint, credentials=ann, patience=0.1),
    ):
        pass


def test_where_nobody_answers_it_is_tried_again_and_then_told(ann: Credentials) -> None:
    with (
        pytest.raises(BusError, match=r"but none answered in 0\.3 s") as told,
        open_session(free("tls"), credentials=ann, patience=0.3),
    ):
        pass
    assert not isinstance(told.value, CredentialsError)


def test_keys_and_endpoint_must_fit_each_other(ann: Credentials) -> None:
    with pytest.raises(BusError, match="name the folder of the keys with --keys"), open_session("tls/127.0.0.1:1"):
        pass
    with (
        pytest.raises(BusError, match="expected an endpoint that begins with tls/"),
        open_session("tcp/127.0.0.1:1", credentials=ann),
    ):
        pass


def test_a_broken_key_is_told(endpoint: str, folder: KeysFolder, tmp_path: Path) -> None:
    folder.hand_out([ANN], tmp_path / "broken")
    broken = find_credentials(tmp_path / "broken", [ANN])
    broken.private_key.write_text("nothing")
    assert "cannot be read" in refused(endpoint, broken)


def test_the_router_demands_a_certificate_and_each_side_has_its_own_files(ann: Credentials) -> None:
    router = router_settings(["tls/0.0.0.0:7447"], ann, {"enabled": True})
    tls = router["transport"]["link"]["tls"]
    assert tls["enable_mtls"] is True
    assert tls["listen_private_key"].endswith("player.ann/seat.key")
    assert router["access_control"] == {"enabled": True}
    client = client_settings("tls/127.0.0.1:7447", ann)
    assert client["transport"]["link"]["tls"]["connect_certificate"].endswith("player.ann/seat.crt")
    assert client["transport"]["link"]["protocols"] == ["tls"]
    assert "tls" not in client_settings("tcp/127.0.0.1:7447")["transport"]["link"]
