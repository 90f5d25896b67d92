"""Objects that are found by name: games, strategies, robot models, sensors, maps, engines, backends, motor protocols.

A registry is a table of names. The names that come with VRG are listed as `module:attribute`, and each is imported only
when it is asked for. Any other package adds a name by an entry point of the registry's group, without a change here:

    [project.entry-points."vrg.games"]
    capture = "my_package.capture:GAME"
"""

import importlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from vrg.errors import ConfigError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")


class Registry(Generic[T]):
    """One table of names.

    Args:
        what: the word for one of its objects in messages, such as `game`.
        group: the group of the entry points of other packages, such as `vrg.games`. An entry point cannot replace a
            name that comes with VRG.
        built_in: the `module:attribute` of each name that comes with VRG.
        check: returns the reason why an object cannot be in this table, or None if it can.
        besides: what else may be named in place of one of its names, in words; empty for nothing.
    """

    def __init__(
        self,
        what: str,
        group: str,
        built_in: Mapping[str, str],
        check: Callable[[Any], str | None] = lambda _: None,
        besides: str = "",
    ) -> None:
        self.what = what
        self.group = group
        self._built_in = dict(built_in)
        self._check = check
        self._besides = besides
        self._found: dict[str, T] = {}
        self._unusable: set[str] = set()

    def names(self) -> list[str]:
        """All names, sorted, including those whose object cannot be imported."""
        return sorted({*self._built_in, *self._plugins()})

    def __contains__(self, name: str) -> bool:
        return name in self._built_in or name in self._plugins()

    def get(self, name: str) -> T:
        """Return the object of this name.

        Raises:
            ConfigError: there is no such name, its object cannot be imported, or `check` refuses it.
        """
        if name not in self._found:
            self._found[name] = self._load(name)
        return self._found[name]

    def find(self, name: str) -> T | None:
        """Return the object of this name for code that only shows it, or None if there is none that can be used."""
        if name not in self._unusable:
            try:
                return self.get(name)
            except ConfigError:
                # Such code asks again and again; a package that cannot be imported must not be tried each time.
                self._unusable.add(name)
        return None

    def unknown(self, name: str) -> str:
        """The message about a name that is not in the table, beginning with what the table holds; see `expected`."""
        return f"{self.what}: {self.expected(name)}"

    def expected(self, name: str) -> str:
        """The names that were expected in place of this one, with a guess at the one that was meant."""
        wanted = installed_by(self.group, name)
        words = expected_one_of(self.names(), name) if wanted is None else f"got {name!r}, which {wanted}"
        return words + (f"; or {self._besides}" if self._besides and wanted is None else "")

    def known(self, name: str) -> str:
        """Return the name if it is in the table.

        Raises:
            ValueError: it is not; the message is that of `expected`.
        """
        if name not in self:
            raise ValueError(self.expected(name))
        return name

    def _load(self, name: str) -> T:
        target = self._built_in.get(name)
        plugin = self._plugins().get(name) if target is None else None
        failed = f"{self.what} {name}: cannot import"
        if target is not None:
            found = loaded(target, f"{self.what} {name}")
        elif plugin is not None:
            found = imported(plugin.load, f"{failed} {plugin.value} of the entry point group {self.group}")
        else:
            raise ConfigError([self.unknown(name)])
        why = self._check(found)
        if why is not None:
            raise ConfigError(f"{self.what} {name}: {why}, got {found!r}")
        return found  # type: ignore[no-any-return]

    def _plugins(self) -> "Mapping[str, EntryPoint]":
        return plugins(self.group)


def offered(group: str) -> Mapping[str, str]:
    """The packages of VRG's plug-ins that add something to a group, by the name of what they add.

    Args:
        group: of entry points; or a command, such as `vrg play`, for its options.
    """
    return _offered().get(group, {})


@cache
def _offered() -> Mapping[str, Mapping[str, str]]:
    import tomllib  # noqa: PLC0415 - only who asks for what is missing needs it
    from importlib.resources import files  # noqa: PLC0415 - as above

    found: Mapping[str, Mapping[str, str]] = tomllib.loads((files("vrg") / "offered.toml").read_text(encoding="utf-8"))
    return found


def installed_by(group: str, name: str) -> str | None:
    """How to get what a plug-in of VRG adds to a group, as the end of a sentence; None where none adds this name."""
    package = offered(group).get(name)
    if package is None:
        return None
    entries = (entry for group in added().values() for entry in group.values())
    if any(entry.dist is not None and entry.dist.name == package for entry in entries):
        return f"the package {package} adds: it is installed, but cannot be imported; `vrg doctor` may say why"
    return f"the package {package} adds: run `make setup` in a clone, or `pip install {package}`"


def subclass_of(base: type) -> Callable[[object], str | None]:
    """The check of a registry of classes: each is a subclass of `base`."""
    words = f"expected a subclass of {base.__module__}.{base.__qualname__}"
    return lambda found: None if isinstance(found, type) and issubclass(found, base) else words


def expected_one_of(names: Sequence[str], name: str) -> str:
    """The names that were expected in place of `name`, with a guess at the one that was meant."""
    return f"expected one of {', '.join(names)}, got {name!r}{did_you_mean(name, names)}"


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """The end of a message about a name that is not known: a guess at the one that was meant, or nothing."""
    meant = close_to(name, names)
    return f", did you mean {meant!r}?" if meant else ""


def close_to(name: str, names: Iterable[str]) -> str | None:
    """The known name that is spelled most like this one; None if none is."""
    import difflib  # noqa: PLC0415 - only a mistake needs it

    by_folded = {known.casefold(): known for known in reversed([*names])}
    close = difflib.get_close_matches(name.casefold(), by_folded, n=1)
    return by_folded[close[0]] if close else None


@cache
def added() -> "Mapping[str, Mapping[str, EntryPoint]]":
    """What other packages add to VRG, by group and name. Looked up once, as that reads every package's metadata."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow to load

    found = entry_points()
    of_vrg = [group for group in sorted(found.groups) if group.startswith("vrg.")]
    return {group: {entry.name: entry for entry in found.select(group=group)} for group in of_vrg}


def plugins(group: str) -> "Mapping[str, EntryPoint]":
    """The entry points of a group by name."""
    return added().get(group, {})


@cache
def plugin_packages() -> frozenset[str]:
    """The names of the packages that add something to VRG, whether or not they are imported."""
    entries = [entry for group in added().values() for entry in group.values()]
    return frozenset(entry.value.partition(":")[0].partition(".")[0].strip() for entry in entries)


def imported(load: Callable[[], Any], failed: str) -> Any:
    """Return what is loaded. A plug-in may raise any exception while it is imported, which is no fault of VRG.

    Args:
        failed: the beginning of the message if it cannot be loaded; the reason follows.

    Raises:
        ConfigError: it cannot be loaded.
    """
    try:
        return load()
    except ConfigError:
        raise
    except (Exception, SystemExit) as error:
        raise ConfigError(f"{failed}: {error!r}") from error


def loaded(target: str, what: str) -> Any:
    """Return the object that `module:attribute` names, for which another package may stand.

    Args:
        what: the word for it, at the beginning of the message if it cannot be imported.

    Raises:
        ConfigError: it cannot be imported.
    """
    return imported(partial(load_object, target), f"{what}: cannot import {target}")


def load_object(target: str) -> Any:
    """Import and return the object that `module:attribute` names.

    Raises:
        ImportError, AttributeError: there is no such object.
        Exception: whatever the module raises while it is imported.
    """
    module, _, attribute = target.partition(":")
    return getattr(importlib.import_module(module), attribute)
