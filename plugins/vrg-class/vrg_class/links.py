"""Where the pages of a day are reached: address, name, encryption, and the links that are handed out."""

import secrets
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final, NamedTuple

import typer
from rich.console import Console

from vrg.commands.options import port_at, web_address
from vrg.commands.page import encrypted, reached_at, remark_on
from vrg.errors import ConfigError
from vrg.files import read_text, write_whole
from vrg.hosts import check_host, netloc
from vrg.seats.authority import fingerprint
from vrg.ui.web.admission import TOKEN_BYTES, Admission, read_admission

PAGE_FILE: Final = "page.json"
"""The file with the officials' token and the certificate, which stay the same when a command is started again."""

NameOption = Annotated[
    str | None,
    typer.Option(
        "--name", metavar="HOST[:PORT]", help="Host for links in place of this computer's addresses, such as its name."
    ),
]


class Served(NamedTuple):
    """Where pages are served.

    Args:
        page: address, certificate, and the token of those who decide. name: as in links; empty for the addresses.
        port: that of the name in links.
    """

    page: Admission
    name: str = ""
    port: int = 0

    def bases(self) -> list[tuple[str, str]]:
        """The addresses of the top page, each with what is to be said of it; empty for nothing."""
        scheme = "https" if self.page.certificate else "http"
        if self.name:
            return [(f"{scheme}://{netloc(self.name, self.port)}/", "")]
        return [
            (f"{scheme}://{netloc(address, self.page.port)}/", remark_on(address))
            for address in reached_at(self.page.host)
        ]

    def show(self, links: Iterable[tuple[str, str]], console: Console) -> None:
        """Print links: for whom each is, and what follows the address of the top page."""
        links = list(links)
        width = max(len(who) for who, _ in links)
        for base, remark in self.bases():
            for who, rest in links:
                words = f"{who:<{width}}  {base}{rest}{remark and f'  ({remark})'}"
                console.print(words, soft_wrap=True, markup=False)
        if self.page.certificate:
            words = "browsers warn that they do not know the certificate: continue if its SHA-256 fingerprint is"
            console.print(f"{words} {fingerprint(self.page.certificate)}", soft_wrap=True)


def served_at(folder: Path, listen: str | None, usual: int, what: str, *, tls: bool, name: str | None) -> Served:
    """Choose where pages are served; the token and the certificate are those that the folder has, or new ones.

    Args:
        folder: of the day, which exists. listen: the address that was typed. usual: the port, if it is free.
        what: is served, in words. tls: True serves it by https. name: as it was typed for links.

    Raises:
        typer.BadParameter: the address or the name is none.
        ConfigError: what the folder has cannot be read or written. LaunchError: the port is not free.
    """
    host, port = web_address(listen)
    named, named_port = web_address(name) if name else ("", None)
    try:
        named = check_host(named) if named else ""
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--name") from None
    page = Admission(host, port_at(host, port, usual, what))
    file = folder / PAGE_FILE
    try:
        if file.exists():
            kept = read_admission(read_text(file))
            page = replace(kept, host=page.host, port=page.port)
        page = replace(page, official=page.official or secrets.token_urlsafe(TOKEN_BYTES))
        page = encrypted(page, named) if tls else page
        write_whole(file, page.encoded().encode(), 0o600, synced=True)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{file}: cannot be used: {error}: remove it, and the links will change") from None
    page = page if tls else replace(page, certificate="", private_key="")
    return Served(page, named, named_port or page.port)
