"""Pictures, looked at pixel by pixel."""

import dataclasses
import math

import pygame
import pytest

from tests.ui.pictures import close_to, colours_near, content, painted, where
from vrg.bus import messages as m
from vrg.colours import SKY_BLUE, VERMILLION, dulled
from vrg.games import GAMES, game_of, look
from vrg.games.game import Marker
from vrg.regions import Circle
from vrg.testing.views import synthetic
from vrg.types import Pose
from vrg.ui import palette
from vrg.ui.banner import Help, banners
from vrg.ui.palette import ink_on
from vrg.ui.scene import Flash, Scene
from vrg.ui.view import Projection
from vrg.ui.window import text
from vrg.ui.window.easel import FigurePainter
from vrg.ui.window.text import Face, Fonts
from vrg.ui.window.window import save_png


@pytest.fixture
def scene() -> Scene:
    """The made-up match after 10 s."""
    return synthetic.scene_at(10.0)


@pytest.mark.parametrize("size", [(1280, 800), (600, 900)])
def test_each_player_is_where_it_is_in_the_colour_of_its_role(scene_at, size):
    scene = scene_at(13.5)
    surface, view = painted(scene, size)
    for name, colour in (("bruce", VERMILLION), ("nemo", SKY_BLUE), ("gill", dulled(SKY_BLUE))):
        assert close_to(colours_near(surface, where(scene, view, name)), colour) > 60, name


def test_roles_differ_also_without_colour():
    style = game_of("sharks-and-minnows").style
    signs = {style(role, "active").marker for role in ("shark", "minnow")} | {style("minnow", "inactive").marker}
    assert signs == {Marker.TRIANGLE, Marker.CIRCLE, Marker.CROSS}
    assert style("never heard of", "").colour == style("never heard of", "active").colour


def test_a_picture_can_be_written_without_a_display(scene_at, tmp_path):
    scene = scene_at(5.0)
    surface, view = painted(scene, (900, 600))
    save_png(surface, tmp_path / "match.png")
    picture = pygame.image.load(str(tmp_path / "match.png"))
    assert picture.get_size() == (900, 600)
    assert close_to(colours_near(picture, where(scene, view, "anchor")), VERMILLION) > 60
    with pytest.raises(OSError, match="cannot write the picture"):
        save_png(pygame.Surface((2, 2)), tmp_path / "no" / "such" / "folder.png")


@pytest.mark.parametrize(
    ("changes", "colour", "heading"),
    [
        ({"halted": "a cable"}, palette.CAUTION, "HALT"),
        ({"estop": True}, palette.ALARM, "EMERGENCY STOP"),
        ({"stage": m.Stage.GAME_OVER, "winner": "sharks"}, VERMILLION, "SHARKS WIN"),
        ({"live": False}, palette.LOST, "NO CLOCK"),
        ({"unproved": True}, palette.CAUTION, "NO EVIDENCE"),
    ],
)
def test_a_banner_appears(scene_at, changes, colour, heading):
    plain, _ = painted(scene_at(10.0))
    scene = scene_at(10.0, **changes)
    assert [banner.heading for banner in banners(scene)] == [heading]
    surface, _ = painted(scene)
    left_end = (560, 22)
    assert close_to(colours_near(surface, left_end, 5), colour) > 80
    assert close_to(colours_near(plain, left_end, 5), colour) == 0


@pytest.mark.parametrize(
    "size",
    [(800, 600), (400, 700), *(pytest.param(size, marks=pytest.mark.thorough) for size in ((1280, 800), (1920, 1080)))],
)
def test_no_banner_moves_the_field(scene_at, size):
    every = [
        {},
        {"stage": m.Stage.INITIALIZE, "waiting": [f"{name} is not on its mark" for name in "abcdefgh"]},
        {"halted": "a cable " * 40, "way_out": "plug it in " * 20},
        {"estop": True, "live": False, "halted": "smoke"},
        {"stage": m.Stage.GAME_OVER, "winner": "sharks"},
    ]
    assert len({painted(scene_at(10.0, **changes), size)[1] for changes in every}) == 1


def test_the_field_fills_the_window_as_far_as_its_shape_allows(scene, scene_at):
    _, view = painted(scene, (1280, 720))
    [field] = [zone for zone in scene.zones if zone.kind == "field"]
    x_min, y_min, x_max, y_max = field.region.bounds
    width, height = ((x_max - x_min) * view.scale, (y_max - y_min) * view.scale)
    assert width * height > 0.45 * 1280 * 720


def contrast(one, other):
    """The contrast of two colours, 1 to 21 (WCAG 2)."""
    dark, light = sorted((palette.luminance(one), palette.luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def test_all_text_can_be_read():
    """WCAG 2 asks for a contrast of 4.5 between text and its ground."""
    grounds = (palette.BACKGROUND, palette.APRON, palette.PANEL, palette.FIELD, palette.RAISED)
    inks = (palette.TEXT, palette.MUTED, palette.CAUTION, palette.WARNING)
    pale = [(ink, ground) for ink in inks for ground in grounds if contrast(ink, ground) < 4.5]
    plates = [role.colour for name in GAMES.names() for role in game_of(name).roles]
    plates += [
        palette.ALARM,
        palette.CAUTION,
        palette.GOOD,
        palette.CALM,
        palette.LOST,
        *palette.STAGE_COLOURS.values(),
    ]
    pale += [(ink_on(plate), plate) for plate in plates if contrast(ink_on(plate), plate) < 4.5]
    assert pale == []


def test_the_result_is_large_and_in_the_colour_of_the_winner(scene_at):
    over = scene_at(19.9, stage=m.Stage.GAME_OVER, winner="sharks")
    plain, _ = painted(over)
    told, _ = painted(over, over="Q closes the window")
    middle = (490, 300)
    assert close_to(colours_near(told, middle, 120), VERMILLION) > 5000
    assert close_to(colours_near(plain, middle, 120), VERMILLION) < 2000


@pytest.mark.parametrize("size", [(800, 600), (1280, 800)])
def test_the_list_of_24_players_leaves_room_for_the_referees_words(scene_at, size):
    few = scene_at(10.0)
    many = dataclasses.replace(
        few, players=tuple(dataclasses.replace(few.players[i % 7], name=f"player{i}") for i in range(24))
    )
    without = dataclasses.replace(many, calls=())
    assert content(painted(many, size)[0]) != content(painted(without, size)[0]), "the calls are seen"


def test_the_keys_are_listed_over_the_field_when_asked_for(scene_at):
    listed, _ = painted(scene_at(10.0), keys=[("Q", "close window")])
    assert content(painted(scene_at(10.0))[0]) != content(listed)


def test_banners_say_why(scene_at):
    def said(**changes):
        return " ".join(line for banner in banners(scene_at(10.0, **changes)) for line in banner.lines)

    assert "a cable" in said(halted="a cable")
    assert "dory is not armed" in said(waiting=["dory is not armed"])
    assert "No minnow is left" in said(stage=m.Stage.GAME_OVER, winner="sharks")
    assert "of 5 minnows left" in said(stage=m.Stage.GAME_OVER, winner="sharks")
    assert "An official ended it" in said(stage=m.Stage.GAME_OVER, winner="nobody", ended="an official ended it")
    headings = [banners(scene_at(10.0, stage=m.Stage.GAME_OVER, winner=who))[0].heading for who in ("nobody", "draw")]
    assert headings == ["NO WINNER", "A DRAW"]
    assert banners(scene_at(10.0)) == []


def test_the_gravest_banner_is_first(scene_at):
    found = banners(scene_at(10.0, estop=True, live=False, halted="x"))
    assert [banner.heading for banner in found] == ["EMERGENCY STOP", "NO CLOCK"]
    assert found[0].lines == ("x",), "the referee halts because of the stop: one banner says it"


def test_officials_read_what_to_press_in_order_and_viewers_only_what_happens(scene_at):
    scene = scene_at(10.0, estop=True, halted="smoke")
    latched = tuple(dataclasses.replace(player, latched=player.name == "nemo") for player in scene.players)
    scene = dataclasses.replace(scene, players=latched)
    keys, commands, nothing = (banners(scene, help_)[0].steps for help_ in (Help.KEYS, Help.COMMANDS, Help.NONE))
    assert keys == ("1. U releases the stop", "2. R lets robots clear their faults", "3. C continues play")
    assert commands[0] == "1. vrg estop --release releases the stop"
    assert nothing == ()
    assert banners(scene_at(10.0, halted="x"), Help.KEYS)[0].steps == ("C continues play",)


def test_an_emergency_stop_after_the_end_is_shown_with_its_release(scene_at):
    stop, ending = banners(scene_at(10.0, estop=True, stage=m.Stage.GAME_OVER, winner="sharks"), Help.KEYS)
    assert (stop.heading, stop.steps, ending.heading) == ("EMERGENCY STOP", ("U releases the stop",), "SHARKS WIN")


def test_a_halt_says_how_it_is_left(scene_at):
    [halt] = banners(scene_at(10.0, halted="a cable", way_out="plug it in, then resume"))
    assert (halt.heading, halt.lines) == ("HALT", ("a cable", "plug it in, then resume"))
    [stop] = banners(scene_at(10.0, estop=True, halted="smoke", way_out="release it"))
    assert (stop.heading, stop.lines) == ("EMERGENCY STOP", ("smoke", "release it"))
    [ending] = banners(scene_at(10.0, stage=m.Stage.GAME_OVER, halted="a cable", way_out="plug it in"))
    assert "plug it in" not in ending.lines


def test_the_way_out_is_a_line_of_the_banner_in_the_window(scene_at):
    def head(**changes):
        surface, _ = painted(scene_at(10.0, **changes))
        return content(surface.subsurface((0, 0, 400, 80)))

    assert head(halted="a cable", way_out="plug it in") != head(halted="a cable")


def test_a_flash_is_drawn_where_it_happened_and_thins(scene_at):
    scene = dataclasses.replace(scene_at(0.0), bodies=())
    where_, colours = (21.0, -20.0), []
    for share in (0.0, 0.9):
        flashing = dataclasses.replace(scene, flashes=(Flash(where_, "tag", share),))
        surface, view = painted(flashing)
        colours.append(close_to(colours_near(surface, view.point(*where_), 70), palette.CAUTION, 30))
    assert colours[0] > 300
    assert colours[1] < colours[0] - 150, "but for its word"


def test_speed_and_a_low_battery_are_in_the_list_of_players(scene, scene_at):

    def drawn(**changes):
        players = tuple(dataclasses.replace(p, **changes) if p.name == "nemo" else p for p in scene.players)
        return painted(dataclasses.replace(scene, players=players))[0]

    def differ(a, b):
        return pygame.mask.from_threshold(a, (0, 0, 0), (1, 1, 1, 255), b).count() < a.get_width() * a.get_height()

    plain = drawn(speed=None, battery=None)
    assert differ(plain, drawn(speed=0.5, battery=None))
    row = pygame.Rect(980, 100, 300, 200)
    full, low = (drawn(speed=None, battery=charge).subsurface(row) for charge in (0.8, 0.1))
    counted = [close_to(colours_near(surface, (150, 100), 100), palette.CAUTION, 20) for surface in (full, low)]
    assert counted[0] < counted[1], "a battery that is nearly empty is told"


def test_physical_robots_have_a_white_rim_on_the_field_and_in_the_panel(scene_at):
    def white(scene, place):
        surface, view = painted(scene)
        return close_to(colours_near(surface, place or where(scene, view, "nemo"), 20), palette.TEXT)

    mixed = scene_at(10.0)
    virtual = dataclasses.replace(
        mixed, bodies=tuple(dataclasses.replace(body, physical=False, name="") for body in mixed.bodies)
    )
    mixed = dataclasses.replace(
        mixed, bodies=tuple(dataclasses.replace(body, name="nemo" * body.physical) for body in mixed.bodies)
    )
    surface, view = painted(mixed)
    place = next(view.point(body.pose.x, body.pose.y) for body in mixed.bodies if body.physical)
    assert white(mixed, place) > white(virtual, place) + 60
    corner = pygame.Rect(790, 764, 180, 30)
    legend = (surface.subsurface(corner), painted(virtual)[0].subsurface(corner))
    assert content(legend[0]) != content(legend[1])


def test_a_long_fault_takes_lines_of_its_own_in_the_panel(scene, scene_at):
    fault = "axis 2 (node 5) has latched: overvoltage at 58.2 V while it braked"
    ailing = tuple(dataclasses.replace(p, fault=fault if p.name == "nemo" else None) for p in scene.players)
    plain, _ = painted(scene)
    warned, _ = painted(dataclasses.replace(scene, players=ailing))
    below_nemo = (1110, 190)
    assert close_to(colours_near(warned, below_nemo, 60), palette.CAUTION, 40) > 100
    assert close_to(colours_near(plain, below_nemo, 60), palette.CAUTION, 40) == 0


def test_the_driven_player_is_ringed(scene, scene_at):
    plain, view = painted(scene)
    ringed, _ = painted(scene, driving="nemo")
    place = where(scene, view, "nemo")
    assert close_to(colours_near(ringed, place, 30), palette.CAUTION, 40) > 40
    assert close_to(colours_near(plain, place, 30), palette.CAUTION, 40) == 0


def test_what_turns_is_as_wide_as_what_does_not():
    def drawn(theta):
        surface, view = pygame.Surface((400, 400)), Projection(0.0, 0.0, 200.0, 200.0, 100.0, turned=False)
        FigurePainter(Fonts()).draw(surface, [look.around("ann", Pose(0.0, 0.0, theta), (0.5, 0.4))], view, 3.0)
        return close_to(colours_near(surface, (200, 200), 150), palette.CAUTION, 60)

    assert drawn(0.8) == pytest.approx(drawn(0.0), rel=0.15)


def test_where_to_line_up_is_shown_before_a_round(scene_at):
    status = m.PlayerStatus(
        name="nemo", team="minnows", role="minnow", state="active", may_move=True, radius=0.3,
        mark=Pose(21.0, -19.0, 0.0),
    )  # fmt: skip
    empty, view = painted(scene_at(0.0, players=[status]))
    marked, _ = painted(scene_at(0.0, players=[status], stage=m.Stage.INITIALIZE))
    place = view.point(21.0, -19.0)
    assert colours_near(empty, place) != colours_near(marked, place)


@pytest.mark.parametrize("size", [(1280, 800), (600, 900)])
def test_a_zone_of_any_shape_is_drawn_as_far_as_it_reaches_and_no_further(scene_at, size):
    """Points just inside and just outside of the four shapes of synthetic.four_shapes."""
    scene = dataclasses.replace(scene_at(0.0, zones=synthetic.four_shapes()), bodies=(), obstacles=())
    surface, view = painted(scene, size)

    def tinted(x, y):
        around = colours_near(surface, view.point(x, y), 3)
        return close_to(around, palette.FIELD, 2) == 0

    half = math.sqrt(0.5)
    inside = [(16.2, -31.8), (16 + 4.7 * half, -32 + 4.7 * half), (21.0 - 2.2, -22.0), (21.0, -24.2), (22.2, -28.2)]
    outside = [(16 + 5.3 * half, -32 + 5.3 * half), (20.8, -27.2), (18.7, -24.3), (21.7, -27.7), (25.3, -31.3)]
    assert all(tinted(x, y) for x, y in inside)
    assert not any(tinted(x, y) for x, y in outside)
    beyond = colours_near(surface, view.point(25.8, -13.2), 3)
    assert close_to(beyond, palette.APRON) == 49, "the corner that the field's polygon cuts off"
    assert close_to(colours_near(surface, view.point(21.0, -15.5), 3), palette.FIELD) > 20


def test_a_name_that_has_no_room_in_its_zone_is_not_painted(scene_at):
    def drawn(name, radius):
        zones = [m.Zone(name=name, kind="start", region=Circle(21.0, -24.0, radius))]
        scene = dataclasses.replace(scene_at(0.0, zones=[*synthetic.zones()[:1], *zones]), bodies=(), obstacles=())
        return content(painted(scene)[0])

    assert drawn("harbour", 3.0) != drawn("seaport", 3.0)
    assert drawn("harbour", 0.4) == drawn("seaport", 0.4)


def test_walls_are_drawn(scene_at):
    scene = scene_at(0.0)
    surface, view = painted(scene)
    assert tuple(surface.get_at([round(v) for v in view.point(21.0, -24.0)]))[:3] == palette.WALL
    assert tuple(surface.get_at([round(v) for v in view.point(26.8, -20.0)]))[:3] == palette.WALL


def test_names_do_not_cover_bodies(scene, scene_at):
    bare = dataclasses.replace(scene, bodies=tuple(dataclasses.replace(b, name="") for b in scene.bodies))
    named, view = painted(scene)
    nameless, _ = painted(bare)
    for body in scene.bodies:
        centre = [round(v) for v in view.point(body.pose.x, body.pose.y)]
        assert named.get_at(centre) == nameless.get_at(centre), body.name


@pytest.mark.parametrize(
    "size", [(1, 1), (3, 900), (200, 120), (520, 200), pytest.param((3840, 2160), marks=pytest.mark.thorough)]
)
def test_any_size_can_be_drawn(scene_at, size):
    surface, _ = painted(scene_at(13.5, halted="x", estop=True), size, driving="nemo")
    empty, _ = painted(Scene(), size)
    assert surface.get_size() == size
    assert size[0] < 10 or content(surface) != content(empty)


def test_odd_words_are_drawn(scene_at):
    strange = m.Call(number=3, rule="tag", text="x" * 500 + " \0 ☃ 日本", players=(), poses=(), clock=1.0)
    halted = scene_at(5.0, halted="y" * 900, waiting=["z" * 900] * 40)
    without, told = (content(painted(dataclasses.replace(halted, calls=calls))[0]) for calls in ((), (strange,)))
    assert told != without
    assert without != content(painted(scene_at(5.0))[0])


def test_bodies_far_off_and_out_of_sight_are_no_trouble(scene_at):
    scene = scene_at(5.0)
    lost = dataclasses.replace(scene.bodies[0], pose=Pose(9e4, -9e4, 1.0), trail=((0.0, 0.0), (9e4, -9e4)))
    surface, view = painted(dataclasses.replace(scene, bodies=(lost, *scene.bodies[1:])))
    assert lost.name == "bruce"
    for name, colour in (("anchor", VERMILLION), ("nemo", SKY_BLUE)):
        assert close_to(colours_near(surface, where(scene, view, name)), colour) > 60, name
    assert close_to(colours_near(surface, where(scene, view, "bruce")), VERMILLION) == 0


def test_a_machine_without_fonts_has_pygames_own(scene_at, monkeypatch):
    monkeypatch.setattr(text, "_file", lambda face: None)
    surface, _ = painted(scene_at(10.0))
    assert close_to(colours_near(surface, (200, 30), 60), palette.TEXT, 30) > 50


def test_text_is_wrapped_and_shortened_to_its_width():
    fonts = Fonts()
    lines = fonts.wrap("one two three four five six seven", 90, 14, lines=3)
    assert len(lines) == 3
    assert all(fonts.width(line, 14) <= 90 for line in lines)
    assert lines[-1].endswith("…")
    assert fonts.shorten("word", 1000, 14) == "word"
    assert fonts.shorten("word", 1, 14) == ""
    assert fonts.shorten_middle("word", 1000, 14) == "word"
    both = [fonts.shorten_middle(f"attacker-of-blue-{n}", 90, 14) for n in (11, 12)]
    assert both[0] != both[1], "names that differ at their end stay different"
    assert all(fonts.width(name, 14) <= 90 for name in both)
    assert fonts.render("a", 14, palette.TEXT, Face.BOLD) is fonts.render("a", 14, palette.TEXT, Face.BOLD)


def test_words_upon_a_colour_are_legible():
    assert ink_on(palette.CAUTION) == palette.INK
    assert ink_on(palette.ALARM) == palette.TEXT
