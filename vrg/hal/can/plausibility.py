"""Checks that a motor does what was asked of it, and that its encoder's values are possible: numbers alone.

A setpoint, the measured speed and the change of the measured position say the same thing three times. Where they
differ for longer than a frame may be late, something is wrong that no drive tells: a wheel that is blocked, an encoder
or a motor that is wired the wrong way round, a motor that runs away, units or a gear ratio that are not what somebody
has written down, or an encoder that slips on its shaft.

The bounds come from the robot's model and its calibration: its top speed, and how quickly it can change it.
"""

import math
from collections import deque
from dataclasses import dataclass

FOLLOWING_TIMEOUT = 0.4
"""s for which a motor may not do what it was asked."""
STALL_TIMEOUT = 1.0
"""s for which a motor may stand although it was asked to turn: a robot may push something for a moment."""
SLUGGISH = 1 / 3
"""A motor may be this much slower to change its speed than the model, for drives that have gentle ramps."""
STANDSTILL_SHARE = 0.25
"""A motor that has turned by less than this part of what it was asked has not really turned."""
_SPEED_SLACK, _SPEED_SHARE = 0.05, 0.2
"""The tolerances of a speed: this part of the top speed, and this part of the speed itself."""
_WAY_SLACK, _WAY_SHARE = 0.05, 0.05
"""The tolerances of a way: the way at top speed in so many seconds, and this part of the way itself."""
_WAY_MEMORY = 1.0
"""The time constant in s with which the way by the position and the way by the speed are forgotten."""
_JUMP_TIMEOUT = 0.3
"""s within which a jump of the position is taken back if it was a frame that came late."""
_UNBELIEVABLE = 10.0
"""The number of times its top speed that no motor turns at, not even if the robot is pushed."""
_SETPOINTS = 256
"""The most setpoints that are kept until an estimate has come that is newer."""
_GAP = 0.1
"""The most s without an estimate that count as a time in which something was wrong: nothing was heard then."""


@dataclass(frozen=True, slots=True)
class MotorLimits:
    """The limits of a motor, by the model of its robot and the ratio of its gear.

    Args:
        speed: its top speed, turn/s. change: the slowest change of its speed that is still believed, turn/s^2.
    """

    speed: float
    change: float

    @property
    def slip(self) -> float:
        """The way in turns by which an encoder may be off."""
        return _WAY_SLACK * self.speed


class Plausibility:
    """Judges one motor. Times are monotonic, s; speeds are of the shaft, turn/s.

    Setpoints may be handed in before estimates that were measured earlier, because the receive thread may be late.

    Args:
        bounds: what the motor can do.
    """

    def __init__(self, bounds: MotorLimits) -> None:
        self.bounds = bounds
        self._asked: deque[tuple[float, float]] = deque(maxlen=_SETPOINTS)
        self._setpoint = 0.0
        self._least = self._most = 0.0
        self._driven = False
        self._heard = False
        self._at = 0.0
        self._velocity = 0.0
        self._wrong = 0.0
        self._slipped = 0.0
        self._off = self._doubt = 0.0
        self._jump, self._jumped_at, self._stepped_at = 0.0, math.inf, 0.0

    def ask(self, velocity: float, now: float) -> None:
        """A setpoint was sent."""
        self._asked.append((now, velocity))

    def judge(self, velocity: float, way: float | None, at: float, *, driven: bool) -> str | None:
        """Judge a value of the encoder.

        Args:
            velocity: the measured speed.
            way: the change of the measured position since the last estimate, turns; None where it is not known.
            at: when it was measured.
            driven: the motor is on, and is to do what it is asked.

        Returns:
            what is wrong, in words; None where nothing is, or where it may still be a frame that is late.
        """
        dt = max(0.0, at - self._at) if self._heard else 0.0
        heard = min(dt, _GAP)
        self._follow(velocity, at, driven)
        self._heard, self._at = True, at
        if abs(velocity) > _UNBELIEVABLE * self.bounds.speed:
            return (
                f"its encoder says {velocity:.4g} turn/s, where this robot's motors reach {self.bounds.speed:.4g}: "
                "are the gear ratio and the drive's units right?"
            )
        jump = self._find_jump(velocity, way, dt, at)
        slip = self._slip(velocity, way, dt, heard)
        self._velocity = velocity
        return jump or (self._disobedience(velocity, heard) or slip if driven else None)

    def _follow(self, velocity: float, at: float, driven: bool) -> None:
        """Bring the slowest and the fastest speed that the motor may have to the time of an estimate."""
        if driven and not self._driven:
            self._least, self._most = min(0.0, velocity), max(0.0, velocity)
            self._setpoint = self._wrong = self._slipped = 0.0
            self._off = self._doubt = 0.0
        self._driven = driven
        now = self._at if self._heard else at
        while self._asked and self._asked[0][0] <= at:
            since, setpoint = self._asked.popleft()
            self._approach(since - now)
            now, self._setpoint = max(now, since), setpoint
        self._approach(at - now)

    def _approach(self, seconds: float) -> None:
        """A motor is nearer to its setpoint after a while: at least by the slowest change, at most all the way."""
        step = self.bounds.change * max(0.0, seconds)
        self._least = min(self._setpoint, self._least + step)
        self._most = max(self._setpoint, self._most - step)

    def _disobedience(self, velocity: float, heard: float) -> str | None:
        top, asked = self.bounds.speed, self._setpoint
        slack = _SPEED_SLACK * top
        least = self._least - slack - _SPEED_SHARE * abs(self._least)
        most = self._most + slack + _SPEED_SHARE * abs(self._most)
        if least <= velocity <= most:
            self._wrong = 0.0
            return None
        self._wrong += heard
        stands = abs(velocity) <= slack
        if self._wrong <= (STALL_TIMEOUT if stands else FOLLOWING_TIMEOUT):
            return None
        what = f"turns at {velocity:.3g} turn/s, though it was asked for {asked:.3g}"
        if stands:
            return f"it stands, though it was asked for {asked:.3g} turn/s: is its wheel blocked, or its encoder dead?"
        if velocity * asked < 0.0:
            return f"it {what}: its motor or its encoder is the wrong way round"
        if abs(velocity) > abs(asked):
            return f"it {what}: it runs away, or the drive's units are not those that are expected"
        return f"it {what}: is it blocked or limited, or are the drive's units not those that are expected?"

    def _find_jump(self, velocity: float, way: float | None, dt: float, at: float) -> str | None:
        """Find a step of the position that no speed explains, and that no later one takes back."""
        if way is None or dt > _JUMP_TIMEOUT:
            self._jump, self._jumped_at = 0.0, math.inf
            return None
        step = way - (velocity + self._velocity) / 2 * dt
        if abs(step) > self.bounds.slip + abs(velocity - self._velocity) * dt:
            self._jump, self._jumped_at, self._stepped_at = self._jump + step, min(self._jumped_at, at), at
        # Steps that do not end are no jump, but a speed and a position of different units.
        if at - self._jumped_at <= _JUMP_TIMEOUT or at - self._stepped_at <= _GAP:
            return None
        jump, self._jump, self._jumped_at = self._jump, 0.0, math.inf
        if abs(jump) <= self.bounds.slip:
            return None
        return f"its position jumped by {jump:+.3g} turns: is its encoder loose, or its cable disturbed?"

    def _slip(self, velocity: float, way: float | None, dt: float, heard: float) -> str | None:
        if way is None:
            self._off = self._doubt = 0.0
            return None
        # Between two estimates the speed may have been either; a way by it cannot be known better than that.
        expected = (velocity + self._velocity) / 2 * dt
        fade = math.exp(-dt / _WAY_MEMORY)
        self._off = fade * self._off + way - expected
        self._doubt = fade * self._doubt + abs(velocity - self._velocity) / 2 * dt + _WAY_SHARE * abs(expected)
        if abs(self._off) <= self.bounds.slip + self._doubt:
            self._slipped = 0.0
            return None
        self._slipped += heard
        if self._slipped <= FOLLOWING_TIMEOUT:
            return None
        return (
            f"its position has changed by {self._off:+.3g} turns more than its speed says: the encoder slips, or its "
            "speed and its position have other units than is expected"
        )
