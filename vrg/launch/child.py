"""A process that the supervisor has started: `python -P -m vrg.launch.child KIND ...`.

It does the same as `vrg world`, `vrg player` and so on, but it reads the set-up that the launcher has checked already,
and it does not load the command line. In most cases it is forked from the fork server and needs no new interpreter. So
twelve processes start in about the time of one.
"""

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from vrg.config.setup import read_setup
from vrg.errors import LaunchError, StrategyError, VrgError
from vrg.launch.folder_lock import delete_abandoned_keys
from vrg.launch.run_folder import RunFolder
from vrg.launch.serving import serve, serve_router
from vrg.types import printable

FAILED_FOR_GOOD = 3
"""The exit status of a player whose strategy has failed in a way that makes another start useless."""

LEASH = 0
"""The descriptor of the standard input, which the supervisor holds as a leash."""

_KEYS, _UPSTREAM = "--keys=", "--upstream="
"""What arguments begin with that name the folder of keys and the router upstream. They are the last arguments."""


def arguments_of(
    kind: str,
    *,
    router: str,
    run: Path | None = None,
    name: str = "",
    strategy: str = "",
    keys: Path | None = None,
    upstream: str | None = None,
) -> tuple[str, ...]:
    """Return the arguments of a child, for `main`.

    Args:
        kind: `router`, or one of `vrg.launch.serving.KINDS`. router: the endpoint of the router.
        run: the run folder; a router without keys needs none. name: the name of a player or of a window.
        strategy: of a player, in place of the one in the match file.
        keys: the folder of the keys of the match's seats; None in a match without them.
        upstream: the endpoint of the router that a further router is linked to.
    """
    words = (kind, router) if run is None else (kind, router, str(run), *(word for word in (name, strategy) if word))
    options = {_KEYS: keys, _UPSTREAM: upstream}
    return (*words, *(f"{option}{value}" for option, value in options.items() if value is not None))


def split_options(arguments: Sequence[str]) -> tuple[list[str], Path | None, str | None]:
    """Split the arguments of a child into those in the order above, the folder of keys, and the router upstream."""
    found = {_KEYS: "", _UPSTREAM: ""}
    words = list(arguments)
    while option := next((option for option in found if words[-1].startswith(option)), None):
        found[option] = words.pop().removeprefix(option)
    return words, Path(found[_KEYS]) if found[_KEYS] else None, found[_UPSTREAM] or None


def title(arguments: Sequence[str]) -> str:
    """Return the title of a child in a list of processes."""
    kind, _, *rest = split_options(arguments)[0]
    run = f" in {Path(rest[0]).name}" if rest else ""
    return f"vrg {kind}{f' {rest[1]}' if len(rest) > 1 else ''}{run}"


def main(arguments: Sequence[str]) -> int:
    """Run as the child, and return the exit status of the process."""
    from setproctitle import setproctitle  # noqa: PLC0415 - the fork server, which imports this, keeps its name

    setproctitle(title(arguments))
    (kind, router, *rest), keys, upstream = split_options(arguments)
    try:
        if kind == "router":
            setup = None if keys is None else read_setup(RunFolder(Path(rest[0])).setup)
            stop = serve_router(router, upstream=upstream, setup=setup, keys=keys, leash=True)
        else:
            run = Path(rest[0])
            folder = RunFolder(run)
            setup = read_setup(folder.setup_of(rest[1]) if kind == "player" else folder.setup)
            if len(rest) > 2:
                setup = setup.substituted(rest[1], rest[2])
            name, secret = rest[1] if len(rest) > 1 else "", read_secret() if kind == "web" else ""
            stop = serve(kind, setup, router=router, run=run, name=name, keys=keys, leash=True, secret=secret)
    except VrgError as error:
        print(f"vrg: {printable(str(error), lines=True)}", file=sys.stderr)
        return FAILED_FOR_GOOD if isinstance(error, StrategyError) and error.final else 1
    except KeyboardInterrupt:
        return 130
    finally:
        if keys is not None:
            delete_abandoned_keys([keys])  # if the launcher was killed
    return 130 if stop.interrupted else 0


def read_secret() -> str:
    """The line that the supervisor has written to this process's standard input.

    Raises:
        LaunchError: there is none.
    """
    # The leash is read by its descriptor, too: no more than the line may be taken from it.
    line = bytearray()
    while not line.endswith(b"\n"):
        byte = os.read(LEASH, 1)
        if not byte:
            raise LaunchError("expected a line on standard input, found its end: the supervisor is gone")
        line += byte
    return line.decode().rstrip("\n")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
