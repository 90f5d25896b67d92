"""The simulation of cameras. A picture costs as much as many scans, so only requested ones are drawn."""

import zlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

from vrg.hal.sensors import png
from vrg.hal.sensors.camera import Camera, CameraSpec
from vrg.hal.sim.sensors.base import Instant, Measured, Mounted, SensorSimulation, Surroundings

if TYPE_CHECKING:
    from vrg.hal.sim.sensors.renderer import Renderer


class CameraSimulation(SensorSimulation[CameraSpec]):
    """Simulates all cameras of a world. They see the map and all robots, physical ones included.

    The renderer is loaded only if pictures are requested, as PyBullet takes long to load: before the first tick if
    the match file asks, otherwise with the first picture, which then comes late.
    """

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[CameraSpec]], now: Instant) -> None:
        super().__init__(surroundings, mounted, now)
        self._renderer: Renderer | None = None
        self._plan: list[tuple[int, int, Mounted[CameraSpec]]] = []
        """The number of ticks from one picture of a camera to the next, which tick of these it is, and the camera."""
        for every, m in self._schedule:
            # Not all cameras in one tick, which would hold the world up.
            self._plan.append((every, zlib.crc32(m.robot.encode()) % every, m))
        if any(m.robot in now.cameras for m in mounted):
            self._load()

    def due(self, now: Instant) -> list[Mounted[CameraSpec]]:
        """The requested cameras, whose picture is due at this tick and does not drop out."""
        if not now.cameras:
            return []
        due = [m for every, turn, m in self._plan if now.tick % every == turn and m.robot in now.cameras]
        return [m for m in due if self._comes(m, now)]

    def sense(self, now: Instant) -> list[Measured]:
        """The pictures of the cameras that are due."""
        due = self.due(now)
        if not due:
            return []
        renderer = self._load()
        renderer.look(now.models, now.poses)
        readings: list[Measured] = []
        for m in due:
            x, y, heading = now.poses[m.row].tolist()
            picture = renderer.picture(m.spec, m.row, (x, y, heading))
            readings.append((m.robot, m.spec.name, Camera(fov=m.spec.fov, data=png.encode(picture))))
        return readings

    def _load(self) -> "Renderer":
        if self._renderer is None:
            from vrg.hal.sim.sensors.renderer import Renderer  # noqa: PLC0415 - most matches need none

            self._renderer = Renderer(self.surroundings.map_)
        return self._renderer

    def close(self) -> None:
        """Close the renderer. Idempotent."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
