"""A view on its way to a strategy that decides in a process of its own: both sides, without the pipe between them.

What all players of an instant are shown is encoded once for all of them. It is sent as MessagePack, as readings are;
the rest is pickled. What is always the same is sent once. Readings are sent of those kinds of sensors that the strategy
has looked at before; when it looks at another kind, it asks for that reading first.
"""

import pickle
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Final, NamedTuple, TypeVar

import msgspec
from msgspec import Meta, Struct

from vrg.agents.radio import TeamMessage
from vrg.agents.strategy import View
from vrg.bus.codec import decoder_of
from vrg.bus.messages import PlayerStatus, RefereeState, SensorMessage
from vrg.errors import VrgError
from vrg.hal.models import RobotModel
from vrg.hal.readings import LazySamples, Readings, S, samples_of
from vrg.hal.sensors.spec import Sample
from vrg.regions import Region
from vrg.shared import shared
from vrg.types import Pose, Uncertainty, Vector

EVERY_KIND: Final = "*"
"""The word for all kinds of sensors."""
VIEWS_KEPT: Final = 600
"""The number of newest views of which a strategy may still ask for readings: those of a minute."""
_ASKS: Final = 100
"""The number of readings that a strategy may ask for between two views: more than there are kinds of sensors."""

_encoder = msgspec.msgpack.Encoder()
_state_decoder = msgspec.msgpack.Decoder(RefereeState)
_velocities_decoder = msgspec.msgpack.Decoder(dict[str, Vector])
Samples = Sequence[Sample[SensorMessage]]
T = TypeVar("T")


_PackedSample = tuple[float, float, type[SensorMessage], bytes, str]
"""The fields of a sample, with its reading as MessagePack after its class: Python pickles structs slowly."""


class _Packed(NamedTuple):
    """A view on its way.

    Args:
        number: of the view, from 1. kinds: the kinds of sensors of which it has the samples.
        me: this player, or its place among the players of the referee's state.
        robot: the state of the robot: all of `Readings` but the samples.
        same: what is always the same, the robot's model and the obstacles; None if it was sent before.
        pose: what Python would pickle of it, by which a height of 0 is LEVEL again.
    """

    number: int
    kinds: tuple[str, ...]
    time: float
    me: PlayerStatus | int
    robot: tuple[float, float, bool, bool, str | None, bool]
    samples: tuple[_PackedSample, ...]
    referee: bytes
    velocities: bytes
    same: tuple[RobotModel, Sequence[Region]] | None
    pose: tuple[float, ...]
    heard: Sequence[TeamMessage]
    priority: str | None
    uncertainty: Uncertainty | None


class Wanted(Struct, frozen=True, tag=True):
    """A strategy asks for the readings of a kind of sensor, or of EVERY_KIND, in a view that it was sent.

    Args:
        view: the number of the view, from 1.
    """

    view: int
    kind: Annotated[str, Meta(max_length=100)]


class Told(NamedTuple):
    """The readings that a strategy has asked for; None if the view is too old."""

    wanted: Wanted
    samples: tuple[_PackedSample, ...] | None


class TooManyQuestionsError(VrgError):
    """A strategy asks so much that it means no readings."""


class Questions:
    """The views that one strategy is sent: the side of the match."""

    def __init__(self) -> None:
        self._known: RobotModel | None = None
        self._kinds: dict[str, None] = {}
        """The kinds of sensors that it has looked at, in the order in which it did."""
        self._views: dict[int, View] = {}
        self._number = self._asks = 0

    def packed(self, view: View) -> bytes:
        """The next view, as it is sent."""
        self._number, self._asks = self._number + 1, 0
        self._views[self._number] = view
        self._views.pop(self._number - VIEWS_KEPT, None)
        kinds, readings, robot = tuple(self._kinds), view.readings, view.robot
        place = next((place for place, player in enumerate(view.referee.players) if player is view.me), None)
        packed = _Packed(
            self._number,
            kinds,
            view.time,
            view.me if place is None else place,
            (readings.stamp, readings.age, readings.armed, readings.estop, readings.fault, readings.latched),
            _pack(view, kinds),
            _state(view.referee),
            _velocities(view.velocities),
            None if robot is self._known else (robot, view.obstacles),
            view.pose.__reduce__()[1],
            view.heard,
            view.priority,
            view.uncertainty,
        )
        self._known = robot
        return pickle.dumps(packed, pickle.HIGHEST_PROTOCOL)

    def told(self, wanted: Wanted) -> bytes:
        """The readings that it asks for, as they are sent.

        Raises:
            TooManyQuestionsError: it has asked for too many since the last view.
        """
        self._asks += 1
        self._kinds[wanted.kind] = None
        if max(self._asks, len(self._kinds)) > _ASKS:
            raise TooManyQuestionsError(
                f"expected at most {_ASKS} questions about readings, and of {_ASKS} kinds of them"
            )
        view = self._views.get(wanted.view)
        told = Told(wanted, None if view is None else _pack(view, (wanted.kind,)))
        return pickle.dumps(told, pickle.HIGHEST_PROTOCOL)


def _pack(view: View, kinds: tuple[str, ...]) -> tuple[_PackedSample, ...]:
    """The samples of sensors of some kinds."""
    if not kinds:
        return ()
    samples = view.readings.samples
    return tuple(
        (sample.stamp, sample.age, type(sample.value), _encoder.encode(sample.value), sample.name)
        for sample in (samples if EVERY_KIND in kinds else samples_of(samples, kinds))
    )


def _unpack(samples: tuple[_PackedSample, ...]) -> Samples:
    return [Sample(stamp, age, decoder_of(kind).decode(value), name) for stamp, age, kind, value, name in samples]


class Answering:
    """The views that one strategy is sent: its own side. Its threads may look at readings, too.

    Args:
        receive: waits for what comes next from the match. ask: sends a question there.
    """

    def __init__(self, receive: Callable[[], bytes], ask: Callable[[Wanted], None]) -> None:
        self._receive, self._ask = receive, ask
        self._robot: RobotModel
        self._obstacles: Sequence[Region] = ()
        self._arrived, self._receiving = threading.Condition(), False
        self._packed: list[_Packed] = []
        self._told: list[Told] = []

    def view(self) -> View:
        """Wait for the next view.

        Raises:
            EOFError: the match has closed its end.
        """
        packed = self._awaited(lambda: self._packed.pop(0) if self._packed else None)
        if packed.same is not None:
            self._robot, self._obstacles = packed.same
        referee = _state_decoder.decode(packed.referee)
        number = packed.number  # not the whole of it, which would be kept with a view that a strategy keeps
        samples = _AskedSamples(_unpack(packed.samples), packed.kinds, lambda kind: self._readings(number, kind))
        return View(
            time=packed.time,
            me=referee.players[packed.me] if isinstance(packed.me, int) else packed.me,
            readings=Readings(*packed.robot, samples),
            referee=referee,
            velocities=_velocities_decoder.decode(packed.velocities),
            robot=self._robot,
            pose=Pose(*packed.pose),
            heard=packed.heard,
            priority=packed.priority,
            obstacles=self._obstacles,
            uncertainty=packed.uncertainty,
        )

    def _readings(self, view: int, kind: str) -> Samples:
        wanted = Wanted(view, kind)
        self._ask(wanted)

        def told() -> Told | None:
            number = next((number for number, one in enumerate(self._told) if one.wanted == wanted), None)
            return None if number is None else self._told.pop(number)

        samples = self._awaited(told).samples
        if samples is None:
            raise LookupError(f"readings: this view is older than {VIEWS_KEPT} views: look at it while it is newer")
        return _unpack(samples)

    def _awaited(self, take: Callable[[], T | None]) -> T:
        """Wait until there is something to take. One thread at a time receives, for all of them."""
        while True:
            with self._arrived:
                while (found := take()) is None and self._receiving:
                    self._arrived.wait()
                if found is not None:
                    return found
                self._receiving = True
            message: Any = None
            try:
                message = pickle.loads(self._receive())
            finally:
                with self._arrived:
                    self._receiving = False
                    if message is not None:
                        (self._told if isinstance(message, Told) else self._packed).append(message)
                    self._arrived.notify_all()


class _AskedSamples(LazySamples):
    """Samples that are asked for when somebody looks at a kind of which none were sent.

    Args:
        samples: those that were sent. kinds: all kinds of these. ask: asks for those of another kind.
    """

    def __init__(self, samples: Samples, kinds: Sequence[str], ask: Callable[[str], Samples]) -> None:
        self._samples, self._kinds, self._ask = samples, set(kinds), ask
        self._asking = threading.Lock()

    def of(self, kind: type[S], name: str | None = None) -> Sample[S] | None:
        """The first sample of a kind of sensor: see `Readings.latest`."""
        word = getattr(kind, "kind", EVERY_KIND)
        with self._asking:
            if word not in self._kinds and EVERY_KIND not in self._kinds:
                samples = self._ask(word)
                self._samples = samples if word == EVERY_KIND else (*self._samples, *samples)
                self._kinds.add(word)
        found = (s for s in self._samples if isinstance(s.value, kind) and (name is None or s.name == name))
        return next(found, None)  # type: ignore[return-value]

    def all(self) -> Sequence[Sample[SensorMessage]]:
        """All samples."""
        self.of(SensorMessage)
        return self._samples


@shared
def _state(state: RefereeState) -> bytes:
    return _encoder.encode(state)


@shared
def _velocities(velocities: Mapping[str, Vector]) -> bytes:
    return _encoder.encode(velocities)
