"""The process of an author that is a program: it gives up what the policy does not allow, and becomes the program."""

import os
import resource
import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec

from vrg.launch.sandbox import landlock
from vrg.launch.sandbox.policy import Access, Policy
from vrg.launch.sandbox.seal import FILE_SIZE, NICENESS, OPEN_FILES, drop_capabilities

_Packed = tuple[list[tuple[str, int]], list[int], int]


def packed(policy: Policy) -> str:
    """The files, the ports and the memory of a policy, as a text."""
    files = [(str(path), access.value) for path, access in policy.files]
    return msgspec.json.encode((files, policy.ports, policy.memory)).decode()


def main(arguments: Sequence[str]) -> int:
    """Seal this process, and run a command in its place.

    Unlike a strategy it may start programs, so no system calls are filtered, and Landlock knows of TCP alone.

    Args:
        arguments: a policy, see `packed`, and the command.
    """
    files, ports, memory = msgspec.json.decode(arguments[0], type=_Packed)
    limits = {
        resource.RLIMIT_DATA: memory * 1_000_000, resource.RLIMIT_FSIZE: FILE_SIZE,
        resource.RLIMIT_NOFILE: OPEN_FILES, resource.RLIMIT_CORE: 0,
    }  # fmt: skip
    for limit, value in limits.items():
        resource.setrlimit(limit, (value, value))
    os.nice(NICENESS)
    drop_capabilities()
    landlock.restrict([(Path(path), Access(value)) for path, value in files], ports)
    try:
        os.execvp(arguments[1], list(arguments[1:]))
    except OSError as error:
        sys.stderr.write(f"{arguments[1]}: cannot be run: {error.strerror}\n")
        return 127


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
