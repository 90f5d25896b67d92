"""The welcome window: events become a match file, and what is wrong is seen where it is."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pygame
import pytest

from vrg.colours import Rgb
from vrg.commands.checking import DraftCheck
from vrg.commands.drafts import recent_matches, save_draft
from vrg.ui import palette
from vrg.ui.welcome.acts import Act
from vrg.ui.welcome.checking import Checker
from vrg.ui.welcome.choices import Choices
from vrg.ui.welcome.draft import Draft
from vrg.ui.welcome.editor import Cell
from vrg.ui.welcome.ground import grip_at, ring_of
from vrg.ui.welcome.layout import EditorLayout, LobbyLayout, editor_layout, lobby_layout
from vrg.ui.welcome.lobby import List, Wish
from vrg.ui.welcome.placing import with_count
from vrg.ui.welcome.window import Outcome, Tools, WelcomeWindow

CHECK = DraftCheck(imports=False)
SIZES = [(1280, 720), (1920, 1080), (800, 600), (720, 1280), (3840, 2160)]


class Bench:
    """The window in a folder, with the events that a person would cause."""

    def __init__(self, folder: Path, draft: Draft | None = None, size: tuple[int, int] = (1280, 720)) -> None:
        self.tools = Tools(CHECK, CHECK, save_draft, Choices(), lambda: recent_matches(folder / "runs", folder))
        self.window = WelcomeWindow(self.tools, folder, draft, size=size)
        self.window.open()
        self.settle()

    def settle(self) -> None:
        """Show frames until all is checked."""
        deadline = time.monotonic() + 30
        self.window.frame(time.monotonic())
        while self.window.outcome is None and self.window.busy:
            assert time.monotonic() < deadline
            self.window.frame(time.monotonic())
            time.sleep(0.002)

    def post(self, kind: int, **values: object) -> None:
        pygame.event.post(pygame.event.Event(kind, values))
        self.window.frame(time.monotonic())

    def key(self, key: int, sign: str = "", mod: int = 0) -> None:
        self.post(pygame.KEYDOWN, key=key, unicode=sign, mod=mod)
        self.post(pygame.KEYUP, key=key, unicode=sign, mod=mod)

    def type(self, text: str) -> None:
        for sign in text:
            self.key(ord(sign), sign)

    def press(self, place: tuple[float, float]) -> None:
        self.post(pygame.MOUSEBUTTONDOWN, button=1, pos=(round(place[0]), round(place[1])))

    def click(self, place: tuple[float, float]) -> None:
        self.press(place)
        self.post(pygame.MOUSEBUTTONUP, button=1, pos=(round(place[0]), round(place[1])))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self.press(start)
        self.post(pygame.MOUSEMOTION, pos=(round(end[0]), round(end[1])), rel=(0, 0), buttons=(1, 0, 0))
        self.post(pygame.MOUSEBUTTONUP, button=1, pos=(round(end[0]), round(end[1])))
        self.settle()

    @property
    def lobby(self) -> LobbyLayout:
        assert isinstance(self.window.places, LobbyLayout)
        return self.window.places

    @property
    def places(self) -> EditorLayout:
        assert isinstance(self.window.places, EditorLayout)
        return self.window.places

    @property
    def draft(self) -> Draft:
        assert self.window.editor is not None
        return self.window.editor.draft

    def pixel(self, place: tuple[int, int]) -> Rgb:
        screen = pygame.display.get_surface()
        assert screen is not None
        colour = screen.get_at(place)
        return colour.r, colour.g, colour.b

    def counted(self, area: pygame.Rect, colour: Rgb) -> int:
        """How many pixels of an area have a colour."""
        screen = pygame.display.get_surface()
        assert screen is not None
        part = screen.subsurface(area.clip(screen.get_rect()))
        return pygame.mask.from_threshold(part, colour, (1, 1, 1, 255)).count()


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Callable[..., Bench]]:
    made: list[Bench] = []

    def make(draft: Draft | None = None, size: tuple[int, int] = (1280, 720)) -> Bench:
        made.append(Bench(tmp_path, draft, size))
        return made[-1]

    yield make
    for one in made:
        one.window.close()


def sharks(folder: Path) -> Draft:
    return Draft.of_game("sharks-and-minnows", folder)


def test_start_plays_the_default_match_at_once(bench: Callable[..., Bench]) -> None:
    one = bench()
    one.click(one.lobby.buttons[Wish.START].center)
    assert one.window.outcome == Outcome(play="sharks-and-minnows")


def test_a_game_is_chosen_by_a_click_and_by_keys(bench: Callable[..., Bench]) -> None:
    one = bench()
    one.click(one.lobby.rows[List.GAMES][2].center)
    one.settle()
    assert one.window.lobby is not None
    assert one.window.lobby.game == "roboflag"
    one.key(pygame.K_DOWN)
    one.settle()
    one.key(pygame.K_RETURN)
    assert one.window.outcome == Outcome(play=one.window.lobby.game)


def test_a_game_on_another_map_is_saved_before_it_is_played(bench: Callable[..., Bench], tmp_path: Path) -> None:
    one = bench()
    one.click(one.lobby.rows[List.GAMES][2].center)
    one.click(one.lobby.rows[List.MAPS][2].center)
    one.settle()
    assert one.window.lobby is not None
    assert one.window.lobby.draft is not None
    assert one.window.lobby.draft.shown("map") == "marhes_lab"
    one.click(one.lobby.rows[List.MAPS][1].center)
    one.settle()
    one.key(pygame.K_c, "c")
    assert one.draft.shown("map") == "courtyard"


def test_question_mark_lists_the_keys_and_another_key_hides_them(bench: Callable[..., Bench]) -> None:
    one = bench()
    middle = pygame.Rect(400, 150, 480, 420)
    before = one.counted(middle, palette.CAUTION)
    one.key(pygame.K_SLASH, "?")
    assert one.counted(middle, palette.CAUTION) > before + 100
    one.key(pygame.K_ESCAPE)
    assert one.window.outcome is None
    assert one.counted(middle, palette.CAUTION) == before
    one.key(pygame.K_ESCAPE)
    assert one.window.outcome == Outcome()


def test_a_match_is_changed_saved_and_played_by_keys_alone(bench: Callable[..., Bench], tmp_path: Path) -> None:
    one = bench()
    one.key(pygame.K_c, "c")
    one.type("20.5")
    one.key(pygame.K_RETURN)
    one.settle()
    one.key(pygame.K_p, mod=pygame.KMOD_CTRL)
    one.type("final")
    one.key(pygame.K_RETURN)
    assert one.window.outcome == Outcome(play=str(tmp_path / "final.toml"))
    assert CHECK(Draft((tmp_path / "final.toml").read_text(encoding="utf-8"), tmp_path)).problems == ()
    assert 'name = "player1"\nrole = "shark"\nx = 20.5\n' in (tmp_path / "final.toml").read_text(encoding="utf-8")


def test_a_sign_counts_once_however_long_its_key_is_held(bench: Callable[..., Bench], tmp_path: Path) -> None:
    one = bench(sharks(tmp_path))
    for _ in range(5):
        one.post(pygame.KEYDOWN, key=pygame.K_2, unicode="2", mod=0)
    one.post(pygame.KEYUP, key=pygame.K_2, unicode="2", mod=0)
    one.type("2")
    assert one.window.editor is not None
    assert one.window.editor.shown(Cell("x", 0)) == "22"
    one.key(pygame.K_ESCAPE)
    for _ in range(3):
        one.post(pygame.KEYDOWN, key=pygame.K_DOWN, unicode="", mod=0)
    assert one.window.editor.cell == Cell("x", 3)


def test_a_robot_is_dragged_and_turned_on_the_map(bench: Callable[..., Bench], tmp_path: Path) -> None:
    one = bench(sharks(tmp_path))
    view = one.window.view
    assert view is not None
    one.drag(view.point(24.0, -15.0), view.point(23.0, -14.0))
    pose = one.draft.players[6].pose
    assert pose is not None
    assert (abs(pose.x - 23.0) < 0.05, abs(pose.y + 14.0) < 0.05) == (True, True)
    view = one.window.view
    assert view is not None
    ring = ring_of(pose, "P2AT", view, one.places.ui)
    one.drag(ring, view.point(pose.x + 3.0, pose.y))
    turned = one.draft.players[6].pose
    assert turned is not None
    assert (turned.x, turned.y, abs(turned.theta) < 0.03) == (pose.x, pose.y, True)


def test_a_robot_dragged_off_the_field_is_a_problem_beside_its_fields(
    bench: Callable[..., Bench], tmp_path: Path
) -> None:
    one = bench(sharks(tmp_path))
    row = one.places.numbers[6].unionall([one.places.cells[Cell(name, 6)] for name in ("x", "y")])
    assert one.counted(row, palette.WARNING) == 0
    view = one.window.view
    assert view is not None
    one.drag(view.point(24.0, -15.0), view.point(24.0, -20.0))
    assert one.counted(one.places.cells[Cell("y", 6)], palette.WARNING) > 50
    assert one.counted(one.places.cells[Cell("y", 5)], palette.WARNING) == 0
    assert one.counted(one.places.problems, palette.WARNING) > 30
    assert one.counted(one.places.buttons[Act.PLAY], palette.GOOD) == 0
    one.key(pygame.K_z, mod=pygame.KMOD_CTRL)
    one.settle()
    assert one.counted(one.places.problems, palette.WARNING) == 0
    assert one.counted(one.places.buttons[Act.PLAY], palette.GOOD) > 500


def test_a_click_on_a_problem_leads_to_its_field(bench: Callable[..., Bench], tmp_path: Path) -> None:
    one = bench(sharks(tmp_path).set("role", "dolphin", 4))
    one.click(one.places.problem_rows[0].center)
    assert one.window.editor is not None
    assert one.window.editor.cell == Cell("role", 4)
    one.click(one.places.cells[Cell("role", 4)].center)
    assert one.window.editor.offer is not None
    one.key(pygame.K_DOWN)
    one.key(pygame.K_RETURN)
    one.settle()
    assert one.draft.players[4].role == "minnow"
    assert one.window.editor.problems == ()


def test_buttons_add_and_take_players(bench: Callable[..., Bench], tmp_path: Path) -> None:
    one = bench(sharks(tmp_path))
    one.click(one.places.buttons[Act.MORE].center)
    one.settle()
    assert len(one.draft.players) == 8
    assert one.window.editor is not None
    assert one.window.editor.problems == ()
    one.click(one.places.buttons[Act.FEWER].center)
    one.click(one.places.buttons[Act.UNDO].center)
    assert len(one.draft.players) == 8


def test_a_file_that_is_no_toml_is_opened_and_told(bench: Callable[..., Bench], tmp_path: Path) -> None:
    one = bench(Draft("name = \n", tmp_path, tmp_path / "broken.toml"))
    assert one.window.editor is not None
    assert one.window.editor.problems[0].line == 1
    assert one.counted(one.places.problems, palette.WARNING) > 30
    for key in (pygame.K_UP, pygame.K_DOWN, pygame.K_TAB, pygame.K_RETURN, pygame.K_DELETE, pygame.K_RIGHT):
        one.key(key)
    one.key(pygame.K_EQUALS, mod=pygame.KMOD_CTRL)
    one.settle()


def test_a_window_that_is_closed_asks_once_and_keeps_what_is_not_saved(
    bench: Callable[..., Bench], tmp_path: Path
) -> None:
    one = bench(sharks(tmp_path))
    one.key(pygame.K_UP, mod=pygame.KMOD_CTRL)
    one.post(pygame.QUIT)
    assert one.window.outcome is None
    told = one.window.rescue()
    assert told == f"vrg: what was not saved is in {tmp_path / 'match-unsaved.toml'} now."
    assert (tmp_path / "match-unsaved.toml").read_text(encoding="utf-8") == one.draft.text
    assert "match-unsaved-2.toml" in one.window.rescue()
    one.post(pygame.QUIT)
    assert one.window.outcome == Outcome()


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [2, 7, 16, 40])
def test_nothing_overlaps_in_a_window_of_any_size(size: tuple[int, int], count: int) -> None:
    places = editor_layout(size, count, 0, count - 1)
    window = pygame.Rect(0, 0, *size)
    plates = [places.head, places.settings, places.players, places.problems, places.field, places.notice]
    acts = (Act.LEAVE, Act.UNDO, Act.REDO, Act.SAVE, Act.SAVE_AS, Act.PLAY)
    plates += [places.buttons[act] for act in acts]
    for index, plate in enumerate(plates):
        assert window.contains(plate)
        assert plate.collidelist(plates[index + 1 :]) == -1
    cells = list(places.cells.values())
    for index, cell in enumerate(cells):
        assert cell.collidelist(cells[index + 1 :]) == -1
        assert places.players.contains(cell) or places.settings.contains(cell)
        assert cell.height >= 17
    assert Cell("x", count - 1) in places.cells
    at = {List.GAMES: 0, List.MAPS: 3, List.RECENT: 11}
    lobby = lobby_layout(size, {List.GAMES: 5, List.MAPS: 4, List.RECENT: 12}, at)
    rects = [lobby.head, *lobby.plates.values(), lobby.shown]
    for index, plate in enumerate(rects):
        assert window.contains(plate)
        assert plate.collidelist(rects[index + 1 :]) == -1
    for which, rows in lobby.rows.items():
        assert all(lobby.plates[which].contains(row) for row in rows)
        assert lobby.first[which] <= at[which] < lobby.first[which] + len(rows)
    assert all(lobby.shown.contains(button) for button in lobby.buttons.values())


@pytest.mark.parametrize("size", SIZES)
def test_both_screens_are_drawn_in_a_window_of_any_size(
    bench: Callable[..., Bench], tmp_path: Path, size: tuple[int, int]
) -> None:
    assert bench(size=size).counted(pygame.Rect(0, 0, *size), palette.TEXT) > 500
    one = bench(with_count(sharks(tmp_path), 16, CHECK), size)
    assert one.counted(one.places.field, palette.FIELD) > 2000
    assert one.window.view is not None
    assert grip_at(one.places.head.topleft, one.draft, [None], None, one.window.view, 1.0) is None


def test_a_check_that_fails_is_told_and_the_next_draft_is_checked_again(tmp_path: Path) -> None:
    def check(draft: Draft) -> object:
        raise RuntimeError("broken")

    with ThreadPoolExecutor(1) as executor:
        checker = Checker(check, executor)  # type: ignore[arg-type]
        draft, found = sharks(tmp_path), None
        for tick in range(1000):
            found = checker.look(draft, tick * 0.1)
            if found is not None:
                break
            time.sleep(0.005)
    assert found is not None
    assert found[1].problems[0].text == "the check itself has failed: RuntimeError('broken')"
    assert not checker.busy
