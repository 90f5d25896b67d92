"""The game, its stage, the leader and the reason, in a few words. This draws nothing."""

from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import TIME_LIMIT, Stage
from vrg.colours import GREY, Rgb
from vrg.coordinator.rulebook import DRAW, NOBODY, wins
from vrg.figures import Shape, rounded
from vrg.games import game_of, look
from vrg.games.game import Marker, Style, capitalised, title
from vrg.ui import palette
from vrg.ui.scene import Scene, clock_text

PHYSICAL: Final = "white rim: physical robot"


@dataclass(frozen=True)
class TeamScore:
    """The score of a team: its name as people write it, its points, what they count, and its colour.

    Args:
        words: what this many points count. counts: what points of this team count.
    """

    team: str
    points: int
    words: str
    counts: str
    colour: Rgb


@dataclass(frozen=True)
class Headline:
    """The match in words.

    Args:
        title: of the game. about: what happens in it, in a sentence. stage: how far it is. colour: of the stage.
        clock: the time of play. timed: what the clock counts. left: the time that is left, in words, or empty.
        teams: the scores. count: what decides instead of them, such as `2 of 5 minnows left`, or empty.
        reason: why the score is what it is, in a sentence, or empty.
        drama: what is going on now and should not be missed, and numbers of the game, in words, or empty.
    """

    title: str
    about: str
    stage: str
    colour: Rgb
    clock: str
    timed: str
    left: str
    teams: tuple[TeamScore, ...]
    count: str
    reason: str
    drama: str


def headline(scene: Scene) -> Headline:
    """The headline of a scene."""
    game = game_of(scene.game)
    counted = f"{game.round_word} {scene.round} of {scene.rounds}" if scene.rounds > 1 else ""
    words, colour = stage_words(scene)
    limit = scene.numbers.get(TIME_LIMIT)
    left = None if limit is None else max(0.0, limit - scene.clock)
    playing = scene.stage is Stage.PLAY_ROUND
    reason = ""
    if scene.reason is not None:
        before = f"{game.round_word} {scene.reason_round}, " if scene.reason_round not in (0, scene.round) else ""
        reason = f"{before}{short_clock(scene.reason.clock)}  {scene.reason.text}"
    drama = [f"{thing.carrier} has the {thing.name}" for thing in scene.objects if thing.carrier]
    drama += [
        shown.text(scene.numbers[name], scene.clock) for name, shown in game.numbers.items() if name in scene.numbers
    ]
    if playing:
        leader = leading(scene)
        drama += [f"as it stands, {leader} {wins(leader)}"] if leader else []
        drama += [words for state, words in game.expected.items() if _stands_by(scene, state)]
    return Headline(
        title=game.title or title(scene.game) or "Waiting for the referee",
        about=game.about,
        stage=f"{words}, {counted}" if counted and scene.stage is not Stage.GAME_OVER else words,
        colour=colour,
        clock=short_clock(scene.clock),
        timed=f"of {game.round_word} {scene.round}" if scene.rounds > 1 else "time of play",
        left=f"{short_clock(left)} left" if left is not None and playing else "",
        teams=tuple(
            TeamScore(title(team), points, game.counted(team, points), game.counted(team), game.team_style(team).colour)
            for team, points in scene.score
            if game.competitive
        ),
        count=decisive_count(scene),
        reason=reason,
        drama=" · ".join(drama) if scene.stage is not Stage.GAME_OVER else "",
    )


def legend(scene: Scene) -> list[tuple[str, tuple[Shape, ...]]]:
    """The signs on the field, each with its words, as shapes in a square of side 1."""
    game, square = game_of(scene.game), rounded(0.9, 0.9, 0.2)
    signs = [(role.name, look.badge(game.style(role.name))) for role in game.roles]
    if game.out_of_play:
        signs.append(("out of play", look.badge(Style(GREY, Marker.CROSS))))
    if scene.obstacles:
        signs.append(("wall", (Shape(square, palette.WALL, palette.WALL_EDGE),)))
    if {body.physical for body in scene.bodies} == {True, False}:
        signs.append((PHYSICAL, (Shape(square, line=palette.TEXT, width=2.0),)))
    return signs


def stage_words(scene: Scene) -> tuple[str, Rgb]:
    """The stage of the match in plain words, and its colour."""
    if scene.stage is None:
        return "Waiting", palette.CALM
    if scene.stage is not Stage.GAME_OVER:
        if scene.estop:
            return "Stopped", palette.ALARM
        if scene.halted is not None:
            return "Halted", palette.CAUTION
    word = game_of(scene.game).round_word
    names = {
        Stage.INITIALIZE: "Lining up",
        Stage.PLAY_ROUND: "Playing",
        Stage.ROUND_OVER: f"{capitalised(word)} over",
        Stage.GAME_OVER: "Game over",
    }
    return names[scene.stage], palette.STAGE_COLOURS[scene.stage]


def decisive_count(scene: Scene) -> str:
    """The count that decides in place of the score, such as `2 of 5 minnows left`; empty where the score decides."""
    game = game_of(scene.game)
    role = game.role(game.decisive)
    if role is None or not scene.players:
        return ""
    left = sum(player.role == role.name and not player.out_of_play for player in scene.players)
    return f"{left} of {sum(player.team == role.team for player in scene.players)} {role.team} left"


def leading(scene: Scene) -> str:
    """The team that has won if nothing more happens; empty if there is none."""
    game = game_of(scene.game)
    role = game.role(game.decisive)
    if role is not None:
        left = any(player.role == role.name and not player.out_of_play for player in scene.players)
        return role.team if left else ""
    most = max((points for _, points in scene.score), default=0)
    best = [team for team, points in scene.score if points == most]
    return best[0] if game.competitive and len(best) == 1 < len(scene.score) else ""


def _stands_by(scene: Scene, state: str) -> bool:
    """True if players are in a state, and nobody of their team moves."""
    teams = {player.team for player in scene.players if player.state == state}
    return bool(teams) and not any(player.may_move for player in scene.players if player.team in teams)


def winner_words(scene: Scene) -> tuple[str, Rgb]:
    """The winner of a game that is over, in large letters, and its colour."""
    game = game_of(scene.game)
    if scene.ended is not None or not game.competitive:
        return "GAME OVER", palette.LOST
    if scene.winner in (None, NOBODY, DRAW):
        return ("A DRAW" if scene.winner == DRAW else "NO WINNER"), palette.LOST
    return f"{title(scene.winner)} {wins(scene.winner)}".upper(), game.team_style(scene.winner).colour


def result_lines(scene: Scene) -> tuple[str, ...]:
    """Why a game is over, and how it stands, in sentences."""
    game = game_of(scene.game)
    head = headline(scene)
    why = (
        capitalised(scene.ended) if scene.ended is not None else capitalised(game.won_words.get(scene.winner or "", ""))
    )
    if not why:
        why = capitalised(next((call.why for call in reversed(scene.calls) if call.rule == "game_over"), ""))
    score = ",  ".join(f"{team.team}: {team.points} {team.words}".rstrip() for team in head.teams)
    return tuple(line for line in (why, head.count, score) if line)


def short_clock(seconds: float) -> str:
    """A time in s as people read it from afar: `m:ss`."""
    return clock_text(seconds).partition(".")[0]
