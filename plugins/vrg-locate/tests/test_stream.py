"""What comes in from the real world is kept until it is taken, and what stops is begun again."""

import queue
from collections.abc import Iterator

import pytest

from vrg.errors import ConfigError
from vrg.testing.waiting import wait_until
from vrg_locate import stream as module
from vrg_locate.stream import LiveStream


class Numbers(LiveStream[int]):
    """The numbers that a test puts into a queue. None ends them, and text is raised as an error."""

    def __init__(self) -> None:
        super().__init__("numbers", 0.3, 3)
        self.coming: queue.Queue[int | str | None] = queue.Queue()
        self.begun = 0

    def listen(self) -> str:
        self.begun += 1
        while not self.ending.is_set():
            try:
                item = self.coming.get(timeout=0.02)
            except queue.Empty:
                continue
            if isinstance(item, str):
                raise ConfigError(item)
            if item is None:
                break
            self.put(item, counts=item > 0)
        return "there are no numbers"

    def silent(self, silence: float) -> str:
        return "no number has come"


@pytest.fixture
def numbers(monkeypatch: pytest.MonkeyPatch) -> Iterator[Numbers]:
    monkeypatch.setattr(module, "RETRY_PERIOD", 0.05)
    made = Numbers()
    made.start()
    yield made
    made.close()
    made.close()
    assert not made._thread.is_alive()


def test_items_are_taken_once_and_in_order_and_the_oldest_are_dropped(numbers: Numbers) -> None:
    for number in range(1, 6):
        numbers.coming.put(number)
    wait_until(lambda: numbers.coming.empty() and len(numbers._items) == 3, "the numbers")
    wait_until(lambda: 5 in numbers._items, "the last number")
    assert numbers.take() == [3, 4, 5]
    assert numbers.take() == []
    numbers.coming.put(6)
    assert numbers.take(patience=60.0) == [6]


@pytest.mark.parametrize(("end", "problem"), [(None, "there are no numbers"), ("broken", "broken")])
def test_what_stops_is_a_problem_until_it_comes_again(numbers: Numbers, end: str | None, problem: str) -> None:
    numbers.coming.put(end)
    wait_until(lambda: numbers.problem() == problem, "the problem")
    wait_until(lambda: numbers.begun > 1, "another beginning")
    numbers.coming.put(1)
    wait_until(lambda: numbers.problem() is None, "the end of the problem")


def test_silence_is_a_problem_and_only_what_counts_ends_it(numbers: Numbers) -> None:
    wait_until(lambda: numbers.problem() == "no number has come", "the silence")
    numbers.coming.put(-1)
    assert numbers.take(patience=60.0) == [-1]
    assert numbers.problem() == "no number has come"
    numbers.coming.put(1)
    wait_until(lambda: numbers.problem() is None, "the end of the silence")
