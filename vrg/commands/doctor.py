"""The command `vrg doctor`, which checks whether this machine has what VRG needs."""

import importlib
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, distributions, requires, version
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from packaging.requirements import Requirement

from vrg.bus.mailbox import Mailbox
from vrg.bus.process import PULSE_PERIOD
from vrg.bus.session import DEFAULT_ENDPOINT, open_router, open_session
from vrg.bus.topics import Keys
from vrg.commands.matches import credentials_for
from vrg.commands.options import JsonOption, no_window
from vrg.errors import VrgError
from vrg.hal.sim.compiled import kernel
from vrg.hal.sim.engines import BULLET, check_installed
from vrg.launch.endpoints import free_endpoint
from vrg.launch.running import running
from vrg.modules import silent_errors
from vrg.packages import Package, lacking, modules_of
from vrg.plugins import CHECKS, Finding, broken
from vrg.seats.seat import Seat, SeatKind


def _python() -> Finding:
    good = sys.version_info >= (3, 11)
    return Finding("python", good, platform.python_version() + ("" if good else ": expected 3.11 or later"))


def _packages() -> list[str]:
    """The names of the packages that VRG needs here: what players need, and all of them where it is whole."""
    asked = [Requirement(line) for line in requires("virtual-robotic-games-core") or ()]
    whole = any(distributions(name="virtual-robotic-games"))
    here = {"extra": "play" if whole else ""}
    return [one.name for one in asked if one.marker is None or one.marker.evaluate(here)]


def _package(name: str) -> Finding:
    try:
        found = version(name)
    except PackageNotFoundError:
        return Finding(name, False, "missing: run `make setup`")
    wrong = [why for module in modules_of(name) if (why := lacking(module, Package(name)))]
    return Finding(name, not wrong, "; ".join(wrong) or found)


def _bus() -> Finding:
    try:
        endpoint = free_endpoint()
        with open_router(endpoint), open_session(endpoint, patience=3.0) as session:
            good = session.connected
    except (VrgError, OSError) as error:
        return Finding("bus", False, str(error))
    where = "" if endpoint == DEFAULT_ENDPOINT else f" (the default {DEFAULT_ENDPOINT} is taken: another port is used)"
    return Finding("bus", good, f"a router and a client talk at {endpoint}{where}")


def _physics() -> Finding:
    try:
        check_installed(BULLET)
    except VrgError as error:
        return Finding("physics", None, f"{error}")
    try:
        with silent_errors():
            bullet = importlib.import_module("pybullet")
        client = bullet.connect(bullet.DIRECT)
        bullet.disconnect(physicsClientId=client)
    except (ImportError, RuntimeError) as error:
        return Finding("physics", False, str(error))
    return Finding("physics", True, "PyBullet starts")


def _kernel() -> Finding:
    slower = "not compiled, so matches take more time for the same results: see docs/install.md"
    return Finding("kernel", None, "that of the simulation is compiled" if kernel else slower)


def _display() -> Finding:
    shown = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY") or "none"
    why = no_window()
    return Finding("display", None, f"{shown}; matches are shown as a table in the terminal: {why}" if why else shown)


def _gamepads() -> Finding:
    if why := lacking("pygame"):
        return Finding("gamepads", None, why)
    from vrg.ui.window.pads import connected  # without it the window library is not loaded

    return Finding("gamepads", None, "; ".join(connected()) or "none")


def _can() -> Finding:
    # 280 is the kernel's ARPHRD_CAN.
    kinds = Path("/sys/class/net").glob("*/type")
    found = sorted(kind.parent.name for kind in kinds if kind.read_text().strip() == "280")
    return Finding("CAN", None, ", ".join(found) or "no interface: scripts/with-vcan runs a command with a virtual one")


def _sandbox() -> Finding:
    from vrg.launch.sandbox.seal import missing  # most commands seal nothing

    return Finding("sandbox", None, missing() or "players can be sandboxed")


def _matches() -> Finding:
    found = running()
    return Finding("matches", None, ", ".join(f"{m.match} at {m.router}" for m in found) or "none runs here")


def _added() -> Iterator[Finding]:
    """What the checks find that plug-ins add. One that fails harms no other."""
    for name in CHECKS.names():
        try:
            found = CHECKS.get(name)()
            if not isinstance(found, Finding):
                raise TypeError(f"expected a Finding, got {found!r}")
        except (Exception, SystemExit) as error:  # it is somebody else's code
            found = Finding(name, None, f"this check, which another package adds, has failed: {error}")
        yield found


def _plugins() -> Finding:
    if wrong := "; ".join(f"{name}: {why}" for name, why in broken()):
        wrong += "; to install what is missing, run `make setup` in a clone, or see docs/install.md"
    return Finding("plug-ins", None if wrong else True, wrong or "all installed ones can be used")


def _messages() -> Finding:
    """The number of messages that the running matches have refused, because they came under a wrong key."""
    found = []
    for match in running():
        mailbox, keys = Mailbox(), Keys(match.match)
        pulses = mailbox.subscribe(keys.pulse())
        try:
            credentials = credentials_for(match.router, None, Seat(SeatKind.OFFICIAL))
            with open_session(match.router, patience=3.0, credentials=credentials) as session:
                session.attach(mailbox)
                time.sleep(2 * PULSE_PERIOD)
                session.receive()
        except VrgError as error:
            found.append(f"{match.match}: {error}")
            continue
        mailbox.handover(0.0)
        refused = sum(pulse.body.refused for pulse in pulses.by_key.values())
        found.append(f"{match.match}: {refused} had a wrong key and were refused")
    return Finding("messages", None, "; ".join(found) or "no match runs here, so there are no messages to check")


def doctor(
    match: Annotated[
        Path | None, typer.Argument(metavar="[match.toml]", help="Check the machines that a match file names, too.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Check this machine: Python, packages, bus, physics, CAN, screen. Status 1 if something needed is missing."""
    checks: list[Callable[[], Finding]] = [
        _python,
        _bus,
        _physics,
        _kernel,
        _can,
        _display,
        _gamepads,
        _sandbox,
        _matches,
        _messages,
        _plugins,
    ]
    findings = {"": [*[_package(name) for name in _packages()], *[check() for check in checks], *_added()]}
    if match is not None:
        from vrg.commands.doctor_machines import examine_machines  # it loads what reaches other machines

        findings |= examine_machines(match)
    if as_json:
        everything = findings if match is not None else findings[""]
        typer.echo(msgspec.json.encode(everything).decode())
    else:
        marks = {True: "ok  ", False: "BAD ", None: "info"}
        for machine, found in findings.items():
            if machine:
                typer.echo(f"\n{machine}")
            for finding in found:
                typer.echo(f"{marks[finding.good]}  {finding.what:<14} {finding.text}")
    if any(finding.good is False for found in findings.values() for finding in found):
        raise typer.Exit(1)
