"""Automata: what fires, in which order, and how they are drawn."""

from dataclasses import dataclass

import pytest

from vrg.agents.charon import Agent, Automaton, Mode, Submode, Transition, mermaid
from vrg.errors import ConfigError


@dataclass
class Signals:
    """What the guards look at."""

    go: bool = False
    turn: bool = False
    tagged: bool = False


def _says(word: str) -> Submode[Signals, str]:
    return Submode(word, lambda _s: word)


@pytest.fixture
def agent() -> Agent[Signals, str]:
    return Agent(
        name="Walker",
        modes=[
            Mode(
                "Free",
                [_says("Rest"), _says("Walk"), _says("Turn")],
                [
                    Transition("Rest", "Walk", "Go", lambda s: s.go),
                    Transition("Walk", "Turn", "Corner", lambda s: s.turn),
                ],
            ),
            Mode("Caught", [_says("Freeze")]),
        ],
        transitions=[
            Transition("Free", "Caught", "Tagged", lambda s: s.tagged),
            Transition("Caught", "Free", "Released", lambda s: not s.tagged),
        ],
        initial=lambda _s: "Free",
        starts=[("Free", "Start")],
        inputs=["pose"],
        outputs=["twist"],
    )


@pytest.fixture
def automaton(agent: Agent[Signals, str]) -> Automaton[Signals, str]:
    return Automaton(agent)


def test_a_mode_is_entered_at_its_first_submode_also_after_a_restart(automaton: Automaton[Signals, str]) -> None:
    assert automaton.where == "-"
    assert automaton.step(Signals(turn=True)) == "Rest", "an event that belongs to another place does nothing"
    assert automaton.where == "Free/Rest"
    automaton.step(Signals(go=True))
    automaton.restart()
    assert automaton.step(Signals()) == "Rest"


def test_one_inner_transition_a_step(automaton: Automaton[Signals, str]) -> None:
    both = Signals(go=True, turn=True)
    assert [automaton.step(both) for _ in range(3)] == ["Walk", "Turn", "Turn"]


def test_outer_events_come_first(automaton: Automaton[Signals, str]) -> None:
    automaton.step(Signals(go=True))
    assert automaton.step(Signals(turn=True, tagged=True)) == "Freeze"
    assert automaton.step(Signals()) == "Rest", "a mode that is entered again begins anew"


def test_everything_wrong_with_a_declaration_is_told() -> None:
    with pytest.raises(ConfigError) as error:
        Agent(
            name="Bad",
            modes=[Mode("A", [_says("x"), _says("x")]), Mode("B", [])],
            transitions=[Transition("A", "C", "Event", lambda _s: True)],
            initial=lambda _s: "A",
            starts=[("D", "Start")],
        )
    text = str(error.value)
    for part in ("'x' is declared twice", "'C', which is none of A, B", "at least one submode", "unknown mode 'D'"):
        assert part in text


def test_the_diagram_is_drawn_from_what_runs(agent: Agent[Signals, str]) -> None:
    lines = [line.strip() for line in mermaid(agent).splitlines()]
    assert lines[0] == "stateDiagram-v2"
    assert "[*] --> Free: Start" in lines
    assert "Free --> Caught: Tagged" in lines
    assert "Free_Rest --> Free_Walk: Go" in lines
    assert "in: pose" in lines
