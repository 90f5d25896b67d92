"""A process that the supervisor has started: `python -P -m vrg.launch.child KIND ...`.

Mostly the fork server becomes one, without a new interpreter. It does what `vrg world`, `vrg player` and so on do by hand, but reads the set-up that the launcher has checked already,
and loads no command line. So twelve of them start in the time of one.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from vrg.config.setup import read_setup
from vrg.errors import VrgError
from vrg.launch.run_folder import RunFolder
from vrg.launch.serving import serve, serve_router


def arguments_of(kind: str, *, router: str, run: Path | None = None, name: str = "") -> tuple[str, ...]:
    """The arguments of a child."""
    words = (kind, router)
    return words if run is None else (*words, str(run), *((name,) if name else ()))


def title(arguments: Sequence[str]) -> str:
    """What a list of processes shows of a child."""
    kind, _, *rest = arguments
    run = f" in {Path(rest[0]).name}" if rest else ""
    return f"vrg {kind}{f' {rest[1]}' if len(rest) > 1 else ''}{run}"


def main(arguments: Sequence[str]) -> int:
    """Be the child; the exit status of the process."""
    kind, router, *rest = arguments
    try:
        if kind == "router":
            stop = serve_router(router, leash=True)
        else:
            run = Path(rest[0])
            setup = read_setup(RunFolder(run).setup)
            stop = serve(kind, setup, router=router, run=run, name=rest[1] if len(rest) > 1 else "", leash=True)
    except VrgError as error:
        print(f"vrg: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 130 if stop.interrupted else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
