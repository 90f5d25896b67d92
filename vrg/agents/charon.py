"""Hybrid automata in the notation of CHARON (thesis 2.4).

An agent has modes, a mode has submodes. A submode holds continuous control; control passes along transitions, each
named by the event that triggers it. Ports are what an agent reads and writes. Declared as data, so that a diagram is
drawn from what runs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from vrg.errors import ConfigError

V = TypeVar("V")
"""What guards and controls look at."""
C = TypeVar("C")
"""What controls return: the command."""


@dataclass(frozen=True)
class Transition(Generic[V]):
    """From one place to another when its event happens.

    Args:
        source, target: names of modes, or of submodes of one mode.
        event: its name, as the diagram shows it.
        when: the guard.
    """

    source: str
    target: str
    event: str
    when: Callable[[V], bool]


@dataclass(frozen=True)
class Submode(Generic[V, C]):
    """One control law."""

    name: str
    control: Callable[[V], C]


@dataclass(frozen=True)
class Mode(Generic[V, C]):
    """A strategy: submodes, the first of which is entered with the mode, and the transitions between them."""

    name: str
    submodes: Sequence[Submode[V, C]]
    transitions: Sequence[Transition[V]] = ()


@dataclass(frozen=True)
class Agent(Generic[V, C]):
    """The whole automaton.

    Args:
        initial: chooses the mode to begin in, by name.
        starts: modes that `initial` may choose, with the event that each begins with.
        inputs, outputs: its ports, for the diagram.

    Raises:
        ConfigError: a name that is used twice, or a transition from or to nowhere.
    """

    name: str
    modes: Sequence[Mode[V, C]]
    transitions: Sequence[Transition[V]]
    initial: Callable[[V], str]
    starts: Sequence[tuple[str, str]]
    inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()

    def __post_init__(self) -> None:
        problems = _check(self.name, [m.name for m in self.modes], self.transitions)
        for mode in self.modes:
            problems += _check(f"{self.name}/{mode.name}", [s.name for s in mode.submodes], mode.transitions)
            if not mode.submodes:
                problems.append(f"{self.name}/{mode.name}: expected at least one submode")
        known = {m.name for m in self.modes}
        problems += [f"{self.name}: starts in unknown mode {name!r}" for name, _ in self.starts if name not in known]
        if problems:
            raise ConfigError(problems)


def _check(where: str, names: Sequence[str], transitions: Sequence[Transition[V]]) -> list[str]:
    problems = [f"{where}: {name!r} is declared twice" for name in sorted(set(names)) if names.count(name) > 1]
    for t in transitions:
        problems += [
            f"{where}: transition on {t.event!r} names {end!r}, which is none of {', '.join(names)}"
            for end in (t.source, t.target)
            if end not in names
        ]
    return problems


class Automaton(Generic[V, C]):
    """A running agent. Where it stands is a function of what it has been shown alone."""

    def __init__(self, agent: Agent[V, C]) -> None:
        self._agent = agent
        self._modes = {mode.name: mode for mode in agent.modes}
        self.mode: str | None = None
        self.submode: str | None = None

    @property
    def where(self) -> str:
        """Such as `Minnows/Cross`; `-` before the first step."""
        return f"{self.mode}/{self.submode}" if self.mode else "-"

    def step(self, view: V) -> C:
        """Take the transitions whose events have happened, outer ones first, then run the control law.

        In one step at most one transition of each level is taken, the first in the order of declaration.
        """
        if self.mode is None:
            self._enter(self._agent.initial(view))
        else:
            outer = _fired(self._agent.transitions, self.mode, view)
            if outer is not None:
                self._enter(outer.target)
        assert self.mode is not None
        mode = self._modes[self.mode]
        inner = _fired(mode.transitions, self.submode or "", view)
        if inner is not None:
            self.submode = inner.target
        return next(s for s in mode.submodes if s.name == self.submode).control(view)

    def restart(self) -> None:
        """Begin anew at the next step: for events that are none of the automaton's own, such as an overruled call."""
        self.mode = self.submode = None

    def _enter(self, name: str) -> None:
        self.mode = name
        self.submode = self._modes[name].submodes[0].name


def _fired(transitions: Sequence[Transition[V]], source: str, view: V) -> Transition[V] | None:
    return next((t for t in transitions if t.source == source and t.when(view)), None)
