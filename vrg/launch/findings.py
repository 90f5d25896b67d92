"""The results of checks of a machine on which processes of a match are to run."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec

from vrg.config.files import HERE
from vrg.config.setup import MatchSetup
from vrg.launch.sandbox.seal import missing
from vrg.localisation.source import read_source
from vrg.plugins import Finding

_COMMAND_TIMEOUT = 120.0
"""The real time in s for one of the commands below, which load everything that VRG has."""


def examine(setup: MatchSetup, match_file: Path, machine: str) -> list[Finding]:
    """Check whether processes of a match can run on this machine. Nothing of the match is started.

    Args:
        match_file: the match file on this machine. machine: the name of this machine in it.
    """
    found = [finding for finding in _doctor() if finding.good is False or finding.what in ("python", "physics")]
    said = _run("check", str(match_file))
    good = said.returncode == 0
    text = _last_lines(said.stdout if good else said.stderr).replace(f"{match_file}", match_file.name)
    found.append(Finding("match", good, text))
    here = [player.name for player in setup.players if setup.place.get(player.name, HERE) == machine]
    seats = setup.has_seats
    sealed = [name for name in here if setup.sandboxed(name, seats=seats) and (seats or setup.sandbox)]
    if sealed:
        lacking = missing()
        found.append(Finding("sandbox", lacking is None, lacking or f"can be sandboxed: {', '.join(sealed)}"))
    for backend, settings, users in setup.backend_settings():
        robots = [name for name in users if name in here]
        if robots:
            lacks = settings.missing_here(robots)
            found += [Finding(backend, False, text) for text in lacks]
            if not lacks:
                found.append(Finding(backend, True, f"everything for {', '.join(robots)} is there"))
    for name, table in setup.localisation.items():
        if setup.place.get(name, HERE) == machine:
            kind, own = read_source(table)
            lacks = kind.missing_here(own, Path(setup.base))
            found += [Finding(name, False, text) for text in lacks] or [Finding(name, True, "the source can be used")]
    return found


def _doctor() -> Sequence[Finding]:
    done = _run("doctor", "--json")
    try:
        return msgspec.json.decode(done.stdout, type=list[Finding])
    except msgspec.DecodeError:
        return [Finding("doctor", False, f"vrg doctor has failed: {_last_lines(done.stderr)}")]


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "vrg", *arguments]
    try:
        return subprocess.run(
            command, capture_output=True, text=True, timeout=_COMMAND_TIMEOUT, check=False, stdin=subprocess.DEVNULL
        )
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 1, "", f"it did not finish within {_COMMAND_TIMEOUT:g} s")


def _last_lines(text: str) -> str:
    return "; ".join(text.strip().splitlines()[-5:])
