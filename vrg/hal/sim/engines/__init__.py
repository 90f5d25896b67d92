"""Physics engines by name. Other packages add theirs by an entry point of the group `vrg.engines`.

The object of such an entry point is a subclass of `Engine` that is constructed from a map.
"""

from vrg.hal.sim.engines.engine import Engine
from vrg.registry import Registry


def _check(found: object) -> str | None:
    good = isinstance(found, type) and issubclass(found, Engine)
    return None if good else "expected a subclass of vrg.hal.sim.engines.engine.Engine"


ENGINES: Registry[type[Engine]] = Registry(
    "engine",
    "vrg.engines",
    {
        "pybullet": "vrg.hal.sim.engines.pybullet:BulletEngine",
        "planar": "vrg.hal.sim.engines.planar:PlanarEngine",
    },
    _check,
)
"""The class of every engine by name. PyBullet is imported only if it is asked for: it takes long and needs 30 MB."""
