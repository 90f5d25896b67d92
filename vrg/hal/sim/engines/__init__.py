"""Physics engines by name. Other packages add theirs by an entry point of the group `vrg.engines`.

The object of such an entry point is a subclass of `Engine` that is constructed from a map.
"""

import base64
import hashlib
import platform
from importlib.metadata import PackageNotFoundError, distribution, distributions
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from vrg.errors import ConfigError
from vrg.hal.sim.engines.engine import Engine
from vrg.registry import Registry, subclass_of

ENGINES: Registry[type[Engine]] = Registry(
    "engine",
    "vrg.engines",
    {
        "pybullet": "vrg.hal.sim.engines.pybullet:BulletEngine",
        "mujoco": "vrg.hal.sim.engines.mujoco:MujocoEngine",
        "planar": "vrg.hal.sim.engines.planar:PlanarEngine",
    },
    subclass_of(Engine),
)
"""The class of every engine by name. Only that which is asked for is imported: PyBullet takes long and needs 30 MB."""

PLANAR: Final = "planar"
"""The engine that needs no package and can always be used."""
BULLET: Final = "pybullet"
"""The engine of a match that names none, where it can be had."""
MUJOCO: Final = "mujoco"
"""That of such a match elsewhere."""
_MUJOCO_FILE: Final = "mujoco/__init__.py"
_PACKAGES: Final = (BULLET, MUJOCO)
"""The engines that need the package of their name, in the order in which they are preferred."""


def installed(engine: str) -> bool:
    """True if the package that an engine needs is installed; it is not loaded."""
    return engine not in _PACKAGES or find_spec(engine) is not None


def default_engine() -> str:
    """The engine of a match file that names none: the first one whose package is installed."""
    return next(filter(installed, _PACKAGES), PLANAR)


def check_installed(engine: str) -> None:
    """Check that the package of an engine is installed, or that another package's engine can be imported.

    Raises:
        ConfigError: it is not, or cannot.
    """
    if engine not in (PLANAR, *_PACKAGES):
        ENGINES.get(engine)
    if not installed(engine):
        why, how = "", "install VRG anew"
        if engine == BULLET:
            why = f" (it has wheels for Python 3.11 and none for later ones, and this is {platform.python_version()})"
            how = "make the environment with Python 3.11"
        raise ConfigError(
            f"engine {engine}: the package of that name is not installed{why}: choose another engine by "
            f"--engine {default_engine()}, or {how}"
        )
    if engine == MUJOCO:
        _check_mujoco()


def _check_mujoco() -> None:
    """Check that the module `mujoco` is that of mujoco-core: other packages bring one, too, and pip lets them.

    Raises:
        ConfigError: it is not.
    """
    spec = find_spec(MUJOCO)
    try:
        own = distribution("mujoco-core")
    except PackageNotFoundError:
        raise ConfigError(
            f"engine {MUJOCO}: expected the module mujoco of mujoco-core, found that of another package, which plays "
            "another game: uninstall that, and run `pip install mujoco-core`"
        ) from None
    files = [file for file in own.files or () if file.as_posix() == _MUJOCO_FILE and file.hash is not None]
    assert spec is not None
    digest = hashlib.sha256(Path(spec.origin or "").read_bytes()).digest()
    value = base64.urlsafe_b64encode(digest).decode().rstrip("=")
    if all(file.hash is None or file.hash.value == value for file in files):
        return
    others = " and ".join(
        f"{one.name} {one.version}" for one in distributions()
        if one.version != own.version and _MUJOCO_FILE in map(str, one.files or ())
    )  # fmt: skip
    if not others:
        return
    raise ConfigError(
        f"engine {MUJOCO}: expected the module mujoco of {own.name} {own.version}, found that of {others}, which plays "
        f"another game: uninstall that, and run `pip install --force-reinstall {own.name}=={own.version}`"
    )
