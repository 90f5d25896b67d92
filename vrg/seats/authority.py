"""Certificates of the seats of one match, by an authority of the match's own. This module uses no clock and no files.

The certificates are X.509 version 3 (RFC 5280) with keys on the curve P-256. Only the router's serves as a server's, so
that no other seat can pose as the router. All serve as a client's, the router's too, because further routers
are clients of the router of the match.
"""

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from vrg.errors import ConfigError
from vrg.hosts import check_host
from vrg.seats.seat import LONGEST_COMMON_NAME, Seat, SeatKind

SLACK = timedelta(days=1)
"""The time that the wall clocks of two machines may differ: a certificate counts from so long before it was made."""
AUTHORITY_LASTS = timedelta(days=730)
"""The validity of an authority. Its seats last less and can be renewed."""


@dataclass(frozen=True)
class KeyPair:
    """A certificate and its private key.

    Args:
        certificate, private_key: both in PEM.
    """

    certificate: bytes
    private_key: bytes

    def __repr__(self) -> str:
        # A private key must not get into a log by way of an error's text.
        return "KeyPair(...)"


@dataclass(frozen=True)
class Validity:
    """The validity of a certificate, with its subject.

    Args:
        common_name: whom it is for. authority: the common name of the authority that has signed it.
        begins, ends: the instants between which it is valid, in UTC.
        hosts: the host names and IP addresses that it may serve under.
    """

    common_name: str
    authority: str
    begins: datetime
    ends: datetime
    hosts: tuple[str, ...]

    def is_over(self, now: datetime) -> bool:
        """True if it has expired at the instant `now`."""
        return now >= self.ends


def authority_name(match: str) -> str:
    """The common name of the authority of a match."""
    # The limit is one of bytes, of which a letter may have four.
    return f"VRG {match}".encode()[:LONGEST_COMMON_NAME].decode(errors="ignore")


def make_authority(match: str, now: datetime) -> KeyPair:
    """Make the authority of a match, whose certificate everybody of the match trusts.

    Args:
        match: the name of the match. now: the present instant, with its time zone.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name(authority_name(match))
    usage = x509.KeyUsage(
        digital_signature=False,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=True,
        crl_sign=True,
        encipher_only=False,
        decipher_only=False,
    )
    certificate = (
        _builder(name, name, key, now, AUTHORITY_LASTS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return _in_pem(certificate, key)


def make_seat(authority: KeyPair, seat: Seat, now: datetime, lasts: timedelta, hosts: Sequence[str] = ()) -> KeyPair:
    """Make the keys of a seat.

    Args:
        authority: the authority of the match. now: the present instant, with its time zone.
        lasts: how long the certificate is valid; never longer than the authority's own.
        hosts: the host names and IP addresses of the router; no other seat has any.

    Raises:
        ConfigError: the authority cannot be read, it has expired, or its key does not belong to it; or one of `hosts`
            is no host.
    """
    issuer, signer = _read_authority(authority)
    if now >= issuer.not_valid_after_utc:
        raise ConfigError(
            f"the authority has expired on {issuer.not_valid_after_utc:%Y-%m-%d}: make another one by "
            "`vrg keys init --replace`, and hand out all keys again"
        )
    serves = seat.kind is SeatKind.ROUTER
    key = ec.generate_private_key(ec.SECP256R1())
    # A further router is a client of the router of the match.
    usage = [ExtendedKeyUsageOID.SERVER_AUTH] if serves else []
    builder = (
        _builder(_name(seat.common_name), issuer.subject, key, now, min(lasts, issuer.not_valid_after_utc - now))
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([*usage, ExtendedKeyUsageOID.CLIENT_AUTH]), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(signer.public_key()), critical=False)
    )
    if serves:
        try:
            names = x509.SubjectAlternativeName([_host(check_host(host)) for host in dict.fromkeys(hosts)])
        except ValueError as error:
            raise ConfigError(f"an address of the router: {error}") from None
        builder = builder.add_extension(names, critical=False)
    return _in_pem(builder.sign(signer, hashes.SHA256()), key)


def validity(certificate: bytes) -> Validity:
    """The validity of a certificate in PEM.

    Raises:
        ValueError: it is no certificate.
    """
    read = x509.load_pem_x509_certificate(certificate)
    (name,) = read.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    try:
        listed = read.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        hosts = tuple(str(entry.value) for entry in listed)
    except x509.ExtensionNotFound:
        hosts = ()
    (issuer,) = read.issuer.get_attributes_for_oid(NameOID.COMMON_NAME)
    return Validity(str(name.value), str(issuer.value), read.not_valid_before_utc, read.not_valid_after_utc, hosts)


def fingerprint(certificate: str) -> str:
    """The SHA-256 fingerprint of a certificate in PEM, in pairs of hexadecimal digits with colons."""
    return x509.load_pem_x509_certificate(certificate.encode()).fingerprint(hashes.SHA256()).hex(":").upper()


def is_of(certificate: bytes, authority: bytes) -> bool:
    """True if a certificate was signed by an authority. Both are in PEM.

    Raises:
        ValueError: one of them is no certificate.
    """
    read, issuer = x509.load_pem_x509_certificate(certificate), x509.load_pem_x509_certificate(authority)
    try:
        read.verify_directly_issued_by(issuer)
    except (ValueError, TypeError, InvalidSignature):
        return False
    return True


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, now: datetime, lasts: timedelta
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - SLACK)
        .not_valid_after(now + lasts)
    )


def _read_authority(authority: KeyPair) -> tuple[x509.Certificate, ec.EllipticCurvePrivateKey]:
    try:
        certificate = x509.load_pem_x509_certificate(authority.certificate)
        key = serialization.load_pem_private_key(authority.private_key, password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise ConfigError(
            f"the authority's certificate or its private key cannot be read: {error}: take both from a copy, or "
            "make another authority with `vrg keys init --replace`"
        ) from None
    if not isinstance(key, ec.EllipticCurvePrivateKey) or key.public_key() != certificate.public_key():
        raise ConfigError("the authority's private key does not belong to its certificate: make both again")
    return certificate, key


def _in_pem(certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> KeyPair:
    return KeyPair(
        certificate.public_bytes(serialization.Encoding.PEM),
        key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()),
    )
