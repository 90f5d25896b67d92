"""A cluster of Ray (https://www.ray.io), which is an optional part of VRG: `pip install vrg[cluster]`.

A task of Ray calls `vrg.evaluation.remote.play` in a worker of Ray's, and this plays the game in a process of its own
below the worker. Ray itself does not repeat tasks, so that the games that were played again are counted in one place.
"""

import importlib.util
import logging
import os
import signal
import socket
import threading
from collections.abc import Sequence
from typing import Any

from vrg.errors import LaunchError
from vrg.evaluation.cluster import Cluster, WorkerDiedError
from vrg.evaluation.remote import Answer, Task, play

LOCAL = "local"
"""The address that starts a cluster on this computer."""
_PROBE = 3.0
"""The real time in s for a cluster to accept a connection."""
_STORE = 200_000_000
"""The memory in bytes for what the games of a local cluster share: matches and logs."""


def require_ray() -> None:
    """Check that Ray is installed, without loading it.

    Raises:
        LaunchError: it is not.
    """
    if importlib.util.find_spec("ray") is None:
        raise LaunchError(
            "expected the package ray for --ray, found none: install it by `pip install 'vrg[cluster]'` here and on "
            "every computer of the cluster, or leave out --ray to play on this computer"
        )


class RayCluster(Cluster):
    """See the module.

    Args:
        address: of a cluster that runs, such as `auto` or `192.168.1.5:6379`; LOCAL starts one that ends with this
            process.
        jobs: the number of games at a time of a local cluster.

    Raises:
        LaunchError: Ray is not installed, or the cluster cannot be reached.
    """

    def __init__(self, address: str, jobs: int) -> None:
        require_ray()
        # By default Ray reports to its makers how it is used.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        if address == LOCAL:
            # By default Ray's workers give way to every other program of this computer.
            os.environ.setdefault("RAY_worker_niceness", "0")
        import ray  # noqa: PLC0415 - only who asks for a cluster loads it

        self._ray: Any = ray
        local = {"num_cpus": jobs, "include_dashboard": False, "object_store_memory": _STORE}
        options = local if address == LOCAL else {"address": address}
        if address not in (LOCAL, "auto"):
            _check_reachable(address)
        main = threading.current_thread() is threading.main_thread()
        before = signal.getsignal(signal.SIGTERM) if main else None
        try:
            ray.init(log_to_driver=False, logging_level=logging.ERROR, **options)
        except (ConnectionError, ValueError, RuntimeError, OSError) as error:
            raise LaunchError(
                f"--ray {address}: the cluster cannot be used: {_brief(error)}: is it one of the same release of Ray, "
                "and if it asks for a token, does this computer have it?"
            ) from None
        finally:
            if before is not None:
                # Ray's own handler would end this process before it has said what is known.
                signal.signal(signal.SIGTERM, before)
        self._play = ray.remote(num_cpus=1, max_retries=0)(play)

    @property
    def size(self) -> int:
        """The number of games that the computers of the cluster can play at a time."""
        return max(1, int(self._ray.cluster_resources().get("CPU", 1)))

    def share(self, content: bytes) -> Any:
        """Bring bytes to where all workers find them."""
        return self._ray.put(content)

    def submit(self, task: Task, match: Any) -> Any:
        """Let some worker play a game."""
        return self._play.remote(task, match)

    def ready(self, games: Sequence[Any], timeout: float) -> list[Any]:
        """Wait at most `timeout` seconds for a game to end, and return those that have."""
        ready: list[Any] = self._ray.wait(list(games), num_returns=len(games), timeout=timeout)[0] if games else []
        return ready

    def answer(self, game: Any) -> Answer:
        """What came out of a game that is ready; see `Cluster.answer`."""
        errors = self._ray.exceptions
        try:
            answer: Answer = self._ray.get(game)
        except errors.RayTaskError as error:
            raise LaunchError(f"a game cannot be played on the cluster: {_brief(error.cause)}") from None
        except (errors.WorkerCrashedError, errors.NodeDiedError, errors.OutOfMemoryError, errors.ObjectLostError) as e:
            raise WorkerDiedError(_brief(e)) from None
        except errors.RayError as error:
            raise LaunchError(f"the cluster has failed: {_brief(error)}: the same command goes on") from None
        return answer

    def cancel(self, game: Any) -> None:
        """End a game."""
        self._ray.cancel(game, force=False)

    def close(self) -> None:
        """Leave the cluster; a local one ends. Idempotent."""
        self._ray.shutdown()


def _check_reachable(address: str) -> None:
    """Check that something listens at an address. Ray itself would try for minutes.

    Raises:
        LaunchError: the address cannot be read, or nothing listens there.
    """
    host, _, port = address.removeprefix("ray://").rpartition(":")
    try:
        socket.create_connection((host, int(port)), timeout=_PROBE).close()
    except (OSError, ValueError) as error:
        raise LaunchError(
            f"--ray {address}: expected local, auto, or the host and port of a cluster that runs, such as "
            f"192.168.1.5:6379: {error}"
        ) from None


def _brief(error: BaseException) -> str:
    """The first line of what an error says."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
