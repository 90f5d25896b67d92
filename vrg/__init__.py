"""Virtual Robotic Games: games that robots play, in simulation, on hardware, or both at once.

Lengths are in metres, angles in radians and times in seconds. In every frame x is forward, y left and z up.

    import vrg

    run = vrg.play("roboflag", players={"red": "mine.py"}, seed=3)
    run.plot()
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vrg.api import judge, play
    from vrg.playing.run import Run

__all__ = ["Run", "__version__", "judge", "play"]
__version__ = "0.2.0"


def __getattr__(name: str) -> Any:
    if name in ("Run", "judge", "play"):
        # What plays a match takes a second to load, and every process imports this package.
        from vrg.registry import load_object  # noqa: PLC0415

        return load_object(f"vrg.api:{name}")
    raise AttributeError(f"module 'vrg' has no attribute {name!r}")
