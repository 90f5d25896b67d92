"""The folder in which the keys of a match are kept, and how they get there and on to other machines.

keys/authority/   ca.crt, ca.key               stays with the person who makes the keys
keys/<seat>/      seat.crt, seat.key, ca.crt   is all that the machine of this seat needs
"""

import errno
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from vrg.errors import ConfigError
from vrg.files import read_bytes, write_whole
from vrg.seats.authority import KeyPair, Validity, authority_name, is_of, make_authority, make_seat, validity
from vrg.seats.credentials import AUTHORITY, CERTIFICATE, PRIVATE_KEY, Credentials
from vrg.seats.seat import Seat, SeatKind

LASTS = timedelta(days=30)
"""The validity of the keys of a seat, unless something else is asked for."""
LOCAL_HOSTS = ("localhost", "127.0.0.1", "::1")
"""The names of a router on its own machine."""
_AUTHORITY_KEY = "ca.key"
_AUTHORITY_FOLDER = "authority"


@dataclass(frozen=True)
class SeatKeys:
    """The keys of a seat, as they are found in a folder.

    Args:
        credentials: its files. validity: what its certificate tells.
        genuine: True if the authority of all seats of the folder has signed it. That is the one whose key is in the
            folder, or else the router's; where neither is, each certificate is compared with the one beside it.
    """

    credentials: Credentials
    validity: Validity
    genuine: bool


@dataclass(frozen=True)
class KeysFolder:
    """The folder at `path`, which need not exist yet."""

    path: Path

    @property
    def has_authority(self) -> bool:
        """True if the authority's own key is here, without which no keys can be made."""
        return (self.path / _AUTHORITY_FOLDER / _AUTHORITY_KEY).is_file()

    @property
    def has_keys(self) -> bool:
        """True if the keys of an authority or of any seat are here."""
        return self.has_authority or bool(list(self.path.glob(f"*/{PRIVATE_KEY}")))

    def make(
        self,
        match: str,
        seats: Sequence[Seat],
        now: datetime,
        *,
        lasts: timedelta = LASTS,
        hosts: Sequence[str] = LOCAL_HOSTS,
        keep_authority: bool = True,
    ) -> None:
        """Make an authority, and the keys of all seats. The keys that the folder had before are removed.

        Args:
            match: the name of the match. seats: its seats. now: the present instant, with its time zone.
            lasts: how long the seats' certificates are valid. hosts: the names and addresses of the router's machine.
            keep_authority: False forgets the authority's key, so that no further keys can ever be made.

        Raises:
            ConfigError: the folder cannot be written.
        """
        authority = make_authority(match, now)
        with _writing(self.path):
            self.path.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._remove_keys()
            if keep_authority:
                folder = self.path / _AUTHORITY_FOLDER
                _private_folder(folder)
                write_whole(folder / _AUTHORITY_KEY, authority.private_key, 0o600)
                write_whole(folder / AUTHORITY, authority.certificate, 0o600)
            self._make_seats(authority, seats, now, lasts, hosts)

    def renew(
        self,
        match: str,
        seats: Sequence[Seat],
        now: datetime,
        *,
        lasts: timedelta = LASTS,
        hosts: Sequence[str] = (),
    ) -> None:
        """Make new keys for all seats, those that are new in the match too, by the authority that is here.

        Args:
            match: the name of the match. seats: its seats.
            hosts: names and addresses of the router's machine, besides those of its present certificate.

        Raises:
            ConfigError: the authority's key is not here, it cannot be read, it is of another match, it has expired, or
                the folder cannot be written.
        """
        folder = self.path / _AUTHORITY_FOLDER
        try:
            authority = KeyPair(read_bytes(folder / AUTHORITY), read_bytes(folder / _AUTHORITY_KEY))
        except OSError as error:
            raise ConfigError(
                f"{folder}: expected the authority: {error.strerror}: renew keys where they were made"
            ) from None
        self.check_match(match)
        reached_by = tuple(dict.fromkeys([*self._hosts(), *hosts]))
        with _writing(self.path):
            self._make_seats(authority, seats, now, lasts, reached_by or LOCAL_HOSTS)

    def check_match(self, match: str) -> None:
        """Check that the keys are those of a match. Where no certificate tells the authority, nothing is checked.

        Raises:
            ConfigError: they are of another match, or the authority's certificate cannot be read.
        """
        folder, certificate = self.path / _AUTHORITY_FOLDER, self._common_authority()
        if certificate is None:
            return
        try:
            found, wanted = validity(certificate).common_name, authority_name(match)
        except ValueError as error:
            raise ConfigError(
                f"{folder / AUTHORITY}: expected a certificate: {error}: take the authority from a copy, or make "
                "another one with `vrg keys init --replace`"
            ) from None
        if found != wanted:
            raise ConfigError(
                f"{folder}: expected the authority of the match {match} ({wanted}), found {found}: name "
                "the folder of the keys of this match with --keys, or make keys for it in another folder"
            )

    def _hosts(self) -> tuple[str, ...]:
        """The hosts of the router's present certificate; none if there is no certificate."""
        with suppress(OSError, ValueError):
            return validity(read_bytes(self.path / SeatKind.ROUTER / CERTIFICATE)).hosts
        return ()

    def entries(self) -> list[SeatKeys]:
        """The keys of the seats that are here, in the order of their names.

        Raises:
            ConfigError: the folder cannot be read, or a file in it is no certificate.
        """
        try:
            folders = sorted(path for path in self.path.iterdir() if (path / CERTIFICATE).is_file())
        except OSError as error:
            raise ConfigError(
                f"{self.path}: expected a folder of keys: {error.strerror}: make one with `vrg keys init`"
            ) from None
        common, found = self._common_authority(), []
        for folder in folders:
            try:
                certificate, beside = read_bytes(folder / CERTIFICATE), read_bytes(folder / AUTHORITY)
                # A seat whose own copy is another one would not trust the router.
                genuine = is_of(certificate, beside) and is_of(certificate, common or beside)
                found.append(SeatKeys(Credentials(folder, folder.name), validity(certificate), genuine))
            except (OSError, ValueError) as error:
                raise ConfigError(f"{folder}: expected the keys of a seat: {error}") from None
        return found

    def _common_authority(self) -> bytes | None:
        """The certificate of the authority of all seats that are here; None if nothing tells which it is."""
        for folder in (_AUTHORITY_FOLDER, SeatKind.ROUTER):
            with suppress(OSError):
                return read_bytes(self.path / folder / AUTHORITY)
        return None

    @property
    def page(self) -> Path:
        """The file of the tokens of the page, for links that are printed before the match."""
        return self.path / "page.json"

    @property
    def sheet(self) -> Path:
        """The file of these links for the printer."""
        return self.path / "sheet.html"

    def hand_out(self, seats: Iterable[Seat], to: Path) -> list[Path]:
        """Copy the folders of some seats, and nothing else, to a folder that goes to another machine.

        Args:
            to: the folder of keys on the other machine, or one that is copied there; it is made if it is missing.

        Returns:
            the copies.

        Raises:
            ConfigError: a seat has no keys here, or `to` cannot be written.
        """
        wanted, made = list(seats), []
        lacking = [str(seat) for seat in wanted if not (self.path / seat.common_name / PRIVATE_KEY).is_file()]
        if lacking:
            there = ", ".join(sorted(path.parent.name for path in self.path.glob(f"*/{PRIVATE_KEY}"))) or "none"
            found = f"expected the keys of {', '.join(lacking)}, found those of {there}"
            raise ConfigError(f"{self.path}: {found}; `vrg keys renew` makes those of a seat that is new in the match")
        with _writing(to):
            to.mkdir(mode=0o700, parents=True, exist_ok=True)
            for seat in wanted:
                source, target = self.path / seat.common_name, to / seat.common_name
                _private_folder(target)
                for name in (CERTIFICATE, PRIVATE_KEY, AUTHORITY):
                    write_whole(target / name, read_bytes(source / name), 0o600)
                made.append(target)
        return made

    def remove(self) -> None:
        """Remove the folder with everything in it, if it is there."""
        with suppress(FileNotFoundError):
            shutil.rmtree(self.path)

    def _remove_keys(self) -> None:
        """Remove the keys of the authority and of all seats, and nothing else that may be in the folder."""
        self.page.unlink(missing_ok=True)
        self.sheet.unlink(missing_ok=True)
        seats = {path.parent for name in (CERTIFICATE, PRIVATE_KEY) for path in self.path.glob(f"*/{name}")}
        for folder in (self.path / _AUTHORITY_FOLDER, *seats):
            for name in (_AUTHORITY_KEY, PRIVATE_KEY, CERTIFICATE, AUTHORITY):
                (folder / name).unlink(missing_ok=True)
            # It stays if something else is in it.
            with suppress(OSError):
                folder.rmdir()

    def _make_seats(
        self, authority: KeyPair, seats: Sequence[Seat], now: datetime, lasts: timedelta, hosts: Sequence[str]
    ) -> None:
        for seat in seats:
            made = make_seat(authority, seat, now, lasts, hosts)
            folder = self.path / seat.common_name
            _private_folder(folder)
            write_whole(folder / PRIVATE_KEY, made.private_key, 0o600)
            write_whole(folder / CERTIFICATE, made.certificate, 0o600)
            write_whole(folder / AUTHORITY, authority.certificate, 0o600)


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Turn an error of the file system into one that tells what to do."""
    try:
        yield
    except OSError as error:
        raise ConfigError(f"{path}: keys cannot be written: {error.strerror}: choose another folder") from None


def _private_folder(path: Path) -> None:
    """Make a folder that only its owner can look into. One that is there already may be others' too, and stays so."""
    if path.is_symlink():
        raise OSError(errno.ELOOP, f"expected a folder, found a link at {path.name}", str(path))
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
