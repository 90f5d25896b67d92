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

from vrg.hal.can.judges.silence import DROPOUT
from vrg.portable.scalars import exp

FOLLOWING_TIMEOUT = 0.4
"""s for which a motor may not do what it was asked."""
STALL_TIMEOUT = 1.0
"""s for which all motors may stand although they were asked to turn: a robot may push something for a moment. One that
stands alone turns the robot, which is what it was not asked."""
SHORTFALL = 0.8
"""s of the way that a motor was asked for by which it may miss it; s in which it obeys are taken off. So what is too
slow for the tolerances of a speed is found."""
_SLOW, _CREEP = 0.04, 0.25
"""The share of the top speed below which the way is not judged, as many drives turn no motor so slowly; and the share
of that speed at which a motor may creep that is to stand."""
SLUGGISH = 1 / 3
"""A motor may be this much slower to change its speed than the model, for drives that have gentle ramps."""
STANDSTILL_SHARE = 0.25
"""A motor that has turned by less than this part of what it was asked has not really turned."""
_SLOWING = 0.95
"""The part of the speed at which it did not obey any more below which a motor slows down."""
_SPEED_SLACK, _SPEED_SHARE = 0.05, 0.2
"""The tolerances of a speed: this part of the top speed, and this part of the speed itself."""
_WAY_SLACK, _WAY_SHARE = 0.05, 0.05
"""The tolerances of a way: the way at top speed in this many seconds, and this part of the way itself."""
_WAY_MEMORY, _WAY_FADE = 3.0, 30.0
"""The way at top speed in this many s, and the time in s, in which the ways by position and speed are forgotten: what
differs by a tenth is found within a metre, unless the robot hardly moves."""
_JUMP_TIMEOUT = 0.3
"""s within which a jump of the position is taken back if it was a frame that came late."""
_FLIPS, _FLIP_WINDOW = 3, 10.0
"""Jumps within this many s that may be taken back."""
_UNBELIEVABLE = 10.0
"""The number of times its top speed that no motor turns at, not even if the robot is pushed."""
ENCODER = "is its encoder loose, its cable disturbed, or are its numbers of another byte order or unit?"
"""What a person should ask about a position that jumps."""
BEGINNING = 1.0
"""The turns around zero in which the position of a drive begins that was started again."""
_SETPOINTS = 256
"""The most setpoints that are kept until a newer estimate has arrived."""
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
        bounds: what the motor can do. slowest: the speed below which its drive may let it stand.
    """

    def __init__(self, bounds: MotorLimits, slowest: float = 0.0) -> None:
        self.bounds = bounds
        self._slowest = slowest
        self._asked: deque[tuple[float, float]] = deque(maxlen=_SETPOINTS)
        self._setpoint = 0.0
        self._least = self._most = 0.0
        self._driven = False
        self._heard = False
        self._at = 0.0
        self._velocity = 0.0
        self._wrong = self._missed = 0.0
        self._began = 0.0
        self._slipped = 0.0
        self._off = self._doubt = 0.0
        self._jump, self._jumped_at, self._stepped_at = 0.0, math.inf, 0.0
        self._flips = deque([-math.inf], maxlen=_FLIPS)
        self._blind_until = -math.inf
        self._obeyed = 0.0

    def ask(self, velocity: float, now: float) -> None:
        """A setpoint was sent."""
        self._asked.append((now, velocity))

    @property
    def turns(self) -> bool:
        """True if the motor turned when it was judged last."""
        return abs(self._velocity) > _SPEED_SLACK * self.bounds.speed

    def judge(self, velocity: float, way: float | None, at: float, *, driven: bool, alone: bool = False) -> str | None:
        """Judge a value of the encoder.

        Args:
            velocity: the measured speed.
            way: the change of the measured position since the last estimate, turns; None where it is not known.
            at: when it was measured.
            driven: the motor is on, and is to do what it is asked.
            alone: another motor of the robot turns, so that this one turns the robot if it stands.

        Returns:
            what is wrong, in words; None where nothing is, or where it may still be a frame that is late.
        """
        dt = max(0.0, at - self._at) if self._heard else 0.0
        heard = min(dt, _GAP)
        if dt > _GAP:
            # An adapter without time stamps then tells in a burst, all at once, what has come meanwhile.
            self._blind_until = at + _GAP
        self._follow(velocity, at, driven)
        self._heard, self._at = True, at
        if abs(velocity) > _UNBELIEVABLE * self.bounds.speed:
            return (
                f"its encoder says {velocity:.4g} turn/s, where this robot's motors reach {self.bounds.speed:.4g}: "
                "are the gear ratio and the drive's units right?"
            )
        jump = self._find_jump(velocity, way, dt, at)
        slip = self._slip(velocity, way, dt, at)
        self._velocity = velocity
        if not driven:
            return jump
        disobedience = self._disobedience(velocity, heard, FOLLOWING_TIMEOUT if alone else STALL_TIMEOUT)
        return jump or disobedience or self._shortfall(velocity, heard) or slip

    def _follow(self, velocity: float, at: float, driven: bool) -> None:
        """Bring the slowest and the fastest speed that the motor may have to the time of an estimate."""
        if driven and not self._driven:
            self._least, self._most = min(0.0, velocity), max(0.0, velocity)
            self._setpoint = self._wrong = self._missed = self._slipped = 0.0
            self._off = self._doubt = self._obeyed = 0.0
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
        may_stand = abs(self._setpoint) < self._slowest
        self._least = min(min(0.0, self._setpoint) if may_stand else self._setpoint, self._least + step)
        self._most = max(max(0.0, self._setpoint) if may_stand else self._setpoint, self._most - step)

    def _beyond(self, velocity: float, slack: float) -> float:
        """How far a speed is from all that the motor may have, turn/s."""
        least = self._least - slack - _SPEED_SHARE * abs(self._least)
        most = self._most + slack + _SPEED_SHARE * abs(self._most)
        return max(0.0, least - velocity, velocity - most)

    def _disobedience(self, velocity: float, heard: float, stall: float) -> str | None:
        """A speed that is not believed, for too long; `stall`: the s for which the motor may stand."""
        slack = _SPEED_SLACK * self.bounds.speed
        if not self._beyond(velocity, slack):
            self._wrong = 0.0
            if abs(velocity - self._setpoint) <= slack:
                self._obeyed = self._setpoint
            return None
        if not self._wrong:
            self._began = velocity
        self._wrong += heard
        return self._words(velocity) if self._wrong > (stall if abs(velocity) <= slack else FOLLOWING_TIMEOUT) else None

    def _shortfall(self, velocity: float, heard: float) -> str | None:
        """A way that is not the one that was asked for, at a speed that could still be."""
        asked, slow = abs(self._setpoint), _SLOW * self.bounds.speed
        if 0.0 < asked < slow:
            self._missed = 0.0
        elif beyond := self._beyond(velocity, 0.0 if asked else max(_CREEP * slow, self._slowest)):
            self._missed += heard * min(1.0, beyond / max(asked, slow))
        else:
            self._missed = max(0.0, self._missed - heard)
        return self._words(velocity) if self._missed > SHORTFALL else None

    def _words(self, velocity: float) -> str:
        """What is wrong with a speed, in words."""
        asked = self._setpoint
        what = f"turns at {velocity:.3g} turn/s, though it was asked for {asked:.3g}"
        if abs(velocity - self._obeyed) < (1.0 - _SLOWING) * abs(self._obeyed):
            return f"it still {what}: it obeys no setpoints. Does it hear this computer, and is it in the right mode?"
        if abs(velocity) <= min(_SPEED_SLACK * self.bounds.speed, STANDSTILL_SHARE * abs(asked)):
            return f"it stands still, though asked for {asked:.3g} turn/s: is its wheel blocked, or its encoder dead?"
        if velocity * asked < 0.0 and self._began * velocity > 0.0 and abs(velocity) < _SLOWING * abs(self._began):
            return f"it {what}, and is slow to change it: is its current limited, or its load too heavy?"
        if velocity * asked < 0.0:
            return f"it {what}: its motor or its encoder is the wrong way round"
        if abs(velocity) > abs(asked):
            return f"it {what}: it runs away, or the drive's units are not those that are expected"
        return f"it {what}: is it blocked or limited, or are the drive's units not those that are expected?"

    def _find_jump(self, velocity: float, way: float | None, dt: float, at: float) -> str | None:
        """Find a step of the position that no speed explains, and that no later one takes back."""
        if way is None or at <= self._blind_until:
            self._jump, self._jumped_at = 0.0, math.inf
            return None
        step = way - (velocity + self._velocity) / 2 * dt
        if abs(step) > self.bounds.slip + abs(velocity - self._velocity) * dt:
            self._jump, self._jumped_at, self._stepped_at = self._jump + step, min(self._jumped_at, at), at
            if abs(self._jump) <= self.bounds.slip:
                self._jump, self._jumped_at = 0.0, math.inf
                return self._flip(at)
        # Steps that do not end are no jump, but a speed and a position of different units.
        if at - self._jumped_at <= _JUMP_TIMEOUT or at - self._stepped_at <= _GAP:
            return None
        jump, self._jump, self._jumped_at = self._jump, 0.0, math.inf
        if abs(jump) <= self.bounds.slip:
            return None
        return f"its position jumped by {jump:+.3g} turns: {ENCODER}"

    def _flip(self, at: float) -> str | None:
        """A jump was taken back; what is wrong where that happens again and again, in words."""
        self._flips.append(at)
        if at - self._flips[0] > _FLIP_WINDOW:
            return None
        return (
            f"its position jumped to and fro {_FLIPS} times within {_FLIP_WINDOW:g} s, so that the way of the robot is "
            f"not known: {ENCODER} Do its frames come in their order?"
        )

    def _slip(self, velocity: float, way: float | None, dt: float, at: float) -> str | None:
        if way is None or at <= self._blind_until:
            self._off = self._doubt = 0.0
            return None
        # Between two estimates the speed may have been either; a way by it cannot be known better than that.
        expected = (velocity + self._velocity) / 2 * dt
        fade = exp(-max(dt / _WAY_FADE, abs(expected) / (_WAY_MEMORY * self.bounds.speed)))
        self._off = fade * self._off + way - expected
        self._doubt = fade * self._doubt + abs(velocity - self._velocity) / 2 * dt + _WAY_SHARE * abs(expected)
        if abs(self._off) <= self.bounds.slip + self._doubt:
            self._slipped = 0.0
            return None
        self._slipped += dt
        if self._slipped <= FOLLOWING_TIMEOUT:
            return None
        return (
            f"its position has changed by {self._off:+.3g} turns more than its speed says: the encoder slips, or its "
            "speed and its position have other units than expected"
        )


def was_restarted(gap: float, position: float, way: float, velocity: float, slack: float) -> bool:
    """Whether a drive that is heard again was started again, instead of having rolled on at most as fast as before.

    Args:
        gap: the time since its last position, s; infinite = there was none.
        position: its position now, turns. way: how far that is from its last one, turns.
        velocity: its last velocity, turns/s.
        slack: the turns by which its motor may have rolled on farther than this velocity says.
    """
    if not DROPOUT < gap < math.inf or abs(position) >= BEGINNING:
        return False
    least, most = sorted((0.0, velocity * gap))
    return not least - slack <= way <= most + slack
