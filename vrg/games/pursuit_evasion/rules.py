"""The rules of robot pursuit-evasion (thesis 4.2, Algorithm 4.1).

Intruders cross a convex area that pursuers guard. Pursuers stand at their posts and watch. When an intruder has been
seen twice, the referee auctions it, and the pursuer with the lowest bid is dispatched. Pursuers score a capture, and
intruders an escape. Then the players are reset: the intruder is put back to where it started, if its robot is a virtual
one, and the pursuer drives back to its post. A pursuer that reports what it has not seen is ignored for a while, and an
intruder that does not drive straight on at its top speed counts as captured. No player learns the true pose of an
intruder in play, nor that of a pursuer, except in the calls that it is dispatched and that it captures another.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from msgspec import structs

from vrg.bus.messages import PlayerStatus, Sighting, Stage, Zone
from vrg.coordinator.rulebook import (
    MARK_TOLERANCE,
    Call,
    Contestant,
    Observation,
    RuleBook,
    Verdict,
    away,
    called,
    on_marks,
)
from vrg.errors import ConfigError
from vrg.games.pursuit_evasion import (
    AREA,
    CAPTURED,
    CROSSING,
    ESCAPED,
    GAME,
    INTRUDER,
    INTRUDERS,
    OUT,
    PURSUER,
    PURSUERS,
    RETURNING,
    SCOUT,
    SCOUTING,
    SIGHTINGS_AT_ONCE,
    WAITING,
    WATCHING,
)
from vrg.games.pursuit_evasion.crossing import COURSE_REACH, across, along, ends_of
from vrg.games.pursuit_evasion.dispatching import DETECTIONS, dispatch, reset
from vrg.games.pursuit_evasion.seeing import SIGHTING_REACH, can_see, nearest
from vrg.games.pursuit_evasion.settings import Settings, problems_of
from vrg.games.pursuit_evasion.state import State
from vrg.geometry import circumradius, outline_distance, wrap

HEADING_REACH = math.radians(10)
"""The angle in rad to its course within which an intruder is lined up."""
FALSE_REPORT_PENALTY = 5.0
"""The time in s for which a pursuer's reports do not count, after it has reported a place where no robot was."""
START = 2.0
"""The time in s that an intruder has to get up its speed."""
STRETCH = 5.0
"""The time of play in s over which an intruder's speed is judged: a computer that stalls for a moment stops it, too."""
MIN_APPROACH = 0.6
"""The share of its top speed at which an intruder comes forward at least."""
TOUCH_DISTANCE = 0.05
"""The distance in m between two outlines up to which two robots touch."""
PLACE_PERIOD = 5.0
"""The time in s after which a robot that is out of play, and for which there was no room at its start, is put there."""


FIRST = {PURSUER: WATCHING, INTRUDER: WAITING, SCOUT: SCOUTING}
"""The state in which each role begins."""


class PursuitEvasion(RuleBook[State]):
    """The rule book of pursuit-evasion.

    Args:
        settings: the [rules] table of the match file.
        contestants: the players. The first intruder among them starts at 0 s.
        seed: the seed of the match, by which the other intruders' times are drawn.

    Raises:
        ConfigError: the match cannot be played; see `problems_of`. The error lists all reasons.
    """

    name = GAME.name
    round_word = GAME.round_word
    state_type = State

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int = 0) -> None:
        super().__init__(contestants)
        self.settings = settings
        self.area = settings.region
        if problems := problems_of(self.area, contestants, settings.capture_distance):
            raise ConfigError(problems)
        self.pursuers = sorted(c.name for c in contestants if c.role == PURSUER)
        self.scouts = sorted(c.name for c in contestants if c.role == SCOUT)
        self.intruders = [c.name for c in contestants if c.role == INTRUDER]
        self.posts = {name: self.contestants[name].start for name in self.pursuers}
        self.launches = {name: self._launch(name, seed) for name in self.intruders}
        self.lineup_limit = settings.patience

    def _launch(self, name: str, seed: int) -> float:
        """The time of play at which an intruder starts, s."""
        if name == self.intruders[0]:
            return 0.0
        rng = np.random.default_rng([seed, *name.encode()])
        return float(rng.uniform(0.0, self.settings.launch_window))

    def initial(self) -> State:
        """The state in which pursuers watch and intruders wait."""
        return State(
            states={c.name: FIRST[c.role] for c in self.contestants.values()},
            points={PURSUERS: 0, INTRUDERS: 0},
        )

    def obstacles_to_start(self, state: State, now: Observation) -> dict[str, str]:
        """The reasons why a player does not yet stand still where it starts, by player.

        An intruder must also head where it is to go, because its heading is its course.
        """
        reasons = super().obstacles_to_start(state, now)
        for name in self.intruders:
            if name in now.poses and name not in reasons:
                off = wrap(now.poses[name].theta - self.contestants[name].start.theta)
                if abs(off) > HEADING_REACH:
                    reasons[name] = f"is turned {math.degrees(off):.0f} degrees away from its course"
        return reasons

    def judge(self, state: State, before: Observation, now: Observation, clock: float) -> Verdict[State]:
        """Judge the whole way between two instants: who starts, is seen, captured or escapes, and who is dispatched."""
        calls: list[Call] = []
        was = state.states
        state = self._launched(state, clock, calls).looked(before, now, clock)
        state = self._detected(state, now, clock, calls)
        state = self._ended(state, before, now, calls)
        state = self._collided(state, now, calls)
        state = self._strayed(state, now, clock, calls)
        state = dispatch(state, self.pursuers, now, clock, self.settings, calls)
        back = on_marks(self.posts, now) - now.moving
        state = state.with_state([n for n in state.in_state(RETURNING) if n in back], WATCHING)
        done = state.in_state(CAPTURED, ESCAPED, OUT)
        if int(clock / PLACE_PERIOD) == int((clock - max(0.0, now.time - before.time)) / PLACE_PERIOD):
            done = [name for name in done if was[name] != state.states[name]]
        starts = {name: self.contestants[name].start for name in done if name in now.poses}
        place = {name: start for name, start in starts.items() if away(now.poses[name], start) > MARK_TOLERANCE}
        left = state.in_state(WAITING, CROSSING)
        if left and clock < self.settings.time - 1e-9:
            return Verdict(state, calls, place=place)
        if left:
            calls.append(Call(rule="time_up", text=f"the time is up: {', '.join(sorted(left))} did not make it"))
        else:
            calls.append(Call(rule="all_done", text="no intruder is left"))
        return Verdict(state, calls, round_over=True, place=place)

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        """End the game after its round: the team with more points has won."""
        left = sorted(state.in_state(WAITING, CROSSING))
        # An official may have put one back after the end of play, before the time was up.
        why = (
            f"{', '.join(left)} had not crossed when play ended"
            if left
            else "all intruders are captured, escaped or out"
        )
        return replace(super().next_round(state, now), why=why)

    def _launched(self, state: State, clock: float, calls: list[Call]) -> State:
        due = [name for name in state.in_state(WAITING) if self.launches[name] <= clock]
        calls += [Call(rule="launch", text=f"{name} starts", players=(name,)) for name in due]
        return state.with_state(due, CROSSING)

    def _detected(self, state: State, now: Observation, clock: float, calls: list[Call]) -> State:
        """Count the sightings of intruders in play that a pursuer's own laser, or a scout's camera, can have made.

        A sighting of any other robot is neither counted nor a false alarm.
        """
        reports: dict[str, list[Sighting]] = {}
        for who, sighting in now.sightings:
            reports.setdefault(who, []).append(sighting)
        seers = (*self.pursuers, *self.scouts)
        for who in (name for name in seers if name in reports and name not in state.disqualified):
            # A player that reports too many at once is guessing: a scan shows a few robots at most.
            if len(reports[who]) > SIGHTINGS_AT_ONCE:
                continue
            silenced = state.silenced.get(who, 0.0) > clock
            timely = [(each, poses) for each in reports[who] if (poses := state.poses_at(each.time)) is not None]
            if any(nearest(each, set(poses) - {who}, poses)[0] > SIGHTING_REACH for each, poses in timely):
                state = structs.replace(state, silenced={**state.silenced, who: clock + FALSE_REPORT_PENALTY})
                if not silenced:
                    penalty = f"for {FALSE_REPORT_PENALTY:g} s its reports do not count"
                    text = f"{who} reported a robot where there was none: {penalty}"
                    calls.append(Call(rule="false_alarm", text=text, players=(who,)))
            elif not silenced:
                for each, poses in timely:
                    gap, whom = nearest(each, state.crossing(), poses)
                    if gap <= SIGHTING_REACH and can_see(who, whom, poses, self.contestants, self.walls):
                        state = state.with_sighting(whom, each, clock)
        return state

    def _ended(self, state: State, before: Observation, now: Observation, calls: list[Call]) -> State:
        """Captures and escapes, each at its instant. At the same instant a capture comes first."""
        there = [name for name in self.pursuers if name not in state.disqualified]
        reach = self.settings.capture_distance
        for name, course in state.courses.items():
            entered, theta = name in state.entered, course.pose.theta
            ends = ends_of(name, there, before, now, self.area, reach, course=theta, entered=entered)
            if ends.inside and name not in state.entered:
                state = structs.replace(state, entered=tuple(sorted([*state.entered, name])))
                calls.append(Call(rule="enter", text=f"{name} is in the area", players=(name,)))
            if ends.captured is not None:
                by = ends.captured
                where = {name: by.intruder_pose, by.pursuer: by.pursuer_pose}
                calls.append(called("capture", f"{name} is captured by {by.pursuer}", where))
                state = state.with_state([name], CAPTURED).scored(PURSUERS)
            elif ends.left is not None and name not in state.entered:
                calls.append(called("missed", f"{name} passes by the area and is out", {name: ends.left}))
                state = state.with_state([name], OUT)
            elif ends.left is not None:
                after = f"{'two or more' if state.detections(name) >= DETECTIONS else 'fewer than two'} detections"
                calls.append(called("escape", f"{name} escapes after {after}", {name: ends.left}))
                state = state.with_state([name], ESCAPED).scored(INTRUDERS)
            else:
                continue
            state = reset(state, name)
        return state

    def _collided(self, state: State, now: Observation, calls: list[Call]) -> State:
        """Put robots out of play that touch another one. Two that touch each other are both out."""
        for name in (name for name in state.crossing() if name in now.poses):
            pose, size = now.poses[name], self.contestants[name].size
            near = circumradius(size) + TOUCH_DISTANCE
            gaps = {
                n: outline_distance(pose, p, size, body.size)
                for n, p in now.poses.items()
                if n != name
                and n not in self.scouts
                and (body := self.contestants.get(n)) is not None
                and math.hypot(p.x - pose.x, p.y - pose.y) <= near + circumradius(body.size)
            }
            other = min(gaps, key=lambda n: (gaps[n], n), default=name)
            if other != name and gaps[other] <= TOUCH_DISTANCE:
                text = f"{name} touches {other} and is out"
                calls.append(Call(rule="collision", text=text, players=(name, other), poses=(pose,)))
                state = reset(state.with_state([name], OUT), name)
        return state

    def _strayed(self, state: State, now: Observation, clock: float, calls: list[Call]) -> State:
        """An intruder that does not drive straight on at its top speed counts as captured."""
        for name in (name for name in state.crossing() if name in now.poses):
            course, pose = state.courses[name], now.poses[name]
            rule, text = "", ""
            if abs(across(course.pose, pose)) > COURSE_REACH:
                rule, text = "off_course", f"{name} has left its course"
            elif course.mark is None or clock >= course.mark[0] + STRETCH - 1e-6:
                if course.mark is not None:
                    way = along(course.pose, pose) - along(course.pose, course.mark[1])
                    if way < self.least_way(name, clock - course.mark[0]):
                        rule, text = "slow", f"{name} does not keep its speed"
                if not rule and clock >= course.since + START - 1e-6:
                    course = structs.replace(course, mark=(clock, pose))
                    state = structs.replace(state, courses={**state.courses, name: course})
            if rule:
                calls.append(called(rule, f"{text}: it counts as captured", {name: pose}))
                state = state.with_state([name], CAPTURED).scored(PURSUERS)
                state = reset(state, name)
        return state

    def least_way(self, name: str, seconds: float) -> float:
        """The distance in m by which an intruder in play has to come forward at least in a time."""
        return MIN_APPROACH * self.speed_limits()[name] * seconds

    def team_of(self, name: str) -> str:
        """The team of a player."""
        return INTRUDERS if self.contestants[name].role == INTRUDER else PURSUERS

    def statuses(self, state: State, stage: Stage, now: Observation) -> list[PlayerStatus]:
        """The status of each player.

        A pose is published only of robots out of play, so that others avoid them and do not take them for intruders.
        The starts of intruders are not published.
        """
        lining_up, playing = stage is Stage.INITIALIZE, stage is Stage.PLAY_ROUND
        misplaced = self.obstacles_to_start(state, now) if lining_up else {}
        statuses = []
        for name, contestant in self.contestants.items():
            chases, own = contestant.role != INTRUDER, state.states[name]
            out = GAME.is_out(own) or name in state.disqualified
            statuses.append(
                PlayerStatus(
                    name=name,
                    team=self.team_of(name),
                    role=contestant.role,
                    state=own,
                    may_move=name in misplaced if lining_up else playing and not out and own not in (WATCHING, WAITING),
                    radius=circumradius(contestant.size),
                    # Where an intruder waits tells its course, also if it is disqualified for now.
                    pose=now.poses.get(name) if out and own != WAITING else None,
                    mark=self.posts.get(name, contestant.start if name in misplaced else None) if chases else None,
                )
            )
        return statuses

    def zones(self, state: State) -> list[Zone]:
        """The area that the pursuers guard."""
        return [Zone(name="surveillance area", kind=AREA, region=self.area)]

    def time_limit(self, state: State) -> float:
        """The time of play in s at which the game ends at the latest."""
        return self.settings.time

    def speed_limits(self) -> dict[str, float]:
        """The same top speed for all on the ground, that of the slowest robot, unless the match file has another."""
        slowest = min(c.v_max for c in self.contestants.values() if c.role != SCOUT)
        own = {PURSUER: self.settings.pursuer_speed or slowest, INTRUDER: self.settings.intruder_speed or slowest}
        return {name: min(c.v_max, own.get(c.role, c.v_max)) for name, c in self.contestants.items()}

    def states_of(self, name: str) -> Sequence[str]:
        """The states into which an official may put an intruder. Those of pursuers follow from theirs."""
        return (WAITING, CROSSING, CAPTURED, ESCAPED, OUT) if name in self.launches else ()

    def put_into(self, state: State, name: str, value: str) -> State:
        """The state after an official has put an intruder into another one."""
        state = state.with_state([name], value)
        if value in (WAITING, CROSSING):
            state = state.unseen(name)
        return state if value == CROSSING else reset(state, name)
