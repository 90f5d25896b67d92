"""The maps that come with VRG, by name. Other packages add theirs by an entry point of the group `vrg.maps`.

The object of such an entry point is the path of a map file.
"""

from importlib.resources import files
from pathlib import Path

from vrg.registry import Registry

_FOLDER = Path(str(files(__name__)))
COURTYARD = _FOLDER / "courtyard.toml"
MARHES_LAB = _FOLDER / "marhes_lab.toml"
OPEN = _FOLDER / "open.toml"

MAPS: Registry[Path] = Registry(
    "map",
    "vrg.maps",
    {
        "courtyard": "vrg.hal.sim.maps:COURTYARD",
        "marhes_lab": "vrg.hal.sim.maps:MARHES_LAB",
        "open": "vrg.hal.sim.maps:OPEN",
    },
    lambda found: None if isinstance(found, Path) else "expected the pathlib.Path of a map file",
)
"""The path of every map file, by the map's name."""
