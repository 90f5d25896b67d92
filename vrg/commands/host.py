"""The command `vrg host`, which the launcher starts on another machine by ssh."""

import os
import sys

import platformdirs

from vrg.launch.remote.agent import Agent
from vrg.launch.remote.channel import Channel
from vrg.launch.remote.wire import Frames, ToAgent
from vrg.launch.serving import child_process


def host() -> None:
    """Supervise processes of a match on this machine; `vrg play` starts it by ssh on the machines of a match."""
    if sys.stdin.isatty():
        raise SystemExit("vrg host is started by `vrg play` on the machines that a match file names")
    # What is printed by mistake goes to the log, and not between the frames.
    reader, writer = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    frames: Frames[ToAgent] = Frames(ToAgent)  # type: ignore[arg-type]  # a union is no class
    home = platformdirs.user_state_path("vrg") / "hosted"
    with child_process(leash=False) as stop:
        Agent(Channel(reader, writer, frames), home, stop).run()
