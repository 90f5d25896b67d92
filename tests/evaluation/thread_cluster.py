"""A cluster whose workers are threads of this process: all of a cluster but Ray, so that it is tested everywhere."""

import threading
from collections.abc import Sequence
from dataclasses import dataclass, field

from vrg.errors import LaunchError
from vrg.evaluation.cluster import Cluster, WorkerDiedError
from vrg.evaluation.remote import Answer, Task, play


@dataclass(eq=False)
class Job:
    """A game that a worker plays."""

    task: Task
    dead: threading.Event = field(default_factory=threading.Event)
    done: threading.Event = field(default_factory=threading.Event)
    answer: Answer | None = None
    error: Exception | None = None


class ThreadCluster(Cluster):
    """See the module.

    Attributes:
        jobs: every game that was submitted.
        deadly: the number of workers that die as soon as they have a game.
    """

    def __init__(self, deadly: int = 0) -> None:
        self.jobs: list[Job] = []
        self.deadly = deadly
        self._some_done = threading.Condition()

    def share(self, content: bytes) -> bytes:
        return content

    def submit(self, task: Task, match: bytes) -> Job:
        job = Job(task)
        self.jobs.append(job)
        if self.deadly:
            self.deadly -= 1
            job.dead.set()
        threading.Thread(target=self._work, args=(job, match), daemon=True).start()
        return job

    def _work(self, job: Job, match: bytes) -> None:
        try:
            job.answer = play(job.task, match, lambda: not job.dead.is_set())
        except Exception as error:
            job.error = error
        with self._some_done:
            job.done.set()
            self._some_done.notify_all()

    def kill_worker(self) -> None:
        """Let the worker of a game that is being played die, if there is one."""
        for job in self.jobs:
            if not job.done.is_set():
                job.dead.set()
                return

    def ready(self, games: Sequence[Job], timeout: float) -> list[Job]:
        with self._some_done:
            self._some_done.wait_for(lambda: any(job.done.is_set() for job in games), timeout)
        return [job for job in games if job.done.is_set()]

    def answer(self, game: Job) -> Answer:
        if game.dead.is_set():
            raise WorkerDiedError("the worker was killed")
        if game.answer is None:
            raise LaunchError(f"a game cannot be played on the cluster: {game.error}")
        return game.answer

    def cancel(self, game: Job) -> None:
        game.dead.set()
        game.done.wait(30.0)

    def close(self) -> None:
        for job in self.jobs:
            self.cancel(job)
