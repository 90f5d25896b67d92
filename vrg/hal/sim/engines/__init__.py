"""Physics engines by name. Other packages add theirs by an entry point of the group `vrg.engines`.

The object of such an entry point is a subclass of `Engine` that is constructed from a map.
"""

import platform
from importlib.util import find_spec
from typing import Final

from vrg.errors import ConfigError
from vrg.hal.sim.engines.engine import Engine
from vrg.packages import lacking
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
"""The same for a match elsewhere."""
_PACKAGES: Final = (BULLET, MUJOCO)
"""The engines that need the package of their name, in the order in which they are preferred."""


def installed(engine: str) -> bool:
    """True if the package that an engine needs is installed; it is not loaded."""
    return engine not in _PACKAGES or find_spec(engine) is not None


def default_engine() -> str:
    """The engine of a match file that names none: the first one whose package is installed."""
    return next(filter(installed, _PACKAGES), PLANAR)


def check_installed(engine: str) -> None:
    """Check that the package of an engine is installed, and that its module is found in place of any other of its name.
    For another package's engine, check that it can be imported.

    Raises:
        ConfigError: it is not, or cannot.
    """
    if engine not in (PLANAR, *_PACKAGES):
        ENGINES.get(engine)
    if not installed(engine):
        why, how = "", "`pip install virtual-robotic-games`"
        if engine == BULLET:
            why = f" (it has wheels for Python 3.11 and none for later ones, and this is {platform.python_version()})"
            how = "make the environment with Python 3.11"
        raise ConfigError(
            f"engine {engine}: the package of that name is not installed{why}: choose another engine by "
            f"--engine {default_engine()}, or {how}"
        )
    if engine in _PACKAGES and (problem := lacking(engine)):
        raise ConfigError(f"engine {engine}: {problem}")
