"""The files by which a process proves its seat to the router, and the router its own to everybody."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from vrg.errors import CredentialsError
from vrg.files import write_whole
from vrg.seats.seat import Seat, SeatKind

CERTIFICATE, PRIVATE_KEY, AUTHORITY = "seat.crt", "seat.key", "ca.crt"
"""The names of the files in the folder of a seat."""


@dataclass(frozen=True)
class Credentials:
    """The folder of one seat's keys. It holds the seat's certificate and private key, and the authority's certificate.

    Args:
        folder: the folder. common_name: the common name of the seat.
    """

    folder: Path
    common_name: str

    @property
    def certificate(self) -> Path:
        """The certificate of the seat."""
        return self.folder / CERTIFICATE

    @property
    def private_key(self) -> Path:
        """The private key of the seat."""
        return self.folder / PRIVATE_KEY

    @property
    def authority(self) -> Path:
        """The certificate of the authority, by which the others are known."""
        return self.folder / AUTHORITY

    def check(self) -> None:
        """Check that the files are there, and that no other user can read the private key.

        Raises:
            CredentialsError: they are not, or others can.
        """
        for path in (self.certificate, self.private_key, self.authority):
            try:
                path.open("rb").close()
            except OSError as error:
                raise CredentialsError(
                    f"{path}: expected a file of the seat {self.common_name}: {error.strerror}: copy the whole folder "
                    "of the seat, or make keys with `vrg keys init`"
                ) from None
        mode = self.private_key.stat().st_mode
        if mode & 0o077:
            raise CredentialsError(
                f"{self.private_key}: others on this machine can read this private key (mode {mode & 0o777:o}): "
                f"run `chmod 600 {self.private_key}`, and renew it if another user may have read it"
            )


def keep_key(keys: Path, seat: str, name: str, data: bytes) -> None:
    """Write a file of a seat's keys that was received from elsewhere, so that only its owner can read it.

    Args:
        keys: a folder of keys. seat: the common name of the seat. name: one of the three names above.

    Raises:
        CredentialsError: it is no such file. OSError: it cannot be written.
    """
    if name not in (CERTIFICATE, PRIVATE_KEY, AUTHORITY) or not seat or "/" in seat or seat.startswith("."):
        raise CredentialsError(f"expected a file of the keys of a seat, got {seat}/{name}")
    folder = keys / seat
    folder.mkdir(mode=0o700, exist_ok=True)
    write_whole(folder / name, data, 0o600)


def find_credentials(keys: Path, seats: Sequence[Seat]) -> Credentials:
    """The credentials of the first of some seats that a folder of keys has.

    Args:
        keys: a folder that holds one folder for each seat. seats: the seats that will do, the preferred one first.

    Raises:
        CredentialsError: it has none of them, or their files are not as they should be.
    """
    for seat in seats:
        folder = keys / seat.common_name
        if folder.is_dir():
            found = Credentials(folder, seat.common_name)
            found.check()
            return found
    raise _missing(keys, f"the seat {' or '.join(map(str, seats))}")


def is_official(credentials: Credentials | None) -> bool:
    """True for the seat of the official, and where the router wants no seats: its process may decide and drive."""
    return credentials is None or credentials.common_name == Seat(SeatKind.OFFICIAL).common_name


def credentials_of(keys: Path, kinds: Sequence[SeatKind]) -> list[Credentials]:
    """The credentials of all seats of some kinds, whatever their names are, that a folder of keys has.

    Those whose files are not as they should be come last: an emergency stop may try them anyway.

    Args:
        keys: a folder that holds one folder for each seat. kinds: the kinds that will do, the preferred one first.

    Raises:
        CredentialsError: it has none of them.
    """

    def is_bad(found: Credentials) -> bool:
        try:
            found.check()
        except CredentialsError:
            return True
        return False

    there = _folders(keys)
    names = [name for kind in kinds for name in there if name.partition(".")[0] == kind]
    if not names:
        raise _missing(keys, f"a seat that is one of {', '.join(kinds)}")
    return sorted((Credentials(keys / name, name) for name in names), key=is_bad)


def _missing(keys: Path, wanted: str) -> CredentialsError:
    if not keys.is_dir():
        return CredentialsError(f"{keys}: expected the folder of the keys, found none")
    there = ", ".join(_folders(keys)) or "none"
    return CredentialsError(
        f"{keys}: expected the keys of {wanted}, found those of {there}: ask the person who made the keys "
        "for the folder of this seat"
    )


def _folders(keys: Path) -> Iterable[str]:
    try:
        return sorted(path.name for path in keys.iterdir() if (path / CERTIFICATE).is_file())
    except OSError:
        return []
