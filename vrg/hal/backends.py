"""Robot backends by name, imported when they are asked for; other packages may add theirs.

A package adds one with an entry point in the group `vrg.backends`, whose name is the backend's and whose object is a
subclass of Robot that is constructed from one RobotContext.
"""

import difflib
import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Pose
from vrg.bus.topics import Keys
from vrg.errors import ConfigError
from vrg.hal.models import RobotModel
from vrg.hal.robot import Robot
from vrg.hal.settings import BackendSettings

GROUP = "vrg.backends"

_BUILT_IN = {"sim": "vrg.hal.sim.robot:SimRobot", "can": "vrg.hal.can.robot:CanRobot"}


@dataclass(frozen=True, kw_only=True)
class RobotContext:
    """What a backend is constructed from.

    Args:
        name: the robot's in the match. model: its description.
        keys: of the match. mailbox: of the player's node; a backend subscribes and publishes through it.
        start: where the robot stands when it is connected. base: folder that relative paths start from.
        options: the backend's own table in the match file.
    """

    name: str
    model: RobotModel
    keys: Keys
    mailbox: Mailbox
    start: Pose = field(default_factory=lambda: Pose(0.0, 0.0, 0.0))
    base: Path = Path()
    options: Mapping[str, Any] = field(default_factory=dict)


def backend_names() -> list[str]:
    """The backends that can be asked for, whether or not they can be imported."""
    return sorted({*_BUILT_IN, *_plugins()})


def open_robot(backend: str, context: RobotContext) -> Robot:
    """Construct a robot of a backend; it is not connected yet.

    Raises:
        ConfigError: no backend has this name, or it cannot be imported; says why.
    """
    return _factory(backend)(context)


def settings_type(backend: str) -> type[BackendSettings] | None:
    """What checks a backend's own table in a match file; None where it takes none.

    Raises:
        ConfigError: no backend has this name, or it cannot be imported.
    """
    return getattr(_factory(backend), "settings", None)


def _factory(backend: str) -> Callable[[RobotContext], Robot]:
    target = _BUILT_IN.get(backend)
    plugin = _plugins().get(backend)
    try:
        if target is not None:
            module, _, attribute = target.partition(":")
            return getattr(importlib.import_module(module), attribute)  # type: ignore[no-any-return]
        if plugin is not None:
            return plugin.load()  # type: ignore[no-any-return]
    # A plugin may raise anything while it is imported; that must not look like a fault of vrg.
    except Exception as error:
        where = target or f"{plugin.value} of the entry point group {GROUP}"  # type: ignore[union-attr]
        raise ConfigError([f"backend {backend}: cannot import {where}: {error!r}"]) from error
    names = backend_names()
    close = difflib.get_close_matches(backend, names, n=1)
    guess = f", did you mean {close[0]!r}?" if close else ""
    raise ConfigError([f"backend: expected one of {', '.join(names)}, got {backend!r}{guess}"])


def _plugins() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}
