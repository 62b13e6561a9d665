"""Spoilt inputs of every kind through the command line: `python -m tests.fuzz --count 20000 --seed 1`.

Every input is made from its kind and a seed, so a finding is made again by `--kind KIND --seed N --count 1`.
Fails when any input brings the program to a fault of its own, to Python's words, past 5 s of processor time
or past 1 GB. `--keep DIR` writes the findings there, one file each.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.fuzz.running import Finding, examine
from tests.fuzz.seeds import KINDS, Kind, write_seeds


def fuzz(
    count: int, seed: int, kinds: tuple[Kind, ...] = KINDS, jobs: int = 1, seconds: float | None = None
) -> Iterator[tuple[int, list[Finding]]]:
    """Examine inputs, kinds in turn; yields how many are done, and what was found in the last.

    Args:
        count: inputs.
        seed: of the first; they count up.
        kinds: which kinds.
        jobs: processes.
        seconds: stop after so long, whatever the count.
    """
    end = time.monotonic() + seconds if seconds else None
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        (work / "seeds").mkdir()
        write_seeds(work / "seeds")
        tasks = ((kinds[n % len(kinds)], seed + n // len(kinds), work, n) for n in range(count))
        # Each process forks anew for every command: nothing that one input leaves can help or harm another.
        with multiprocessing.get_context("fork").Pool(jobs) as pool:
            for done, found in enumerate(pool.imap_unordered(_examine, tasks), 1):
                yield done, found
                if end and time.monotonic() > end:
                    pool.terminate()
                    return


def _examine(task: tuple[Kind, int, Path, int]) -> list[Finding]:
    kind, seed, work, number = task
    return examine(kind, seed, work / "seeds", work / f"input{number}")


def _keep(finding: Finding, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    text = (
        f"{finding.kind} {finding.seed}\nquilt {finding.command}\n{finding.fault}\n\n{finding.output[:5000]}"
    )
    (folder / f"{finding.kind}_{finding.seed}.txt").write_text(text, encoding="utf-8", errors="replace")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, help="stop after so long")
    parser.add_argument("--kind", action="append", help="only these kinds")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    kinds = tuple(kind for kind in KINDS if given.kind is None or kind.name in given.kind)
    start, done, faults = time.monotonic(), 0, Counter[str]()
    for number, found in fuzz(given.count, given.seed, kinds, given.jobs, given.seconds):
        done = number
        for finding in found:
            faults[finding.fault] += 1
            print(
                f"{finding.kind} {finding.seed}: {finding.fault}\n  quilt {finding.command[:200]}", flush=True
            )
            print(*(f"    {line[:200]}" for line in finding.output.splitlines()[-3:]), sep="\n", flush=True)
            if given.keep:
                _keep(finding, given.keep)
    print(f"{done:,} inputs in {time.monotonic() - start:.0f} s, {sum(faults.values()):,} findings")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
