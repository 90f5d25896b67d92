"""Hybrid automata in the notation of CHARON (thesis 2.4).

An agent has modes, and a mode has submodes. A submode holds a continuous control law. Control passes along transitions,
each named by the event that triggers it. Ports are what an agent reads and writes. An automaton is declared as data, so
that a diagram can be drawn from the automaton that runs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from vrg.errors import ConfigError

V = TypeVar("V")
"""The type of what guards and control laws look at."""
C = TypeVar("C")
"""The type of the command that control laws return."""


@dataclass(frozen=True)
class Transition(Generic[V]):
    """A transition from one mode or submode to another, taken when its event happens.

    Args:
        source, target: the names of two modes, or of two submodes of one mode.
        event: the name of the event, as the diagram shows it.
        when: the guard, which returns True when the event has happened.
    """

    source: str
    target: str
    event: str
    when: Callable[[V], bool]


@dataclass(frozen=True)
class Submode(Generic[V, C]):
    """A submode: one control law under a name."""

    name: str
    control: Callable[[V], C]


@dataclass(frozen=True)
class Mode(Generic[V, C]):
    """A mode: its submodes, the first of which is entered with the mode, and the transitions between them."""

    name: str
    submodes: Sequence[Submode[V, C]]
    transitions: Sequence[Transition[V]] = ()


@dataclass(frozen=True)
class Agent(Generic[V, C]):
    """The declaration of a whole automaton.

    Args:
        modes: the modes. transitions: the transitions between the modes.
        initial: returns the name of the mode to begin in.
        starts: the modes that `initial` may choose, each with the event that it begins with, for the diagram.
        inputs, outputs: the names of its ports, for the diagram.

    Raises:
        ConfigError: a name is used twice, a mode has no submode, or a transition or a start names an unknown mode.
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
    """A running agent. Its mode and submode depend only on the views that `step` was given.

    Args:
        agent: the declaration of the automaton.
    """

    def __init__(self, agent: Agent[V, C]) -> None:
        self._agent = agent
        self._modes = {mode.name: mode for mode in agent.modes}
        self._outer = _by_source(agent.transitions)
        self._inner = {mode.name: _by_source(mode.transitions) for mode in agent.modes}
        self._controls = {(mode.name, s.name): s.control for mode in agent.modes for s in mode.submodes}
        self.mode: str | None = None
        self.submode: str | None = None

    @property
    def where(self) -> str:
        """The mode and the submode, such as `Minnows/Cross`; `-` before the first step."""
        return f"{self.mode}/{self.submode}" if self.mode else "-"

    def step(self, view: V) -> C:
        """Take the transitions whose events have happened, then run the control law of the submode.

        A step takes at most one transition between modes and then at most one between submodes: the first in the order
        of declaration whose guard is true.
        """
        if self.mode is None:
            self._enter(self._agent.initial(view))
        else:
            outer = _fired(self._outer.get(self.mode, ()), view)
            if outer is not None:
                self._enter(outer.target)
        assert self.mode is not None
        assert self.submode is not None
        inner = _fired(self._inner[self.mode].get(self.submode, ()), view)
        if inner is not None:
            self.submode = inner.target
        return self._controls[self.mode, self.submode](view)

    def restart(self) -> None:
        """Start again at the next step. Use it for events from outside the automaton, such as an overruled call."""
        self.mode = self.submode = None

    def _enter(self, name: str) -> None:
        self.mode = name
        self.submode = self._modes[name].submodes[0].name


def _by_source(transitions: Sequence[Transition[V]]) -> dict[str, list[Transition[V]]]:
    """The transitions from each mode or submode, in the order of declaration."""
    found: dict[str, list[Transition[V]]] = {}
    for transition in transitions:
        found.setdefault(transition.source, []).append(transition)
    return found


def _fired(transitions: Sequence[Transition[V]], view: V) -> Transition[V] | None:
    for transition in transitions:
        if transition.when(view):
            return transition
    return None


def mermaid(agent: Agent[Any, Any]) -> str:
    """Return the text of an agent's `stateDiagram-v2`, a statechart of Mermaid.

    Modes are composite states, events stand on arrows, and ports in a note.
    """
    lines = ["stateDiagram-v2", f"    %% {agent.name}"]
    lines += [f"    [*] --> {mode}: {event}" for mode, event in agent.starts]
    lines += [f"    {t.source} --> {t.target}: {t.event}" for t in agent.transitions]
    for mode in agent.modes:
        lines.append(f"    state {mode.name} {{")
        # The name of a submode's state begins with its mode, because no two states of a statechart may share a name.
        lines.append(f"        [*] --> {mode.name}_{mode.submodes[0].name}")
        lines += [f"        {mode.name}_{s.name}: {s.name}" for s in mode.submodes]
        lines += [f"        {mode.name}_{t.source} --> {mode.name}_{t.target}: {t.event}" for t in mode.transitions]
        lines.append("    }")
    if agent.inputs or agent.outputs:
        lines.append(f"    note right of {agent.modes[0].name}")
        lines.append(f"        in: {', '.join(agent.inputs)}")
        lines.append(f"        out: {', '.join(agent.outputs)}")
        lines.append("    end note")
    return "\n".join(lines) + "\n"
