"""Diagrams of automata as Mermaid statecharts."""

from typing import Any

from vrg.agents.charon import Agent


def mermaid(agent: Agent[Any, Any]) -> str:
    """Return the text of an agent's `stateDiagram-v2`: modes as composite states, events on arrows, ports as a note."""
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
