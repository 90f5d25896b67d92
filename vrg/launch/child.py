"""A process that the supervisor has started: `python -P -m vrg.launch.child KIND ...`.

It does the same as `vrg world`, `vrg player` and so on, but it reads the set-up that the launcher has checked already,
and it does not load the command line. In most cases it is forked from the fork server and needs no new interpreter. So
twelve processes start in about the time of one.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from vrg.config.setup import read_setup
from vrg.errors import StrategyError, VrgError
from vrg.launch.run_folder import RunFolder
from vrg.launch.serving import serve, serve_router

FAILED_FOR_GOOD = 3
"""The exit status of a player whose strategy has failed in a way that makes another start useless."""


def arguments_of(
    kind: str, *, router: str, run: Path | None = None, name: str = "", strategy: str = ""
) -> tuple[str, ...]:
    """Return the arguments of a child, for `main`.

    Args:
        kind: `router`, or one of `vrg.launch.serving.KINDS`. router: the endpoint of the router.
        run: the run folder; the router needs none. name: the name of a player or of a window.
        strategy: of a player, in place of the one in the match file.
    """
    words = (kind, router)
    return words if run is None else (*words, str(run), *(word for word in (name, strategy) if word))


def title(arguments: Sequence[str]) -> str:
    """Return the title of a child in a list of processes."""
    kind, _, *rest = arguments
    run = f" in {Path(rest[0]).name}" if rest else ""
    return f"vrg {kind}{f' {rest[1]}' if len(rest) > 1 else ''}{run}"


def main(arguments: Sequence[str]) -> int:
    """Run as the child, and return the exit status of the process."""
    from setproctitle import setproctitle  # noqa: PLC0415 - the fork server, which imports this, keeps its name

    setproctitle(title(arguments))
    kind, router, *rest = arguments
    try:
        if kind == "router":
            stop = serve_router(router, leash=True)
        else:
            run = Path(rest[0])
            setup = read_setup(RunFolder(run).setup)
            if len(rest) > 2:
                setup = setup.substituted(rest[1], rest[2])
            stop = serve(kind, setup, router=router, run=run, name=rest[1] if len(rest) > 1 else "", leash=True)
    except VrgError as error:
        print(f"vrg: {error}", file=sys.stderr)
        return FAILED_FOR_GOOD if isinstance(error, StrategyError) and error.final else 1
    except KeyboardInterrupt:
        return 130
    return 130 if stop.interrupted else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
