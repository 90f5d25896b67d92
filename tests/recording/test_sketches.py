"""What players sketch and see is in a recording, and is read back."""

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from tests.recording.recordings import KEYS, hear
from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.colours import SKY_BLUE
from vrg.recording import foxglove as fg
from vrg.recording.reader import read_sightings, read_sketches
from vrg.recording.recorder import Recorder
from vrg.recording.sketches import sketch_entity, strokes_of

COURSE = m.Stroke(points=((0.0, 0.0), (3.0, 4.0)), label="meets in 2.0 s")
DOT = m.Stroke(points=((1.0, 1.0),))
SEEN = m.Sighting(x=1.0, y=2.0, time=0.4, xx=0.01, xy=0.0, yy=0.02)
points = st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
strokes = st.builds(m.Stroke, points=st.lists(points, min_size=1, max_size=4, unique=True).map(tuple))


def recorded(folder: Path, *sketches: tuple[float, m.Sketch | None]) -> Path:
    """A recording of what ann sketches at each of these times; at None she sketches nothing."""
    recorder = Recorder("recorder", Mailbox(), KEYS, folder / "match.mcap")
    for number, (stamp, sketch) in enumerate(sketches):
        clock = m.Clock(time=stamp, tick=number, epoch=0, rate=1.0, estop=False)
        thought = [] if sketch is None else [(KEYS.sketch("ann"), sketch, stamp)]
        seen = [(KEYS.sightings("ann"), m.Sightings(seen=(SEEN,)), 0.5)] if number == 0 else []
        hear(recorder, (KEYS.clock, clock, stamp), *thought, *seen)
    recorder.stop()
    return folder / "match.mcap"


@given(st.lists(strokes, max_size=5))
def test_a_sketch_in_the_scene_can_be_read_back(drawn: list[m.Stroke]) -> None:
    entity = sketch_entity("ann", m.Sketch(strokes=drawn), SKY_BLUE, fg.Time(1, 0))
    found = strokes_of(entity)
    assert sorted(found, key=str) == sorted(drawn, key=str)


def test_a_label_stays_with_its_line(tmp_path: Path) -> None:
    path = recorded(tmp_path, (0.5, m.Sketch(strokes=(COURSE, DOT))))
    [thought] = read_sketches(path)
    assert (thought.player, thought.time) == ("ann", 0.5)
    assert sorted(thought.strokes, key=lambda s: len(s.points)) == [DOT, COURSE]


def test_sightings_are_read_back_by_player(tmp_path: Path) -> None:
    assert read_sightings(recorded(tmp_path, (0.5, m.Sketch(strokes=())))) == {"ann": [SEEN]}


def test_sketches_are_recorded_twice_a_second_and_one_that_is_empty_at_once(tmp_path: Path) -> None:
    times = [round(0.1 * n, 1) for n in range(1, 11)]
    many = [(time, m.Sketch(strokes=(m.Stroke(points=((time, 0.0),)),))) for time in times]
    path = recorded(tmp_path, *many, (1.05, m.Sketch(strokes=())), (1.1, m.Sketch(strokes=())))
    assert [(t.time, len(t.strokes)) for t in read_sketches(path)] == [(0.1, 1), (0.6, 1), (1.05, 0)]


def test_a_sketch_that_comes_too_soon_is_recorded_later(tmp_path: Path) -> None:
    first, last = (m.Sketch(strokes=(m.Stroke(points=((x, 0.0),)),)) for x in (1.0, 2.0))
    path = recorded(tmp_path, (0.1, first), (0.2, last), (0.9, None))
    assert [thought.strokes[0].points for thought in read_sketches(path)] == [((1.0, 0.0),), ((2.0, 0.0),)]
