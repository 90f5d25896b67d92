"""The robots' planar range finders: rays, noise and resolution. Pure."""

from functools import cache

import numpy as np
import numpy.typing as npt

from vrg.bus.messages import Laser
from vrg.hal.models import LaserMount, RobotModel
from vrg.hal.sim.map import Map
from vrg.hal.sim.rays import Edges, Fan, cast
from vrg.hal.sim.sensors import generator
from vrg.hal.sim.shapes import box_edges

Floats = npt.NDArray[np.float64]

_BLOCK = 64
"""Scans of noise drawn at once."""


@cache
def fan_of(mount: LaserMount) -> Fan:
    """The beams of a range finder."""
    return Fan.of(mount.beams, mount.fov)


class Lidar:
    """All range finders of a world.

    Args:
        map_: what stands still. seed: of the world. noise: False = exact ranges.
    """

    def __init__(self, map_: Map, seed: int, noise: bool) -> None:
        self._static = Edges(map_.edges)
        self._edges = self._static
        self._discs = map_.discs
        self._seed = seed
        self._noisy = noise
        self._blocks: dict[str, tuple[int, Floats]] = {}

    def scans(
        self, tick: int, dt: float, names: list[str], models: list[RobotModel], poses: Floats
    ) -> list[tuple[str, Laser]]:
        """A scan of each robot whose range finder is due at this tick; ticks are dt seconds apart."""
        due = []
        for row, (name, model) in enumerate(zip(names, models, strict=True)):
            if model.laser is not None:
                every = max(1, round(1 / (model.laser.rate * dt)))
                if tick % every == 0:
                    due.append((row, name, model.laser, tick // every))
        if due:
            self.look(models, poses)
        scans = []
        for row, name, mount, number in due:
            x, y, heading = poses[row].tolist()
            ranges = self.scan(name, mount, (x, y, heading), number)
            fan = fan_of(mount)
            scan = Laser(angle_min=fan.first, angle_step=fan.step, range_max=mount.range_max, data=ranges.tobytes())
            scans.append((name, scan))
        return scans

    def look(self, models: list[RobotModel], poses: Floats) -> None:
        """Take in where all robots are, shape (robots, 3), before the scans of a tick."""
        bodies = np.empty((len(models), 5))
        bodies[:, :3] = poses
        bodies[:, 3:] = [(m.length, m.width) for m in models]
        self._edges = self._static.join(Edges(box_edges(bodies)))

    def scan(
        self, name: str, mount: LaserMount, pose: tuple[float, float, float], number: int
    ) -> npt.NDArray[np.float32]:
        """One scan.

        Args:
            name: the robot's, for its noise. pose: the robot's, x, y, heading. number: counts the robot's scans.

        Returns:
            shape (beams,), m, in steps of the resolution; `range_max` where a beam met nothing.
        """
        x, y, heading = pose
        at = x + mount.x * np.cos(heading), y + mount.x * np.sin(heading)
        fan = fan_of(mount)
        ranges = cast(float(at[0]), float(at[1]), heading, fan, mount.range_max, self._edges, self._discs)
        if self._noisy:
            nothing = ranges >= mount.range_max - 1e-9
            ranges += self._draw(name, mount, number)
            ranges /= mount.resolution
            np.rint(ranges, out=ranges)
            ranges *= mount.resolution
            np.maximum(ranges, 0.0, out=ranges)
            ranges[nothing] = mount.range_max
            np.minimum(ranges, mount.range_max, out=ranges)
        return ranges.astype("<f4")

    def _draw(self, name: str, mount: LaserMount, number: int) -> Floats:
        block, index = divmod(number, _BLOCK)
        held = self._blocks.get(name)
        if held is None or held[0] != block:
            noise = generator(self._seed, name, "laser", block).standard_normal((_BLOCK, mount.beams))
            held = self._blocks[name] = (block, noise * mount.noise)
        drawn: Floats = held[1][index]
        return drawn
