"""What players sketch and see is in a recording, and is read back."""

from pathlib import Path

from tests.recording.recordings import KEYS, hear, written
from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.recording.reader import sightings_of, thoughts_of
from vrg.recording.recorded import read_recorded
from vrg.recording.recorder import Recorder
from vrg.recording.scene import FIGURE

COURSE = m.Stroke(points=((0.0, 0.0), (3.0, 4.0)), label="meets in 2.0 s")
DOT = m.Stroke(points=((1.0, 1.0),))
SEEN = m.Sighting(x=1.0, y=2.0, time=0.4, xx=0.01, xy=0.0, yy=0.02)


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


def test_a_sketch_is_read_back_and_drawn_in_the_scene(tmp_path: Path) -> None:
    path = recorded(tmp_path, (0.5, m.Sketch(strokes=(COURSE, DOT))))
    [thought] = thoughts_of(read_recorded(path))
    assert (thought.player, thought.time, thought.strokes) == ("ann", 0.5, (COURSE, DOT))
    [(_, drawn)] = written(path, "/view/sketch/ann")
    [entity] = drawn["entities"]
    assert (len(entity["lines"]), len(entity["spheres"])) == (1, 2)
    heights = {point["z"] for line in entity["lines"] for point in line["points"]}
    assert min(heights) > FIGURE * 12, "no zone hides them"
    assert [text["text"] for text in entity["texts"]] == [COURSE.label]


def test_sightings_are_read_back_by_player(tmp_path: Path) -> None:
    assert sightings_of(read_recorded(recorded(tmp_path, (0.5, m.Sketch(strokes=()))))) == {"ann": [SEEN]}


def test_sketches_are_recorded_twice_a_second_and_one_that_is_empty_at_once(tmp_path: Path) -> None:
    times = [round(0.1 * n, 1) for n in range(1, 11)]
    many = [(time, m.Sketch(strokes=(m.Stroke(points=((time, 0.0),)),))) for time in times]
    path = recorded(tmp_path, *many, (1.05, m.Sketch(strokes=())), (1.1, m.Sketch(strokes=())))
    assert [(t.time, len(t.strokes)) for t in thoughts_of(read_recorded(path))] == [(0.1, 1), (0.6, 1), (1.05, 0)]


def test_a_sketch_that_comes_too_soon_is_recorded_later(tmp_path: Path) -> None:
    first, last = (m.Sketch(strokes=(m.Stroke(points=((x, 0.0),)),)) for x in (1.0, 2.0))
    path = recorded(tmp_path, (0.1, first), (0.2, last), (0.9, None))
    assert [thought.strokes[0].points for thought in thoughts_of(read_recorded(path))] == [((1.0, 0.0),), ((2.0, 0.0),)]
