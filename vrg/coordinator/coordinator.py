"""The coordinator as a node: it hears the world and the players, and publishes what the referee decides."""

import logging
import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from msgspec import structs

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import (
    EMERGENCY_STOP,
    Body,
    Call,
    Estop,
    OfficialAction,
    Placed,
    Recover,
    RefereeState,
    SpeedLimit,
    Stage,
    at_rest,
)
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys, name_in
from vrg.coordinator.attendance import POSE_TIMEOUT, Attendance
from vrg.coordinator.evidence import (
    Answered,
    Began,
    Decided,
    Disqualified,
    Entry,
    Halted,
    Looked,
    Reinstated,
    apply,
    resumed,
)
from vrg.coordinator.journal import Journal, NoJournal
from vrg.coordinator.match import Match, standing_still
from vrg.coordinator.outcome import Effects, numbered
from vrg.coordinator.placing import Placing
from vrg.coordinator.pushing import moved
from vrg.coordinator.referee_driver import RefereeDriver
from vrg.coordinator.rulebook import Observation, Offer, RuleBook
from vrg.coordinator.sight import views
from vrg.errors import JournalError
from vrg.hal.estop import EstopOrders

log = logging.getLogger(__name__)

PERIOD = 0.1
"""The match time in s between two looks at the field."""
ADOPTING = 1.0
"""The match time in s after a release in which others may still report the emergency stop that was released."""
STALL_TICKS = 20
"""The ticks in real time (one in 0.1 s) for which a virtual match goes on without its clock, or without poses."""
OFFERS_LIMIT = 20
"""The number of bids of one player that the referee looks at in a tick."""
DISK_TIMEOUT = 1.0
"""The match time in s for which play goes on while a disk stalls, and what was called is not announced."""
RECORD_PERIOD = 1.0
"""The match time in s between two records of changes without a call, such as that an intruder is seen."""


class Coordinator(Node):
    """Runs one match. It may stop all robots. It drives only those that the rules want it to drive, by a lease.

    Args:
        mailbox: the node's own mailbox. keys: the keys of the match.
        book: the rule book.
        journal: the open journal, or one that keeps nothing. If it has a standing, the match continues from there, in
            HALT.
        driver: works out how robots are driven that the rules want to be driven.
        sight: how far a team sees from each of its robots, m; None if everybody sees everybody.
        disqualify: True disqualifies a player that falls silent in play; False halts the match.
        fused: the players whose robots the fusion centre locates.
        period: the match time between ticks, s.
    """

    kind = "coordinator"

    def __init__(
        self,
        mailbox: Mailbox,
        keys: Keys,
        book: RuleBook[Any],
        journal: Journal | NoJournal,
        *,
        driver: RefereeDriver | None = None,
        sight: float | None = None,
        disqualify: bool = True,
        fused: Collection[str] = (),
        period: float = PERIOD,
    ) -> None:
        super().__init__("referee", mailbox, period)
        self._keys = keys
        mailbox.deferring = [keys.referee_state]
        self._journal = journal
        standing = journal.standing
        self.match = Match(book, standing)
        self._entries: list[Entry] = [Began(standing=standing)]
        self._driver = driver or RefereeDriver({})
        self._sight = sight
        self._bodies: dict[str, Body] = {}
        self._limits = _limits(book)
        self._names = self.match.names
        self._playing = frozenset(self._names)
        self._poses = mailbox.subscribe(keys.poses, sampled=True)
        self._located = mailbox.subscribe(keys.robot_pose(), only=[keys.robot_pose(name).key for name in fused])
        self._clock = mailbox.subscribe(keys.clock, sampled=True)
        self._disqualify = disqualify
        self._bids = mailbox.subscribe(keys.bid(), only=[keys.bid(name).key for name in self._names])
        self._sightings = mailbox.subscribe(keys.sightings(), only=[keys.sightings(name).key for name in self._names])
        self._attendance = Attendance(mailbox, keys, self._names)
        self._placing = Placing(mailbox, keys)
        self._officials = mailbox.subscribe(keys.official)
        self._estops = EstopOrders(mailbox, keys)
        self._estop = False
        self._stalled = 0
        self._released_at = -math.inf
        self._world: tuple[int, int] | None = None
        self._last_time: float | None = None
        self._field = Observation({})
        self._unsaved: list[Effects] = []
        self._writing: list[Effects] = []
        self._calls: list[Call] = []
        self._up_to_date = math.inf
        self._in_play: bool | None = None
        self._record_at = -math.inf
        self._state = self.match.state(self._field, estop=False)

    def judge_by(self, book: RuleBook[Any]) -> None:
        """Judge by another rule book of the same game from now on."""
        self.match.judge_by(book)
        self._limits = _limits(book)

    def tick(self, tick: Tick) -> None:
        """Look at the field, hear everybody, judge, write the journal, and publish the state."""
        idle = self.match.halted is not None or self.match.over
        # What waits for the journal was decided in the gap; all that is decided from here on can be judged again.
        if not self._unsaved and self._journal.resume():
            self._entries = [resumed(self.match)]
        self._look(tick.time)
        alarms = [self._hear_estops(tick.time), self._hear_world(), self._adopt_estop(tick)]
        present, halts = self._check_presence(tick)
        alarms += halts
        absent = self._absent(tick)
        outcomes = [*alarms, *present, *self._hear_answers(), *self._hear_officials(tick, absent, alarmed=any(alarms))]
        dt = 0.0 if self._last_time is None or not tick.live else max(0.0, tick.time - self._last_time)
        self._last_time = tick.time
        outcomes.append(self._apply(Looked(dt, absent)))
        if not idle or len(self._entries) > 1:
            # Where play was halted, or is over, nothing is judged.
            self._journal.record_evidence(tick.time, self._field, self._entries)
        self._entries = []
        if self._record(tick.time, [o for o in outcomes if o]):
            self._state = self._with_driven(self.match.state(self._field, self._estop), tick.time)
        elif self.match.halted is not None or tick.time - self._up_to_date > DISK_TIMEOUT:
            # A decision that is not on disk is not published. The last state is published instead, as halted.
            self._state = _held(self._state, self.match.halted or "the journal waits for the disk")
        self._publish()

    def _apply(self, entry: Entry) -> Effects:
        """Do something to the match, and keep it as evidence."""
        self._entries.append(entry)
        return apply(self.match, entry, self._field)

    def _with_driven(self, state: RefereeState, now: float) -> RefereeState:
        """The state with the motions of the robots that the coordinator drives."""
        driven = {} if self._estop else self.match.driven
        return self._driver.with_twists(state, driven, self._bodies, now)

    def _publish(self) -> None:
        """Publish the state: all of it to everybody, or in a match with a limited view the poses to those who see."""
        state = structs.replace(self._state, unproved=True) if self._journal.gap else self._state
        if self._in_play is not (in_play := state.stage is Stage.PLAY_ROUND):
            # To its mark each robot drives as fast as it can.
            self._in_play = in_play
            for name, (own, limit) in self._limits.items():
                v_max = limit if in_play else own
                self.mailbox.publish(self._keys.speed_limit(name), SpeedLimit(v_max=v_max))
        if self._sight is not None:
            state, sights = views(state, self._sight)
            for team, sight in sights.items():
                self.mailbox.publish(self._keys.sight(team), sight)
        self.mailbox.defer([self._keys.referee_state], lambda: [state])

    def _look(self, now: float) -> None:
        offers = _at_most(OFFERS_LIMIT, [Offer(name_in(r.key), r.body.lot, r.body.cost) for r in self._bids.take()])
        sightings = [(name_in(r.key), seen) for r in self._sightings.take() for seen in r.body.seen]
        received = self._poses.news()
        if received is None:
            self._field = replace(self._field, offers=offers, sightings=sightings)
        else:
            bodies = {b.name: b for b in received.body.bodies if b.name in self._playing}
            self._bodies = bodies
            moving = frozenset(name for name, body in bodies.items() if not at_rest(body.twist))
            physical = frozenset(name for name, body in bodies.items() if body.physical)
            poses = {name: body.pose for name, body in bodies.items()}
            pushed = self._pushed(bodies, self._field) if self.match.stage is Stage.PLAY_ROUND else frozenset()
            known = {name: body.uncertainty for name, body in bodies.items() if body.uncertainty is not None}
            things = {thing.name: thing for thing in sorted(received.body.things, key=lambda thing: thing.name)}
            self._field = Observation(poses, moving, physical, received.stamp, pushed, offers, sightings, known, things)
            lost = [name for name, body in bodies.items() if body.physical and body.age > POSE_TIMEOUT]
            self._attendance.lost = lost + [name for name in self._unseen(now) if name not in physical]

    def _unseen(self, now: float) -> list[str]:
        """The players whose robots the fusion centre has lost, or of which it has published nothing for a while."""
        poses = self._located.by_key.values()
        return [name_in(r.key) for r in poses if r.body.lost or now - r.stamp > POSE_TIMEOUT]

    def _pushed(self, bodies: Mapping[str, Body], before: Observation) -> frozenset[str]:
        """The players that an opponent pushes. The wheels of all of them have stood since the look before."""
        fields = before, Observation({name: body.pose for name, body in bodies.items()})
        return frozenset(n for n in moved(bodies, before) if any(self.match.touched(n, field) for field in fields))

    def _hear_estops(self, now: float) -> Effects:
        order = self._estops.take()
        if order is None:
            return Effects()
        self._estop = isinstance(order, Estop)
        if not self._estop:
            self._released_at = now
            return Effects()
        why = f": {order.reason}" if order.reason else ""
        return self._apply(Halted(f"emergency stop by {order.by}{why}", EMERGENCY_STOP))

    def _hear_world(self) -> Effects:
        clock = self._clock.latest
        if clock is None:
            return Effects()
        since, self._world = self._world, (clock.body.epoch, clock.body.tick)
        if since is not None and (since[0] != clock.body.epoch or since[1] > clock.body.tick):
            return self._apply(Halted("the world was restarted and continues from its snapshot"))
        return Effects()

    def _adopt_estop(self, tick: Tick) -> Effects:
        """Take over an emergency stop that others have latched but that this process has not heard."""
        if self._estop or tick.time - self._released_at <= ADOPTING:
            return Effects()
        clock = self._clock.latest
        holders = ["the world"] if clock is not None and clock.body.estop else []
        holders += self._attendance.estop_holders(tick)
        if not holders:
            return Effects()
        self._estop = True
        return self._apply(Halted(f"emergency stop, latched in {holders[0]}", EMERGENCY_STOP))

    def _hear_answers(self) -> list[Effects]:
        """Take in the world's answers to requests to place robots."""
        return [self._apply(Answered([answer])) for answer in self._placing.hear()]

    def _hear_officials(self, tick: Tick, absent: Sequence[str], alarmed: bool) -> list[Effects]:
        """Apply what officials decide, halts first.

        If something has halted play in this tick, officials decided without knowing it: play is then not resumed.
        """
        officials = [received.body for received in self._officials.take()]
        if not officials:
            return []
        halts = [o for o in officials if o.action is OfficialAction.HALT]
        silent = [name for name in self._names if not self._attendance.reports_now(name, tick)]
        outcomes = [self._apply(Decided(o, list(absent), silent)) for o in halts]
        if alarmed or halts:
            absent = [*absent, "play was halted at the same moment: ask again"]
        others = [o for o in officials if o.action is not OfficialAction.HALT]
        return [*outcomes, *(self._apply(Decided(o, list(absent), silent)) for o in others)]

    def _absent(self, tick: Tick) -> list[str]:
        reasons = [] if tick.live else [_stopped(tick)]
        if tick.live and (stale := self._stale(tick)):
            reasons.append(stale)
        if self._estop:
            reasons.append("the emergency stop is engaged: an official releases it")
        needed, passing = self._attendance.absent(tick, self.match.disqualified, estop=self._estop)
        # Reasons that need a person come first, because short messages name the first reason only.
        return [*reasons, *needed, *passing]

    def _stale(self, tick: Tick) -> str | None:
        """Says that the poses are too old to judge by; None if they are not."""
        # A world that runs as fast as possible may be a hundred times as fast as real time.
        limit = POSE_TIMEOUT if self._field.physical else STALL_TICKS * PERIOD * max(1.0, self._rate or 100.0)
        age = tick.time - self._field.time
        return f"no poses arrive: the newest are older than {limit:g} s" if self._bodies and age > limit else None

    @property
    def _rate(self) -> float:
        """The match seconds per real second."""
        return self._clock.latest.body.rate if self._clock.latest is not None else 1.0

    def _check_presence(self, tick: Tick) -> tuple[list[Effects], list[Effects]]:
        """Find the players that are out or back again; and halts for reasons outside the rules: no clock, a faulty
        robot, a lost pose."""
        if tick.live:
            self._stalled = 0
            self._attendance.listen(tick, 0.0 if self._last_time is None else max(0.0, tick.time - self._last_time))
        elif self._clock.latest is not None:
            # In a world that stalls for a moment time stands still for everybody; only physical robots go on.
            self._stalled += 1
            halts = self._stalled > STALL_TICKS or bool(self._field.physical)
            return [], [self._apply(Halted(_stopped(tick)))] if halts else []
        match = self.match
        may_return = [name for name, d in match.disqualified.items() if not (d.by_official or d.returns)]
        changes = [self._apply(Reinstated(name)) for name in self._attendance.back(tick, may_return)]
        if match.stage is not Stage.PLAY_ROUND or match.halted is not None:
            return changes, []
        failing = self._attendance.flooding(match.disqualified)
        silent, reasons = self._attendance.failing(
            tick, {*match.disqualified, *failing}, rate=self._rate, patient=self._disqualify
        )
        if stale := self._stale(tick):
            reasons.append(stale)
        left = [name for name in self._names if name not in match.disqualified and name not in failing]
        if silent and len(silent) == len(left):
            # It is not each of them that has failed, but what they have in common.
            reasons.append("no player reports")
        else:
            failing |= silent
        if self._disqualify:
            changes += [self._apply(Disqualified(name, f"it {why}")) for name, why in failing.items()]
        else:
            reasons += [f"{name} {why}" for name, why in failing.items()]
        return changes, [self._apply(Halted(reason)) for reason in reasons]

    def _record(self, time: float, outcomes: list[Effects]) -> bool:
        """Write the outcomes to the journal, then announce them; return whether the journal is up to date.

        If they cannot be written, the match is halted and the next tick tries again.
        """
        self._unsaved += outcomes
        try:
            settled = self._journal.settled()
            if settled:
                self._announce()
                if self._unsaved:
                    self._append(time)
                    settled = self._journal.settled()
                    if settled:
                        self._announce()
                else:
                    self._record_silently(time)
        except JournalError as error:
            settled = not (self._writing or self._unsaved)  # only what need not survive exactly is missing
            halted = Effects() if settled else self._apply(Halted(str(error)))
            if halted:
                log.error("%s", error)
                self._unsaved.append(halted)
        if settled:
            self._up_to_date = time
            self._journal.mark(*self.match.clocks)
        return settled

    def _append(self, time: float) -> None:
        """Begin to write the outcomes that are not saved."""
        clock, *_ = self.match.clocks
        self._calls = numbered(self._unsaved, self.match.calls, clock, self._field.uncertainty)
        self.match.calls += len(self._calls)
        stages = [stage for outcome in self._unsaved for stage in outcome.stages]
        self._writing, self._unsaved = self._unsaved, []
        self._journal.append(time, stages, self._calls, self.match.standing())

    def _announce(self) -> None:
        """Let follow what is on disk."""
        for outcome in self._writing:
            self._act(outcome)
        for announced in self._calls:
            log.info("%s: %s", announced.rule, announced.text)
            self.mailbox.publish(self._keys.referee_event, announced)
        self._writing, self._calls = [], []

    def _record_silently(self, time: float) -> None:
        """Write what has changed without a call, once per RECORD_PERIOD: it must survive a crash, but not exactly."""
        last = self._journal.last
        if last is None or time < max(last.time + RECORD_PERIOD, self._record_at):
            return
        standing = self.match.standing()
        if standing.game == last.standing.game:
            return
        self._record_at = time + RECORD_PERIOD
        self._journal.append(time, [], [], standing)

    def _act(self, outcome: Effects) -> None:
        """Send the world and the robots the requests that follow from an outcome."""
        self._placing.ask(outcome)
        for name, pose in outcome.placed.items():
            self.mailbox.publish(self._keys.placed(name), Placed(pose=pose, by=outcome.by))
        for name in outcome.recover:
            self.mailbox.publish(self._keys.recover(name), Recover(by=outcome.by))


def _at_most(limit: int, offers: Sequence[Offer]) -> list[Offer]:
    """The newest offers, at most so many of each bidder, in their order."""
    kept: list[Offer] = []
    counts: Counter[str] = Counter()
    for offer in reversed(offers):
        counts[offer.bidder] += 1
        if counts[offer.bidder] <= limit:
            kept.append(offer)
    return kept[::-1]


def _held(state: RefereeState, halted: str) -> RefereeState:
    return structs.replace(state, halted=halted, players=standing_still(state.players))


def _limits(book: RuleBook[Any]) -> dict[str, tuple[float, float]]:
    """The top speed of each player's robot that the rules slow down, and the one that they allow, m/s."""
    return {name: (book.contestants[name].v_max, limit) for name, limit in book.speed_limits().items()}


def _stopped(tick: Tick) -> str:
    """The reason why a tick is not live, in words."""
    return f"the referee did not run for {tick.frozen:.1f} s" if tick.frozen else "the world's clock has stopped"
