"""What the package costs beyond the command: `python measure.py TAUT`, with the command's path.

It prints the time of a field on a million points, that of 10,000 paths, and the time to import. Nothing else should run on the machine.
"""

from __future__ import annotations

import pathlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

BEGUN = time.perf_counter()
import taut  # noqa: E402

IMPORTED = time.perf_counter() - BEGUN


def sphere(count: int, seed: int) -> Any:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def least(work: Callable[[], Any], runs: int = 3) -> tuple[float, Any]:
    """The least time of some runs, and what the last one returned."""
    times = []
    for _ in range(runs):
        begun = time.perf_counter()
        found = work()
        times.append(time.perf_counter() - begun)
    return min(times), found


def main(command: str, folder: pathlib.Path) -> None:
    def run(*arguments: str) -> None:
        subprocess.run([command, *arguments, "--quiet"], check=True, capture_output=True)

    print(f"import beyond numpy: {1e3 * IMPORTED:.0f} ms")
    points = sphere(1_000_000, 1)
    np.save(folder / "million.npy", points)
    ours, field = least(lambda: taut.Surface(points).distance(0))
    distances = folder / "distances.npy"

    def by_command() -> None:
        distances.unlink(missing_ok=True)
        run("field", str(folder / "million.npy"), "--source", "0", "-o", str(distances))

    theirs, _ = least(by_command)
    same = np.array_equal(np.load(distances), field.distance)
    print(f"field, 1M points: {ours:.2f} s, by the command with its files {theirs:.2f} s; same bits: {same}")

    points = sphere(100_000, 2)
    np.save(folder / "cloud.npy", points)
    surface = taut.Surface(points)
    pairs = np.random.default_rng(3).integers(0, len(points), (10_000, 2))
    surface.paths(pairs[:10])
    ours, _ = least(lambda: surface.paths(pairs))

    def paths_by_command(count: int) -> float:
        np.savetxt(folder / "pairs.csv", pairs[:count], delimiter=",", fmt="%d")
        cloud, listed = str(folder / "cloud.npy"), str(folder / "pairs.csv")
        return least(lambda: run("path", cloud, "--pairs", listed, "--json"))[0]

    theirs = paths_by_command(len(pairs)) - paths_by_command(1)
    print(f"10,000 paths: {ours:.2f} s, by the command without its set-up {theirs:.2f} s")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        main(sys.argv[1], pathlib.Path(name))
