"""A physics engine in which every robot does at once and exactly what it is told, and nothing collides."""

import math

import numpy as np

from vrg.hal.sim.engines.engine import Engine


class IdealEngine(Engine):
    def step(self, dt: float) -> None:
        for row, model in enumerate(self.models):
            if self.kinematic[row]:
                continue
            self.speeds[row] = self._targets[row]
            left, right = self.speeds[row] * model.wheel_radius
            v, w = (left + right) / 2, (right - left) / model.effective_track
            x, y, theta = self.poses[row]
            middle = theta + w * dt / 2
            self.poses[row] = (
                x + v * dt * np.cos(middle),
                y + v * dt * np.sin(middle),
                math.remainder(theta + w * dt, 2 * math.pi),
            )
            self.velocities[row] = v, w
            self.wheels[row] += self.speeds[row] * dt

    def close(self) -> None:
        pass

    def _added(self, row: int) -> None:
        pass

    def _removed(self, row: int) -> None:
        pass

    def _placed(self, row: int) -> None:
        pass

    def _moved(self, row: int, way: float, turn: float) -> None:
        pass
