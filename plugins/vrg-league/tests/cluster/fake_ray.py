"""As much of Ray as VRG uses, with a process for each task, so that what is built on it is tested everywhere."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from multiprocessing.process import BaseProcess
from types import SimpleNamespace
from typing import Any

_context = multiprocessing.get_context("spawn")


class RayError(Exception):
    """The base class of Ray's errors."""


class RayTaskError(RayError):
    """A task has raised `cause`."""

    def __init__(self, cause: BaseException) -> None:
        super().__init__(str(cause))
        self.cause = cause


class WorkerCrashedError(RayError):
    """The worker of a task has died."""


class _OtherError(RayError):
    """Another error, which does not occur here."""


exceptions = SimpleNamespace(
    RayError=RayError, RayTaskError=RayTaskError, WorkerCrashedError=WorkerCrashedError,
    NodeDiedError=_OtherError, OutOfMemoryError=_OtherError, ObjectLostError=_OtherError,
)  # fmt: skip


class Ref:
    """A task that runs."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        self.answer, theirs = _context.Pipe()
        self.arguments = arguments
        self.process: BaseProcess = _context.Process(target=_work, args=(theirs, function, arguments), daemon=True)
        self.process.start()
        theirs.close()


def _work(answer: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    os.setsid()
    try:
        answer.send((function(*arguments), None))
    except Exception as error:
        answer.send((None, error))


started: list[Ref] = []
"""The tasks that were started, in order."""


def init(**_options: object) -> None:
    started.clear()


def shutdown() -> None:
    for ref in started:
        cancel(ref)


def cluster_resources() -> dict[str, float]:
    return {"CPU": 2.0}


def remote(**_options: object) -> Callable[[Callable[..., Any]], Any]:
    def wrap(function: Callable[..., Any]) -> Any:
        def start(*arguments: Any) -> Ref:
            started.append(Ref(function, arguments))
            return started[-1]

        return SimpleNamespace(remote=start)

    return wrap


def put(content: bytes) -> bytes:
    return content


def wait(refs: Sequence[Ref], *, num_returns: int, timeout: float) -> tuple[list[Ref], list[Ref]]:
    ready = wait_for([ref.answer for ref in refs], timeout)
    done = [ref for ref in refs if ref.answer in ready][:num_returns]
    return done, [ref for ref in refs if ref not in done]


def get(ref: Ref) -> Any:
    try:
        result, error = ref.answer.recv()
    except EOFError:
        raise WorkerCrashedError("the worker was killed") from None
    if error is not None:
        raise RayTaskError(error)
    return result


def cancel(ref: Ref, *, force: bool = False) -> None:
    if ref.process.is_alive() and ref.process.pid is not None:
        os.kill(ref.process.pid, signal.SIGINT)
        ref.process.join(30.0)
