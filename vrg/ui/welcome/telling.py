"""Problems of a draft in words."""

from vrg.errors import Problem
from vrg.ui.welcome.draft import Draft


def said(problem: Problem, draft: Draft) -> str:
    """A problem in words, with the name of the field and of the player that it is about."""
    parts = [str(part) for part in problem.path]
    match problem.path:
        case ("players", int(player), *rest) if player < len(draft.players):
            parts = [draft.players[player].name or str(player + 1), *map(str, rest)]
            if problem.text.startswith(parts[0]) and not rest:
                parts = []
    if not parts and problem.line is not None and not problem.path:
        parts = [f"line {problem.line}"]
    where = " ".join(parts)
    return f"{where}: {problem.text}" if where else problem.text
