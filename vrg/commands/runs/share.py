"""The command `vrg run share`, which writes a match as one file that any browser shows."""

from pathlib import Path
from typing import Annotated

import typer

from vrg.commands.matches import ended_run, need_shown
from vrg.commands.options import RunArgument, echo
from vrg.errors import LaunchError
from vrg.files import write_whole


def share(
    run: RunArgument = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file; the default is share.html in the run folder.")
    ] = None,
) -> None:
    """Write a match as one file of HTML, with the field, a time bar, and the calls with their reasons.

    Browsers show it without a network and without VRG: from a disk, from a mail, or on any web site. `#t=83.2` after
    the address opens it at that match time.
    """
    from vrg.playing.sharing import shared_run

    folder, setup = ended_run(run)
    need_shown(folder)
    file = output or folder.path / "share.html"
    page = shared_run(folder, setup).encode()
    try:
        write_whole(file, page)
    except OSError as error:
        raise LaunchError(f"{file}: cannot be written: {error.strerror}") from None
    echo(f"Written to {file}: {len(page) / 1000:.0f} kB.")
