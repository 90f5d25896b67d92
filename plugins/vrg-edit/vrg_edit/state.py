"""The state of the configurator's page, as plain data. The page draws it with what draws a running match."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

from vrg.errors import Path
from vrg.games import GAMES, game_of, look
from vrg.hal.backends import BACKENDS
from vrg.types import Pose
from vrg.ui.scene import Scene, SceneBody
from vrg.ui.web import parts
from vrg_edit.checking import CheckResult, fields_of, problem_text
from vrg_edit.choices import Choices
from vrg_edit.draft import COLUMNS, SETTINGS, Draft
from vrg_edit.placing import robot_size
from vrg_edit.rules import rules_of

LABELS: Final = {"on_fault": "on fault", "model": "robot", "x": "x, m", "y": "y, m", "heading": "heading, °"}
"""The labels of fields that are not their names."""
UNITS: Final = {"rate": "match s per s", "memory": "MB a player", "sight": "m"}
"""The units of the match's numbers."""


def match_state(draft: Draft, verdict: CheckResult, choices: Choices) -> dict[str, Any]:
    """A draft with its fields, its problems, and the picture of its field."""
    scene, numbers = scene_of(draft, verdict)
    return {
        "title": game_of(draft.game).title or draft.game,
        "settings": [_field(draft, (name,), choices.of(draft, name), bounds=UNITS.get(name, "")) for name in SETTINGS],
        "rules": [
            _field(draft, rule.path, rule.choices, rule.default, rule.bounds, rule.help)
            for rule in rules_of(draft.game)
        ],
        "columns": [
            {"name": name, "label": LABELS.get(name, name), "choices": choices.of(draft, name)} for name in COLUMNS
        ],
        "players": [
            [_field(draft, ("players", number, name)) for name in COLUMNS] for number in range(len(draft.players))
        ],
        "styles": [look.badge(game_of(draft.game).style(entry.role)) for entry in draft.players],
        "problems": [
            {"text": problem_text(p, draft), "line": p.line, "fields": [_key(path) for path in fields_of(p)]}
            for p in verdict.problems
        ],
        "picture": [parts.ground(scene), parts.looks(scene), parts.state(scene), parts.frame(scene)],
        "numbers": numbers,
    }


def games() -> list[dict[str, Any]]:
    """The games with a sentence each and their roles; those first that can be won."""
    names = sorted(GAMES.names(), key=lambda name: (not game_of(name).competitive, name != "sharks-and-minnows"))
    return [
        {
            "name": name,
            "title": game.title,
            "about": game.about,
            "roles": [{"name": r.name, "sign": look.badge(game.style(r.name))} for r in game.roles],
        }
        for name in names
        if (game := GAMES.find(name)) is not None
    ]


def scene_of(draft: Draft, verdict: CheckResult) -> tuple[Scene, list[int]]:
    """The scene of a draft, and the number of the player that each body in it is of."""
    shown = [(n, entry, entry.pose) for n, entry in enumerate(draft.players) if _on_map(entry.pose, verdict)]
    bodies = tuple(
        SceneBody(
            entry.name or str(n + 1), pose, *robot_size(entry.model), entry.role, "", _physical(entry.backend), ()
        )
        for n, entry, pose in shown
        if pose is not None
    )
    scene = Scene(
        live=True,
        game=draft.game,
        bodies=bodies,
        zones=verdict.zones,
        obstacles=verdict.obstacles,
        starts=tuple((body.pose.x, body.pose.y) for body in bodies),
    )
    return scene, [n for n, _, _ in shown]


def _on_map(pose: Pose | None, verdict: CheckResult) -> bool:
    """True if a robot can be shown: one far outside would make everything else small."""
    if pose is None or verdict.bounds is None:
        return pose is not None and abs(pose.x) < 1e3 and abs(pose.y) < 1e3
    x_min, y_min, x_max, y_max = verdict.bounds.bounds
    return x_min - 3 <= pose.x <= x_max + 3 and y_min - 3 <= pose.y <= y_max + 3


def _physical(backend: str) -> bool:
    found = BACKENDS.find(backend) if backend else None
    return found is not None and found.physical


def _field(
    draft: Draft, path: Path, choices: Iterable[str] = (), default: str = "", bounds: str = "", help_: str = ""
) -> Mapping[str, Any]:
    name = str(path[-1])
    return {
        "key": _key(path),
        "label": ".".join(map(str, path[1:])) if path[0] == "rules" else LABELS.get(name, name),
        "value": draft.shown(path),
        "default": default or draft.default(path),
        "choices": list(choices),
        "bounds": bounds,
        "help": help_,
    }


def _key(path: Path) -> str:
    return ".".join(map(str, path))
