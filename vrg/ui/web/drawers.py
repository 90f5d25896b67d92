"""The drawers that other packages add to the page of a match, for officials: tables beside the field.

[project.entry-points."vrg.drawers"]
details = "my_package:DRAWER"
"""

import logging
from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any, Final, Protocol

from vrg.errors import ConfigError
from vrg.plugins import Option
from vrg.registry import Registry, imported, load_object
from vrg.ui.scene import Scene

log = logging.getLogger(__name__)

SCRIPT: Final = "drawer.js"
"""The file of a drawer's program: it exports a class `Drawer`, as static/drawers.js says."""


class Content(Protocol):
    """What a drawer shows of a match, made in the process of the page."""

    def take(self, now: float) -> None:
        """Take in what has arrived by match time `now`, s. It is called at each tick while the drawer is open."""

    def close(self) -> None:
        """Listen no more: nobody has the drawer open. Idempotent."""

    def part(self, now: float, scene: Scene, player: str) -> Any:
        """Return what the drawer shows at match time `now`, s, as plain data.

        Args:
            player: the one of the match that is selected; empty for none.
        """


@dataclass(frozen=True)
class Drawer:
    """A drawer. The module that holds it is a light one: every page imports it.

    Args:
        title: of its button. package: the package whose folder `static` has its files, SCRIPT among them.
        makes: the `module:function` that makes its Content for the `vrg.launch.context.NodeContext` of the page.
        option: of `vrg play`, which serves the page with a link of the official's that opens it.
    """

    title: str
    package: str
    makes: str
    option: Option | None = None

    @property
    def folder(self) -> Traversable:
        """The folder of its files, which the page serves to everybody."""
        return files(self.package) / "static"

    def content(self, on: Any) -> Content:
        """Make its content for the context `on` of the page's node.

        Raises:
            ConfigError: it cannot be made, or its package has no script for it.
        """
        folder: Traversable = imported(lambda: self.folder, f"cannot find the package {self.package}")
        if not (folder / SCRIPT).is_file():
            raise ConfigError(f"expected {SCRIPT} in the folder static of {self.package}")
        made: Content = imported(lambda: load_object(self.makes)(on), f"cannot make what it shows by {self.makes}")
        return made


def _check(found: object) -> str | None:
    able = isinstance(found, Drawer) and isinstance(found.option, Option | None)
    return None if able else "expected a vrg.ui.web.drawers.Drawer, whose option is an Option or None"


DRAWERS: Final[Registry[Drawer]] = Registry("drawer", "vrg.drawers", {}, _check)
"""Every drawer by name."""


def contents(on: Any) -> dict[str, Content]:
    """The contents of all drawers by name, for the context of the page's node. One that cannot be made is left out."""
    made = {}
    for name in DRAWERS.names():
        try:
            made[name] = DRAWERS.get(name).content(on)
        except ConfigError as error:
            log.warning("the page has no drawer %s: %s", name, error)
    return made
