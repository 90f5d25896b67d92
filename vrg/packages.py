"""Packages of others of which VRG imports a module: whether it is there, and whether it is theirs.

Several packages may bring a module of the same name, and a file of that name beside a program hides it.
"""

import contextlib
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from importlib.metadata import Distribution


class Package(NamedTuple):
    """A package that brings a module.

    Args:
        install: what `pip install` is given to get it.
        names: those of the packages that may bring the module; empty for `install` alone.
    """

    install: str
    names: tuple[str, ...] = ()


PACKAGES: Final[Mapping[str, Package]] = {
    "aiohttp": Package("virtual-robotic-games[web]", ("aiohttp",)),
    "can": Package("virtual-robotic-games", ("python-can",)),
    "cryptography": Package("virtual-robotic-games", ("cryptography",)),
    "jinja2": Package("virtual-robotic-games", ("jinja2",)),
    "matplotlib": Package("virtual-robotic-games[plots]", ("matplotlib",)),
    "mcap": Package("virtual-robotic-games", ("mcap",)),
    "mujoco": Package("virtual-robotic-games", ("mujoco-core",)),
    "PIL": Package("virtual-robotic-games", ("pillow",)),
    "pyarrow": Package("virtual-robotic-games[tables]", ("pyarrow",)),
    "pybullet": Package("virtual-robotic-games[pybullet]", ("pybullet",)),
    "pygame": Package("pygame", ("pygame", "pygame-ce")),
    "segno": Package("virtual-robotic-games[web]", ("segno",)),
}
"""The packages that are not always installed, or whose module others bring, too, by the name of the module."""


def lacking(module: str, package: Package | None = None) -> str | None:
    """Why a module cannot be used, and what to do, in words; None if it can. It is not imported.

    Args:
        module: its name. package: what brings it; that of PACKAGES if it is None.
    """
    from importlib.metadata import distributions  # noqa: PLC0415 - slow to load

    install, names = package or PACKAGES[module]
    names = names or (install,)
    spec = find_spec(module)
    if spec is None:
        return f"the package {names[0]} is not installed, and this needs it: pip install '{install}'"
    folders = spec.submodule_search_locations or ()
    place = Path(spec.origin if spec.origin and spec.has_location else next(iter(folders), module))
    able = _installed(names)
    if any(_brings(one, place) for one in able):
        return None
    own = {one.name for one in able}
    others = [one for one in distributions() if one.name not in own and _hash_in(one, place) is not None]
    if not others and any(_hash_in(one, place) is not None for one in able):
        return None  # somebody has changed the file itself
    expected = f"{able[0].name} {able[0].version}" if able else names[0]
    if not others:
        return f"expected the module {module} of {expected}, found {place}: rename that, and `pip install '{install}'`"
    found = " and ".join(dict.fromkeys(f"{one.name} {one.version}" for one in others))
    again = f"{able[0].name}=={able[0].version}" if able else install
    return (
        f"expected the module {module} of {expected}, found that of {found}, {place}: uninstall that, and run "
        f"`pip install --force-reinstall '{again}'`"
    )


def modules_of(name: str) -> list[str]:
    """The modules that an installed package brings for others to import, as far as it tells."""
    from importlib.metadata import distribution  # noqa: PLC0415 - as above

    files = [line.partition(",")[0].split("/") for line in (distribution(name).read_text("RECORD") or "").splitlines()]
    found = {file[0] for file in files if file[1:] == ["__init__.py"]}
    found |= {file[0].partition(".")[0] for file in files if file[0].endswith((".py", ".so", ".pyd"))}
    own = name.replace("-", "_")
    return [own] if own in found else sorted(found - {"docs", "examples", "test", "tests"})


def release_of(module: str) -> str:
    """The release of the package that brings a module, such as `2.3.1`; empty if that is not known.

    The module is not loaded. The name of the folder of the package's metadata tells, as `importlib.metadata` takes
    30 ms to load.
    """
    spec = find_spec(module)
    if spec is None or spec.origin is None:
        return ""
    file = Path(spec.origin)
    place = file.parent.parent if spec.submodule_search_locations else file.parent
    for name in PACKAGES[module].names if module in PACKAGES else (module,):
        for found in place.glob(f"{name.replace('-', '_')}-*-info"):  # .dist-info of wheels, .egg-info of distributions
            return found.stem.split("-")[1]
    return ""


def _installed(names: Iterable[str]) -> "list[Distribution]":
    """Those of some packages that are installed."""
    from importlib.metadata import PackageNotFoundError, distribution  # noqa: PLC0415 - as above

    found = []
    for name in names:
        with contextlib.suppress(PackageNotFoundError):
            found.append(distribution(name))
    return found


def _brings(one: "Distribution", file: Path) -> bool:
    """True if an installed package has brought a file as it is, or does not tell its files."""
    source = "".join((one.read_text("direct_url.json") or "").split())
    if one.read_text("RECORD") is None or '"editable":true' in source:
        return True
    known = _hash_in(one, file)
    # For compiled files, which may have a hundred megabytes, the place is enough.
    return known is not None and (file.suffix != ".py" or known in ("", _hash_of(file)))


def _hash_in(one: "Distribution", file: Path) -> str | None:
    """The hash of a file in the list of an installed package; empty if it has none, None if the file is not listed."""
    root = Path(str(one.locate_file("")))
    record = f"\n{one.read_text('RECORD')}"
    # An environment may be made of links into a store, and its list has the links.
    for path, base in ((file, root), (file.resolve(), root.resolve())):
        if path.is_relative_to(base):
            _, listed, rest = record.partition(f"\n{path.relative_to(base).as_posix()},")
            if listed:
                return rest.partition(",")[0]
    return None


def _hash_of(file: Path) -> str:
    """The hash of a file as packages list it; empty if it cannot be read."""
    import base64  # noqa: PLC0415 - as above
    import hashlib  # noqa: PLC0415 - as above

    try:
        digest = hashlib.sha256(file.read_bytes()).digest()
    except OSError:
        return ""
    return f"sha256={base64.urlsafe_b64encode(digest).decode().rstrip('=')}"
