"""A matrix run killed ten times at random moments: the same bytes as undisturbed?

python3 killed.py TAUT [POINTS] [SOURCES]

Makes a random torus (1, 0.4), runs `taut matrix` undisturbed with 1 and with 2 threads, then again and again with a kill
(SIGKILL) at a random moment each, ten times, and compares the bytes of lengths, errors and paths.
"""

import math
import pathlib
import random
import subprocess
import sys
import tempfile
import time

KILLS = 10


def torus(count):
    for _ in range(count):
        while True:
            u, v = (math.tau * random.random() for _ in range(2))
            if 1.4 * random.random() <= 1 + 0.4 * math.cos(v):
                break
        width = 1 + 0.4 * math.cos(v)
        yield width * math.cos(u), width * math.sin(u), 0.4 * math.sin(v)


def main(taut, points=20000, sources=272):
    random.seed(1)
    folder = pathlib.Path(tempfile.mkdtemp())
    cloud, rows = folder / "torus.xyz", folder / "rows.txt"
    cloud.write_text("".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in torus(int(points))))
    rows.write_text("".join(f"{row}\n" for row in range(int(sources))))

    def command(name, threads):
        run = folder / name
        run.mkdir(exist_ok=True)
        files = ["-o", run / "D.npy", "--errors", run / "E.npy", "--paths", run / "paths"]
        options = ["--quiet", "--threads", str(threads)]
        # The journal holds the names of the files as given: the same for every run of a folder.
        return [taut, "matrix", cloud, "--sources", rows, *files, *options]

    def contents(name):
        files = sorted(path for path in (folder / name).rglob("*") if path.is_file())
        return {path.relative_to(folder / name): path.read_bytes() for path in files}

    took = {}
    for threads in (1, 2):
        start = time.monotonic()
        subprocess.run(command(f"whole{threads}", threads), check=True, stdout=subprocess.DEVNULL)
        took[threads] = time.monotonic() - start
    expected = contents("whole1")
    same = contents("whole2") == expected
    print(f"undisturbed: {took[1]:.2f} s, {took[2]:.2f} s by 2 threads, {len(expected)} files, the same bytes: {same}")
    kills, runs = 0, 0
    while True:
        threads = 1 + runs % 2
        runs += 1
        child = subprocess.Popen(command("killed", threads), stdout=subprocess.DEVNULL)
        try:
            # Set-up comes first each time: a share of the whole run behind it goes on.
            patience = took[threads] * random.uniform(0.0, 0.45) if kills < KILLS else None
            child.wait(patience)
            if child.returncode != 0:
                sys.exit(f"ended with {child.returncode}")
            break
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
            kills += 1
            journal = folder / "killed" / "D.npy.journal"
            done = journal.read_text().count('"block"') if journal.exists() else 0
            print(f"killed after {patience:.2f} s, {done} blocks done")
    found = contents("killed")
    print(f"killed {kills} times: the same bytes: {found == expected}")
    sys.exit(found != expected or not same)


if __name__ == "__main__":
    main(*sys.argv[1:])
