"""The plot of the trajectories."""

import colorsys
import dataclasses

import matplotlib.colors
import matplotlib.image
import msgspec
import numpy as np
import pytest

from tests.ui.pictures import kept_axes
from vrg.bus import messages as m
from vrg.colours import SKY_BLUE, VERMILLION, YELLOW
from vrg.games import UNKNOWN_GAME
from vrg.recording.reader import calls_of, read_tracks, setting_of
from vrg.recording.recorded import read_recorded
from vrg.regions import Circle, Rectangle
from vrg.runs.run_folder import RunFolder
from vrg.testing.views import synthetic
from vrg.ui.plots import plot
from vrg.ui.plots.heights import HEIGHTS, heights
from vrg.ui.plots.plot import plot_trajectories
from vrg.ui.plots.plotted import Labels


@pytest.fixture(scope="module")
def usual(recorded, tmp_path_factory):
    """The picture of the recorded match, and its two panels."""
    picture = tmp_path_factory.mktemp("plot") / "plot.png"
    with kept_axes() as panels:
        plot_trajectories(recorded, picture, title="A match")
    return picture, *panels


def tag_at(call, clock):
    """The call at another time; its number does not matter."""
    return msgspec.structs.replace(call, clock=float(clock), number=7)


def words(axes):
    return [text.get_text() for text in axes.texts]


def test_each_pass_has_a_panel_with_equal_axes(usual):
    file, *drawn = usual
    assert [axes.get_title() for axes in drawn] == ["Pass 1", "Pass 2"]
    assert all(axes.get_aspect() == 1.0 for axes in drawn)
    picture = matplotlib.image.imread(file)
    assert picture.shape[0] > 600
    assert picture.shape[1] > 600


def test_players_calls_and_zones_are_named(usual):
    _, first, second = usual
    assert set(synthetic.NAMES) <= set(words(first))
    assert {"gill 0:09.0 by bruce", "squirt 0:12.5", "SAFE ZONE", "START"} <= set(words(first))
    assert "gill 0:09.0 by bruce" not in words(second)


def test_a_zone_of_any_shape_is_drawn_with_its_name_in_its_middle(recorded, drawn, tmp_path):
    zones = synthetic.four_shapes()
    plot_trajectories(read_tracks(recorded), tmp_path / "plot.png", zones={1: zones})
    first, second = drawn
    outlines = [patch.get_xy()[:-1].tolist() for patch in first.patches]
    for zone in zones:
        assert [pytest.approx((y, -x), abs=0.001) for x, y in zone.region.outline()] in outlines
    names = {text.get_text().replace("\n", " "): text.get_position() for text in first.texts}
    for zone, name in zip(zones[1:], ("CORNER ZONE", "ISLAND", "GATE"), strict=True):
        x, y = names[name]
        assert zone.region.contains(-y, x)
    stripes, grid = (len(axes.collections[k].get_segments()) for axes, k in ((first, 1), (first, 0)))
    assert min(stripes, grid) > 5
    assert not second.patches


def test_many_calls_are_numbered_and_told_in_the_legend(recorded, drawn, tmp_path):
    [tag, _] = calls_of(read_recorded(recorded))
    calls = [tag_at(tag, n) for n in range(12)]
    plot_trajectories(recorded, tmp_path / "plot.png", calls=calls)
    [legend] = drawn[0].figure.legends
    told = [text.get_text() for text in legend.get_texts()]
    assert [words for words in told if "by bruce" in words] == [f"gill 0:{n:02d}.0 by bruce" for n in range(12)]
    signs = [line.get_marker() for line, words in zip(legend.legend_handles, told, strict=True) if "by bruce" in words]
    assert signs == [f"${n}$" for n in range(1, 13)]
    assert {str(n) for n in range(1, 13)} <= set(words(drawn[0]))
    assert not any("by bruce" in text for text in words(drawn[0])), "a number stands for the words"


def test_a_few_calls_are_told_beside_their_marks(recorded, drawn, tmp_path):
    [tag, _] = calls_of(read_recorded(recorded))
    plot_trajectories(recorded, tmp_path / "plot.png", calls=[tag_at(tag, n) for n in range(8)])
    assert {f"gill 0:{n:02d}.0 by bruce" for n in range(8)} <= set(words(drawn[0]))


def test_walls_and_obstacles_are_drawn(recorded, drawn, tmp_path):
    plot_trajectories(recorded, tmp_path / "plot.png", zones={1: []}, obstacles=synthetic.OBSTACLES)
    wanted = [[[y, -x] for x, y in obstacle.outline()] for obstacle in synthetic.OBSTACLES]
    for axes in drawn:
        found = [patch.get_xy()[:-1].tolist() for patch in axes.patches]
        assert found == [[pytest.approx(corner, abs=0.001) for corner in outline] for outline in wanted]


def test_players_are_in_the_order_in_which_people_count():
    names = ["p10", "p2", "p1", "a10b2", "a10b1", "a9", "p", "Ärztin2", "7", "10"]
    assert sorted(names, key=plot._natural) == ["7", "10", "a9", "a10b1", "a10b2", "p", "p1", "p2", "p10", "Ärztin2"]


def lines_of(axes, colour):
    """How many lines of tracks have a colour of this role."""
    hue = colorsys.rgb_to_hsv(*(part / 255 for part in colour))[0]
    drawn = [matplotlib.colors.to_rgb(line.get_color()) for line in axes.lines if len(line.get_xdata()) > 2]
    return sum(abs(colorsys.rgb_to_hsv(*one)[0] - hue) < 0.03 for one in drawn)


def test_players_have_shades_of_the_colour_of_their_role_in_windows(usual):
    _, first, second = usual
    assert (lines_of(first, VERMILLION), lines_of(first, SKY_BLUE)) == (2, 5)
    assert lines_of(second, VERMILLION) == 4, "two minnows are sharks in the second pass"
    tracks = [line.get_color() for line in first.lines if len(line.get_xdata()) > 2]
    assert len(set(tracks)) == 7


def test_a_long_round_has_several_panels(recorded, drawn, tmp_path):
    """A match of ten minutes would otherwise be a tangle."""
    tracks = read_tracks(recorded)
    longer = {name: dataclasses.replace(track, times=track.times * 8) for name, track in tracks.items()}
    plot_trajectories(longer, tmp_path / "plot.png", game="sharks-and-minnows")
    titles = [axes.get_title() for axes in drawn]
    assert 8 < len(titles) <= plot.MAX_PANELS
    assert titles[0].startswith("Pass 1, 0:00.0 to 0:")
    seen = sum(len(line.get_xdata()) for axes in drawn for line in axes.lines if len(line.get_xdata()) > 2)
    assert seen >= sum(int(track.playing.sum()) for track in tracks.values()), "every sample is in a panel"


def test_a_halt_takes_no_panel_and_the_titles_are_those_of_the_play_clock(recorded, drawn, tmp_path):
    def halted(track):
        """The same with a halt of five minutes after 10 s, in which the robot stands."""
        late = np.where(track.times > 10.0, track.times + 300.0, track.times)
        stands = np.concatenate([track.playing & (track.times < 10.0), track.playing & (track.times >= 10.0)])
        pairs = {name: np.concatenate([getattr(track, name)] * 2) for name in ("x", "y", "theta", "rounds")}
        twice = {"roles": track.roles * 2, "states": track.states * 2}
        times = np.concatenate([track.times, late + 1e-3])
        order = np.argsort(times)
        return dataclasses.replace(
            track, times=times[order], playing=stands[order], **{name: of[order] for name, of in pairs.items()},
            **{name: [of[k] for k in order] for name, of in twice.items()},
        )  # fmt: skip

    tracks = {name: halted(track) for name, track in read_tracks(recorded).items()}
    plot_trajectories(tracks, tmp_path / "plot.png", game="sharks-and-minnows")
    assert [axes.get_title() for axes in drawn] == ["Pass 1", "Pass 2"]


def test_the_field_is_turned_as_in_windows(usual):
    _, first, _ = usual
    assert first.get_xlabel() == "y, m"
    low, high = first.get_xlim()
    assert low < synthetic.Y_MIN < synthetic.Y_MAX < high
    assert first.yaxis.get_major_formatter()(-20.0, 0) == "20", "x, which is positive, points down"


def test_the_panel_shows_the_whole_of_every_zone(recorded, drawn, tmp_path):
    circle = m.Zone(name="field", kind="field", region=Circle(0.0, 0.0, 40.0))
    plot_trajectories(read_tracks(recorded), tmp_path / "plot.png", zones={1: [circle]})
    assert drawn[0].get_xlim()[0] < -40.0 < 40.0 < drawn[0].get_xlim()[1]
    assert drawn[0].get_ylim()[0] < -40.0 < 40.0 < drawn[0].get_ylim()[1]


def test_words_keep_away_from_the_border_where_there_is_room(drawn):
    _, [axes], metre = plot._figure(1, (0.0, 0.0, 10.0, 20.0))
    labels = Labels(metre, (0.0, 0.0, 10.0, 20.0))
    labels.keep_off(Rectangle(1.0, 1.0, 9.0, 19.0).outline())
    for at in ((5.0, 5.0), (8.7, 5.0), (9.9, 10.0)):
        labels.write(axes, "a name", at, (0.0, 0.0, 0.0), bold=False)
        left = at[0] * metre + axes.texts[-1].get_position()[0]
        assert not left < 9.0 * metre < left + 5.2 * len("a name"), at
        assert left + 5.2 * len("a name") < 10.0 * metre


def test_physical_robots_are_dashed(usual):
    long = [line for line in usual[1].lines if len(line.get_xdata()) > 1]
    dashed = {line.get_color(): line.get_linestyle() for line in long}
    assert sorted(dashed.values()).count("--") == 2
    assert len(dashed) == 7, "each player has a colour of its own"


def test_the_legend_says_what_dashes_mean(recorded, drawn, tmp_path):
    def explained(tracks):
        plot_trajectories(tracks, tmp_path / "plot.png")
        [legend] = drawn[-1].figure.legends
        entries = zip(legend.get_lines(), legend.get_texts(), strict=True)
        return {text.get_text().split(" (")[0]: line.get_linestyle() for line, text in entries}

    tracks = read_tracks(recorded)
    mixed = explained(tracks)
    assert mixed["physical robot"] == "--"
    assert {name for name in synthetic.NAMES if mixed[name] == "--"} == {"bruce", "nemo"}
    assert "physical robot" not in explained({"dory": tracks["dory"]})


def test_a_line_passes_through_the_recorded_places(recorded, drawn, tmp_path):
    track = read_tracks(recorded)["dory"]
    plot_trajectories({"dory": track}, tmp_path / "plot.png")
    [line] = [line for line in drawn[0].lines if len(line.get_xdata()) > 1]
    played = track.rounds == 1
    np.testing.assert_array_equal(line.get_xdata(), track.y[played], "the field is turned")


def test_no_line_joins_the_places_before_and_after_a_robot_was_moved(recorded, drawn, tmp_path):
    track = read_tracks(recorded)["dory"]
    moved = dataclasses.replace(track, x=np.where(track.times > 10.0, track.x + 3.0, track.x))
    plot_trajectories({"dory": moved}, tmp_path / "plot.png")
    assert np.isnan(drawn[0].lines[0].get_xdata()).sum() == 1


def test_the_way_of_a_body_is_drawn_and_its_place_at_the_end(monkeypatch, drawn, recorded, tmp_path):
    def body(x: float) -> m.FieldObject:
        half = 0.5
        corners = ((-half, -half), (half, -half), (half, half), (-half, half))
        return m.FieldObject(name="box", kind="box", x=x, y=-25.0, heading=0.3, corners=corners)

    setting = setting_of(read_recorded(recorded))
    seen = tuple((1, 5.0 + 0.1 * k, body(18.0 + 0.1 * k + 2.0 * (k > 5))) for k in range(10))
    monkeypatch.setattr(plot, "setting_of", lambda _: dataclasses.replace(setting, bodies=seen))
    plot_trajectories(recorded, tmp_path / "plot.png")
    colour = tuple(part / 255 for part in YELLOW)
    [way] = [line for line in drawn[0].lines if line.get_color() == colour]
    np.testing.assert_allclose(way.get_ydata(), [*(-18.0 - 0.1 * np.arange(6)), np.nan, *(-20.6 - 0.1 * np.arange(4))])
    [box] = [patch for patch in drawn[0].patches if patch.get_facecolor()[:3] == colour]
    corners = box.get_xy()[:4]
    np.testing.assert_allclose(corners.mean(axis=0), (-25.0, -20.9), atol=1e-6)
    along = corners[1] - corners[0]
    assert np.arctan2(along[1], along[0]) == pytest.approx(0.3 - np.pi / 2, abs=0.01)


def test_tracks_without_a_referee_are_plotted_whole(recorded, drawn, tmp_path):
    silent = {
        name: dataclasses.replace(
            track, roles=[""] * 400, states=[""] * 400, rounds=track.rounds * 0, playing=np.zeros(400, dtype=bool)
        )
        for name, track in read_tracks(recorded).items()
    }
    plot_trajectories(silent, tmp_path / "plot.png", calls=calls_of(read_recorded(recorded)))
    assert [axes.get_title() for axes in drawn] == ["", ""]
    assert "gill 0:09.0 with bruce" in words(drawn[0])


def test_without_tracks_there_is_nothing_to_plot(tmp_path):
    with pytest.raises(ValueError, match="at least one track"):
        plot_trajectories({}, tmp_path / "plot.png")


def test_of_those_that_flew_a_second_picture_has_the_heights_by_time(usual, recorded, tmp_path):
    file, *_ = usual
    assert not (file.parent / HEIGHTS).exists(), "all were on the ground"
    tracks = read_tracks(recorded)
    (name, track), *others = tracks.items()
    high = dataclasses.replace(track, z=np.linspace(0.0, 2.0, track.times.size))
    plot_trajectories({name: high, **dict(others)}, tmp_path / "plot.png")
    assert RunFolder(tmp_path).heights == tmp_path / HEIGHTS
    assert matplotlib.image.imread(tmp_path / HEIGHTS).shape[1] > 600
    figure = heights({name: high}, UNKNOWN_GAME)
    (axes,), (legend,) = figure.axes, figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [name]
    assert [line.get_ydata().max() for line in axes.lines] == [2.0]
