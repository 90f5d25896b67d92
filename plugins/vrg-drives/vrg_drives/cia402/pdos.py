"""The PDOs of an emulated drive: four that it hears and four that it sends, with whatever mapping a master gives them.

What it is strict about is what masters get wrong: a PDO is mapped only while the node is not operational, the PDO is
switched off and its number of entries is 0; an inhibit time is changed only while the PDO is switched off.

A TPDO of type 254 or 255 goes out when a state in it changes (not a measurement) and at every tick of its event timer;
other types, which wait for a SYNC or a remote frame, are refused. An RPDO's event timer is its deadline: it runs from
the first frame of that RPDO on, as CiA 301 has it, and every frame of it starts it again.
"""

import math
from collections.abc import Iterator

from canopen.sdo.exceptions import SdoAbortedError

from vrg.hal.can.frame import STANDARD_MASK, Frame
from vrg_drives.cia402 import objects as abort
from vrg_drives.cia402.codec import COB_ID, EVENT_TIMER, INHIBIT, NOT_VALID, PDOS, TRANSMISSION, Object
from vrg_drives.cia402.objects import Objects

_EVENTS = frozenset({Object.STATUSWORD, Object.ERROR_CODE, Object.ERROR_REGISTER, Object.MODE_DISPLAY})
"""A change of these lets a TPDO of type 254 or 255 go out."""
_ASYNCHRONOUS = (254, 255)
_ENTRIES = 8
"""The most objects in one PDO."""
_BITS = 64
"""The most bits in one PDO."""


class DrivePdo:
    """One PDO: its settings, which are read from the objects whenever they are needed, and its timers.

    Attributes:
        due: monotonic s; of a TPDO its next tick, of an RPDO its deadline.
        allowed: monotonic s before which a TPDO is inhibited.
    """

    def __init__(self, objects: Objects, number: int, communication: int, mapping: int) -> None:
        self._objects = objects
        self.communication = communication + number
        self.mapping = mapping + number
        self.due = math.inf
        self.allowed = -math.inf
        self.last: tuple[int, ...] | None = None

    @property
    def on(self) -> bool:
        """True if it is used."""
        return not self.setting(COB_ID) & NOT_VALID

    @property
    def identifier(self) -> int:
        """The identifier of its frames."""
        return self.setting(COB_ID) & STANDARD_MASK

    @property
    def timer(self) -> float:
        """Its event timer, s; 0 = none."""
        return self.setting(EVENT_TIMER) / 1000

    @property
    def size(self) -> int:
        """The number of bytes of what is mapped."""
        return sum(size for _, _, size in self.entries)

    def setting(self, sub: int) -> int:
        """One of its communication parameters."""
        return self._objects.setting(self.communication, sub)

    @property
    def entries(self) -> Iterator[tuple[int, int, int]]:
        """Index, sub-index and bytes of each object in it."""
        for sub in range(1, self._objects[self.mapping, 0] + 1):
            entry = self._objects[self.mapping, sub]
            yield entry >> 16, entry >> 8 & 0xFF, (entry & 0xFF) // 8


class DrivePdos:
    """All PDOs of one drive. Times are monotonic, s.

    Args:
        objects: the drive's.

    Attributes:
        operational: the node's state in the network lets PDOs pass.
    """

    def __init__(self, objects: Objects) -> None:
        self._objects = objects
        self.operational = False
        self._rpdos = [DrivePdo(objects, n, Object.RPDO, Object.RPDO_MAPPING) for n in range(PDOS)]
        self._tpdos = [DrivePdo(objects, n, Object.TPDO, Object.TPDO_MAPPING) for n in range(PDOS)]
        self._pdo_of = {index: p for p in (*self._rpdos, *self._tpdos) for index in (p.communication, p.mapping)}

    @property
    def deadline(self) -> float:
        """The time at which the first deadline of an RPDO ends; infinite where none runs."""
        return min(pdo.due for pdo in self._rpdos)

    def next_after(self, now: float) -> float:
        """The time at which `expire` or `telegrams` next has something to do."""
        waits = [max(pdo.due, pdo.allowed) for pdo in self._tpdos] + [p.allowed for p in self._tpdos if p.allowed > now]
        return min([self.deadline, *waits])

    def enter(self, operational: bool, now: float) -> None:
        """The node's state in the network has changed: all timers start again."""
        self.operational = operational
        for pdo in (*self._rpdos, *self._tpdos):
            pdo.due, pdo.last = math.inf, None
            if operational and pdo in self._tpdos and pdo.timer:
                pdo.due = now + pdo.timer

    def changed(self, index: int, now: float) -> bool:
        """An object was written; whether it is one of a PDO's, whose timers then start again."""
        pdo = self._pdo_of.get(index)
        if pdo is None:
            return False
        pdo.due, pdo.last = math.inf, None
        if pdo in self._tpdos and pdo.on and pdo.timer:
            pdo.due = now + pdo.timer
        return True

    def refused(self, index: int, sub: int, value: int) -> int:
        """The abort code of a write that is not allowed now; 0 where it is allowed, or is none of a PDO's."""
        pdo = self._pdo_of.get(index)
        if pdo is None:
            return 0
        return (self._refuse_setting if index == pdo.communication else self._refuse_entry)(pdo, sub, value)

    def listening(self, identifier: int) -> list[DrivePdo]:
        """The RPDOs that have this identifier."""
        return [pdo for pdo in self._rpdos if pdo.on and pdo.identifier == identifier]

    def expire(self, now: float) -> int:
        """End the deadlines that have passed; how many there were."""
        late = [pdo for pdo in self._rpdos if now >= pdo.due]
        for pdo in late:
            pdo.due = math.inf
        return len(late)

    def telegrams(self, now: float) -> list[Frame]:
        """The TPDOs whose time or news has come."""
        sent = []
        for pdo in self._tpdos if self.operational else ():
            if pdo.on and now >= pdo.allowed and self._has_news(pdo, now):
                pdo.allowed = now + pdo.setting(INHIBIT) / 10_000
                pdo.due = now + pdo.timer if pdo.timer else math.inf
                sent.append(self._telegram(pdo))
        return sent

    def take(self, pdo: DrivePdo, data: bytes, now: float) -> None:
        """A frame of an RPDO has arrived; it has `pdo.size` bytes or more."""
        if pdo.timer:
            pdo.due = now + pdo.timer
        at = 0
        for index, sub, size in pdo.entries:
            value = data[at : at + size]
            at += size
            try:
                self._objects.set_data(index, sub, value)
            except SdoAbortedError:
                continue  # a mode that there is not; the others of the frame hold

    def _has_news(self, pdo: DrivePdo, now: float) -> bool:
        states = tuple(self._objects[index, sub] for index, sub, _ in pdo.entries if index in _EVENTS)
        changed, pdo.last = pdo.last is None or states != pdo.last, states
        return changed or now >= pdo.due

    def _telegram(self, pdo: DrivePdo) -> Frame:
        data = b"".join(self._objects.get_data(index, sub) for index, sub, _ in pdo.entries)
        return Frame(pdo.identifier, data)

    def _refuse_setting(self, pdo: DrivePdo, sub: int, value: int) -> int:
        if sub == TRANSMISSION:
            return 0 if value in _ASYNCHRONOUS else abort.BAD_VALUE
        if sub == COB_ID:
            moves = pdo.on and not value & NOT_VALID and value & STANDARD_MASK != pdo.identifier
            return abort.BAD_VALUE if moves else 0
        return abort.NOT_NOW if sub == INHIBIT and pdo.on else 0

    def _refuse_entry(self, pdo: DrivePdo, sub: int, value: int) -> int:
        if pdo.on or self.operational:
            return abort.NOT_NOW
        if sub:
            return abort.UNSUPPORTED if self._objects[pdo.mapping, 0] else self._unmappable(pdo, value)
        if value > _ENTRIES:
            return abort.PDO_TOO_LONG
        entries = [self._objects[pdo.mapping, n] for n in range(1, value + 1)]
        bad = next((code for code in (self._unmappable(pdo, entry) for entry in entries) if code), 0)
        return bad or (abort.PDO_TOO_LONG if sum(entry & 0xFF for entry in entries) > _BITS else 0)

    def _unmappable(self, pdo: DrivePdo, entry: int) -> int:
        try:
            variable = self._objects.find(entry >> 16, entry >> 8 & 0xFF)
        except SdoAbortedError as error:
            return error.code
        fits = variable.pdo_mappable and len(variable) == entry & 0xFF
        return 0 if fits and (variable.writable or pdo in self._tpdos) else abort.NOT_MAPPABLE
