"""Certificates: whom they are for, how long they last, and whose they are."""

from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID
from hypothesis import example, given, settings

from tests.naming import names
from vrg.errors import ConfigError
from vrg.seats.authority import AUTHORITY_LASTS, SLACK, KeyPair, is_of, make_authority, make_seat, validity
from vrg.seats.seat import Roster, Seat, SeatKind

NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
LASTS = timedelta(days=30)
ANN = Seat(SeatKind.PLAYER, "ann")
AUTHORITY = make_authority("final", NOW)


def test_a_seats_certificate_names_it_and_lasts_as_long_as_asked() -> None:
    told = validity(make_seat(AUTHORITY, ANN, NOW, LASTS).certificate)
    assert told.common_name == "player.ann"
    assert (told.begins, told.ends) == (NOW - SLACK, NOW + LASTS)
    assert told.hosts == ()
    assert not told.is_over(NOW + LASTS - timedelta(seconds=1))
    assert told.is_over(NOW + LASTS)


def test_a_certificate_is_of_the_authority_that_has_signed_it() -> None:
    made = make_seat(AUTHORITY, ANN, NOW, LASTS)
    assert is_of(made.certificate, AUTHORITY.certificate)
    namesake = make_authority("final", NOW)
    assert not is_of(made.certificate, namesake.certificate)
    assert not is_of(make_seat(namesake, ANN, NOW, LASTS).certificate, AUTHORITY.certificate)


@pytest.mark.parametrize("seat", Roster("m", {"ann": "red"}, hosts=("pi",)).seats, ids=str)
def test_only_a_router_can_serve(seat: Seat) -> None:
    made = x509.load_pem_x509_certificate(make_seat(AUTHORITY, seat, NOW, LASTS, ["10.0.0.5"]).certificate)
    usage = made.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    serves = seat.kind is SeatKind.ROUTER
    assert (ExtendedKeyUsageOID.SERVER_AUTH in usage) == serves
    assert ExtendedKeyUsageOID.CLIENT_AUTH in usage, "a further router is a client of the router of the match"
    assert not made.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    assert made.signature_hash_algorithm is not None


def test_the_routers_certificate_names_its_hosts() -> None:
    hosts = ["localhost", "10.0.0.5", "::1", "arena.local", "localhost"]
    told = validity(make_seat(AUTHORITY, Seat(SeatKind.ROUTER), NOW, LASTS, hosts).certificate)
    assert told.hosts == ("localhost", "10.0.0.5", "::1", "arena.local")


def test_what_is_no_host_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"expected a host name or an IP address such as .*, got 'a/b'"):
        make_seat(AUTHORITY, Seat(SeatKind.ROUTER), NOW, LASTS, ["lab_2", "a/b"])


@pytest.mark.parametrize("torn", [b"", b"-----BEGIN EC PRIVATE KEY-----\n"])
def test_an_authority_that_cannot_be_read_is_told(torn: bytes) -> None:
    for authority in (KeyPair(torn, AUTHORITY.private_key), KeyPair(AUTHORITY.certificate, torn)):
        with pytest.raises(ConfigError, match="the authority's certificate or its private key cannot be read"):
            make_seat(authority, ANN, NOW, LASTS)


def test_no_seat_outlasts_its_authority() -> None:
    late = NOW + AUTHORITY_LASTS - timedelta(days=1)
    assert validity(make_seat(AUTHORITY, ANN, late, LASTS).certificate).ends == NOW + AUTHORITY_LASTS
    with pytest.raises(ConfigError, match="the authority has expired on 2028-02-29"):
        make_seat(AUTHORITY, ANN, NOW + AUTHORITY_LASTS, LASTS)


def test_an_authority_with_anothers_key_is_refused() -> None:
    mixed = KeyPair(AUTHORITY.certificate, make_authority("final", NOW).private_key)
    with pytest.raises(ConfigError, match="does not belong to its certificate"):
        make_seat(mixed, ANN, NOW, LASTS)


def test_a_private_key_is_not_in_a_log_by_accident() -> None:
    made = make_seat(AUTHORITY, ANN, NOW, LASTS)
    assert b"PRIVATE KEY" in made.private_key
    for text in (repr(made), str(made), f"{made!r}"):
        assert "PRIVATE" not in text


@settings(max_examples=15, deadline=None)
@given(names())
def test_a_player_of_any_name_gets_a_certificate(name: str) -> None:
    seat = Seat(SeatKind.PLAYER, name)
    assert validity(make_seat(AUTHORITY, seat, NOW, LASTS).certificate).common_name == seat.common_name


@settings(max_examples=5, deadline=None)
@given(names())
@example("0000" + 16 * "\N{FEMININE ORDINAL INDICATOR}" + 8 * "\N{LINEAR B SYLLABLE B008 A}")
def test_a_match_of_any_name_gets_an_authority(name: str) -> None:
    authority = make_authority(name, NOW)
    assert is_of(make_seat(authority, ANN, NOW, LASTS).certificate, authority.certificate)
