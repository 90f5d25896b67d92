"""The program that listens to a capture system, and writes its frames to the standard output.

It is a process of its own, because the library waits for a system without an end, and lets no other thread of its
process run while it connects. An alarm of the operating system ends the process when nothing comes, which no thread of
Python could. It knows nothing of the match.
"""

import faulthandler
import os
import signal
import socket
import sys
import time
from typing import IO

import motioncapture
import msgspec

from vrg.system import POSIX
from vrg_locate.mocap.frames import MeasuredBody, MocapFrame, Request, Trouble, encode
from vrg_locate.stream import Pace


def main() -> None:
    """Write the frames of the system that the first argument asks for, until nothing comes or nobody reads."""
    request = msgspec.json.decode(sys.argv[1], type=Request)
    # The match ends this process; what is typed at the terminal is for the match.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if POSIX:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0) as out:
        # The library prints.
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        try:
            _listen(request, out)
        except BrokenPipeError:
            pass
        except (OSError, RuntimeError) as error:
            out.write(encode(Trouble(str(error))))


def _listen(request: Request, out: IO[bytes]) -> None:
    _end_after(request.patience)
    options = dict(request.options)
    if request.system == "optitrack":
        # Of this system alone the library wants the address, and takes no name.
        options["hostname"] = socket.gethostbyname(options["hostname"])
    system, pace = motioncapture.connect(request.system, options), Pace(request.rate)
    while True:
        system.waitForNextFrame()
        now = time.monotonic()
        _end_after(request.patience)
        seen = system.rigidBodies
        bodies = [_body(name, body) for name, body in seen.items() if pace.takes(name, now)]
        # It also reports that it sees no body.
        if bodies or (not seen and pace.takes(None, now)):
            out.write(encode(MocapFrame(now, bodies)))


def _end_after(patience: float) -> None:
    """Let this process be ended in this many seconds of real time, unless this is called again before."""
    if POSIX:
        signal.setitimer(signal.ITIMER_REAL, patience)
    else:
        faulthandler.dump_traceback_later(patience, exit=True)


def _body(name: str, body: motioncapture.RigidBody) -> MeasuredBody:
    turn = body.rotation
    x, y, z = map(float, body.position)
    return MeasuredBody(name, (x, y, z), (float(turn.w), float(turn.x), float(turn.y), float(turn.z)))


if __name__ == "__main__":
    main()
