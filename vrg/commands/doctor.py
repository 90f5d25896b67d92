"""The command `vrg doctor`, which checks whether this machine has what VRG needs."""

import importlib
import json
import os
import platform
import re
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.session import DEFAULT_ENDPOINT, open_router, open_session
from vrg.errors import VrgError
from vrg.launch.local import free_endpoint
from vrg.launch.running import running


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    Args:
        what: the name of what was checked. text: the result in words.
        good: True or False for what VRG needs; None for what is only good to know.
    """

    what: str
    good: bool | None
    text: str


def _python() -> Finding:
    good = sys.version_info[:2] == (3, 11)
    advice = "" if good else "; PyBullet has wheels for 3.11 and no later: make the environment with python3.11"
    return Finding("python", good, platform.python_version() + advice)


def _packages() -> list[str]:
    """The names of the packages that VRG always needs, as its own package declares them."""
    always = [line for line in requires("vrg") or () if "extra ==" not in line]
    return [re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in always]


def _package(name: str) -> Finding:
    try:
        return Finding(name, True, version(name))
    except PackageNotFoundError:
        return Finding(name, False, "missing: run `make setup`")


def _bus() -> Finding:
    try:
        endpoint = free_endpoint()
        with open_router(endpoint), open_session(endpoint, patience=3.0) as session:
            good = session.connected
    except (VrgError, OSError) as error:
        return Finding("bus", False, str(error))
    where = "" if endpoint == DEFAULT_ENDPOINT else f" (the default {DEFAULT_ENDPOINT} is taken, another port is used)"
    return Finding("bus", good, f"a router and a client talk at {endpoint}{where}")


def _physics() -> Finding:
    try:
        bullet = importlib.import_module("pybullet")
        client = bullet.connect(bullet.DIRECT)
        bullet.disconnect(physicsClientId=client)
    except (ImportError, RuntimeError) as error:
        return Finding("physics", False, str(error))
    return Finding("physics", True, "PyBullet starts")


def _display() -> Finding:
    shown = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    table = "matches are shown as a table in the terminal"
    if not shown:
        return Finding("display", None, f"none: {table}")
    from vrg.ui.spectator import display_available  # without a display the window library is not loaded

    dead = "" if display_available() else f" is set, but no screen answers there: {table}"
    return Finding("display", None, f"{shown}{dead}")


def _can() -> Finding:
    # 280 is the kernel's ARPHRD_CAN.
    kinds = Path("/sys/class/net").glob("*/type")
    found = sorted(kind.parent.name for kind in kinds if kind.read_text().strip() == "280")
    return Finding("CAN", None, ", ".join(found) or "no interface: scripts/with-vcan gives a command a virtual one")


def _matches() -> Finding:
    found = running()
    return Finding("matches", None, ", ".join(f"{m.match} at {m.router}" for m in found) or "none runs here")


def doctor(as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")] = False) -> None:
    """Check this machine: Python, packages, bus, physics, CAN, display. Status 1 if something needed is missing."""
    checks: list[Callable[[], Finding]] = [_python, _bus, _physics, _can, _display, _matches]
    findings = [*[_package(name) for name in _packages()], *[check() for check in checks]]
    if as_json:
        typer.echo(json.dumps([asdict(f) for f in findings]))
    else:
        marks = {True: "ok  ", False: "BAD ", None: "info"}
        for finding in findings:
            typer.echo(f"{marks[finding.good]}  {finding.what:<14} {finding.text}")
    if any(f.good is False for f in findings):
        raise typer.Exit(1)
