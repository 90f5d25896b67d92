"""A process that the supervisor has started: `python -P -m vrg.launch.child JOB`.

It does the same as `vrg node world`, `vrg node player` and so on, but it reads the set-up that the launcher has checked
already, and it does not load the command line. In most cases it is forked from the fork server and needs no new
interpreter. So twelve processes start in about the time of one.
"""

import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

import msgspec
from msgspec import Struct

from vrg.blame import failure_of
from vrg.config.setup import read_setup
from vrg.errors import HangError, LaunchError, StrategyError, VrgError
from vrg.kinds import KINDS, PLAYER, ROUTER, WEB
from vrg.launch import ending
from vrg.launch.ending import LEASH
from vrg.launch.folder_lock import delete_abandoned_keys
from vrg.launch.serving import serve, serve_router
from vrg.runs.run_folder import RunFolder
from vrg.types import printable

FAILED_FOR_GOOD, HUNG = 3, 4
"""The exit status of a player whose strategy has failed in a way that makes another start useless, or hangs."""


class Job(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The job of a child.

    Args:
        kind: the name of one of `vrg.kinds`. router: the endpoint of the router. run: the run folder.
        name: the name of a player or of a window.
        strategy: of a player, in place of the one in the match file.
        keys: the folder of the keys of the match's seats; None in a match without them.
        upstream: the endpoint of the router that a further router is linked to.
    """

    kind: str
    router: str
    run: str
    name: str = ""
    strategy: str = ""
    keys: str | None = None
    upstream: str | None = None

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments of the child, for `main`."""
        return (msgspec.json.encode(self).decode(),)

    @property
    def title(self) -> str:
        """The title of the child in a list of processes."""
        return f"vrg {self.kind}{f' {self.name}' if self.name else ''} in {Path(self.run).name}"


def job_of(arguments: Sequence[str]) -> Job:
    """Return the job of a child from its arguments."""
    return msgspec.json.decode(arguments[0], type=Job)


def main(arguments: Sequence[str]) -> int:
    """Run as the child, and return the exit status of the process."""
    from setproctitle import setproctitle  # noqa: PLC0415 - the fork server, which imports this, keeps its name

    job = job_of(arguments)
    setproctitle(job.title)
    folder, keys = RunFolder(Path(job.run)), None if job.keys is None else Path(job.keys)
    try:
        kind = KINDS.get(job.kind)
        if kind is ROUTER:
            routed = None if keys is None else read_setup(folder.setup)
            stop = serve_router(job.router, upstream=job.upstream, setup=routed, keys=keys, leash=True)
        else:
            setup = read_setup(folder.setup_of(job.name) if kind is PLAYER else folder.setup)
            if job.strategy:
                setup = setup.substituted(job.name, job.strategy)
            secret = read_secret() if kind is WEB else ""
            stop = serve(
                kind, setup, router=job.router, run=folder.path, name=job.name, keys=keys, leash=True, secret=secret
            )
    except VrgError as error:
        print(f"vrg: {printable(str(error), lines=True)}", file=sys.stderr)
        ending.tell(error, str(error), name=job.name)
        if isinstance(error, HangError):
            return HUNG
        return FAILED_FOR_GOOD if isinstance(error, StrategyError) and error.final else 1
    except KeyboardInterrupt:
        return 130
    except Exception as error:  # of the rules of any game, or the driver of any robot: the log has the whole of it
        traceback.print_exception(error)
        why = str(failure_of(error))
        print(f"vrg: {why}", file=sys.stderr)
        ending.tell(error, why, name=job.name)
        return 1
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
