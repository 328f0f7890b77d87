"""Execution: where a study runs, and how its progress is reported. None of it decides a row."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris._core.scalars import SEED_RANGE, is_whole
from lampyris.errors import SettingError, UsageError, shown
from lampyris.study.design.row import Row

MAX_WORKERS = 512
"""Most processes on one machine."""

SCHEMES = ("tcp://", "tls://", "ucx://", "ws://", "wss://", "inproc://")
"""How the address of a Dask scheduler may begin."""


@dataclass(frozen=True, slots=True)
class Execution:
    """Where jobs are done.

    Parameters
    ----------
    workers : processes on this machine; 1: this one, which then judges and works by turns. At least 1.
    dask : address of the scheduler of a Dask cluster, as ``tcp://10.0.0.7:8786``; ``workers`` counts no more.
    shuffle : seed of another order of jobs; None: the order of the study. No row depends on it.

    Raises
    ------
    SettingError
        The number of workers or the seed is out of range.
    UsageError
        The address is none.
    """

    workers: int = 1
    dask: str | None = None
    shuffle: int | None = None

    def __post_init__(self) -> None:
        if not is_whole(self.workers, 1, MAX_WORKERS):
            raise SettingError(
                "WORKERS", f"{shown(self.workers)} workers", where="workers", allowed=f"1 to {MAX_WORKERS}"
            )
        if self.shuffle is not None and not is_whole(self.shuffle, 0):
            raise SettingError("SEED", shown(self.shuffle), where="shuffle", allowed=SEED_RANGE)
        if self.dask is not None and not (isinstance(self.dask, str) and self.dask.startswith(SCHEMES)):
            raise UsageError(
                "CLUSTER_ADDRESS",
                f"{shown(self.dask)} is not the address of a Dask scheduler",
                where="dask",
                allowed="tcp://HOST:PORT or tls://HOST:PORT",
            )

    @property
    def here(self) -> bool:
        """Whether it is this process that works."""
        return self.dask is None and self.workers == 1


@dataclass(frozen=True, slots=True)
class Progress:
    """What is done so far.

    Parameters
    ----------
    done : runs that have a row, those of earlier sittings among them.
    total : runs of the study. Two jobs of equal key are one run.
    failed, refused, timeouts : rows of this sitting that ended so.
    rows : stored since the last report.
    seconds_left : at the pace so far; None until there is one.
    workers : at work; 0 while they start.
    """

    done: int
    total: int
    failed: int = 0
    refused: int = 0
    timeouts: int = 0
    rows: tuple[Row, ...] = ()
    seconds_left: float | None = None
    workers: int = 0


@dataclass(frozen=True, slots=True)
class Finished:
    """What a sitting did.

    Parameters
    ----------
    total : runs of the study.
    before : of them, those that had a row already.
    ran : rows stored now: ``total - before`` when nothing stopped it.
    failed, refused, timeouts : of ``ran``, those that ended so.
    died : workers that died, or left the cluster.
    seconds : wall time.
    """

    total: int
    before: int
    ran: int
    failed: int
    refused: int
    timeouts: int
    died: int
    seconds: float
