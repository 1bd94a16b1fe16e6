"""The package against closed forms, and its manners: errors, pickles, forks, threads, interrupts."""

from __future__ import annotations

import multiprocessing
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import taut


def sphere(count: int, seed: int, offset: float = 0.0) -> np.ndarray:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None] + offset


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return 2 * np.arcsin(np.minimum(np.linalg.norm(a - b, axis=-1) / 2, 1))


@pytest.fixture(scope="module")
def cloud() -> tuple[np.ndarray, taut.Surface]:
    points = sphere(6000, 11, offset=5.0)
    return points, taut.Surface(points)


def test_paths_keep_to_their_claims(cloud):
    points, surface = cloud
    pairs = np.random.default_rng(3).integers(0, len(points), (60, 2))
    found = surface.paths(pairs)
    by_points = surface.paths(points[pairs])
    for (a, b), path, other in zip(pairs, found, by_points):
        truth = angle(points[a], points[b])
        assert path.converged and abs(path.length - truth) <= path.error + 1e-12
        assert abs(path.length - truth) < 1e-6 * truth
        assert other.length == pytest.approx(path.length, rel=1e-6)
        assert np.allclose(path.points[[0, -1]], points[[a, b]], atol=1e-5)
        assert path.arc_length[-1] == pytest.approx(path.length, rel=1e-6)
        assert path.checked() is path
    assert surface.path(int(pairs[0, 0]), int(pairs[0, 1])) == found[0]


def test_distances_keep_to_their_claims(cloud):
    points, surface = cloud
    sources = np.array([17, 4000])
    found = surface.distance(sources)
    truths = np.array([angle(points, points[s]) for s in sources])
    truth = truths.min(axis=0)
    assert (np.abs(found.distance - truth) <= found.error + 1e-12).mean() > 0.99
    assert np.abs(found.distance - truth).max() < 1e-4
    clear = np.abs(truths[0] - truths[1]) > 1e-3
    assert (found.source == truths.argmin(axis=0))[clear].all()
    there = surface.distance(points[sources], to=points[::100])
    assert np.allclose(there.distance, found.distance[::100], atol=1e-6)
    assert np.asarray(found).shape == (6000,) and len(found) == 6000
    near = surface.distance(17, max_distance=0.5)
    assert np.isinf(near.distance).any() and near.distance[np.isfinite(near.distance)].max() <= 0.5


def test_matrices_and_maps(cloud):
    points, surface = cloud
    sources, targets = np.array([3, 1234]), np.array([5000, 42, 7])
    matrix = surface.distance_matrix(sources, targets)
    truth = angle(points[sources][:, None], points[targets][None])
    assert matrix.length.shape == (2, 3) and (matrix.status == "converged").all()
    assert np.abs(matrix.length - truth).max() < 1e-5
    square = surface.distance_matrix(sources)
    assert square.length[0, 0] == 0 and square.length[0, 1] == pytest.approx(square.length[1, 0], rel=1e-6)
    found = surface.log_map(3)
    lengths = np.linalg.norm(found.vectors, axis=1)
    assert np.allclose(lengths, angle(points, points[3]), atol=1e-4)
    for row in (10, 2000, 5999):
        shot = surface.exp_map(3, found.vectors[row] @ found.tangents[0])
        assert np.linalg.norm(shot.end - points[row]) <= found.error[row] + shot.error + 1e-3 * lengths[row]


def test_equations_shapes_and_models():
    sphere_of_two = taut.Equation("x^2 + y^2 + z^2 = 4")
    path = sphere_of_two.path([2.0, 0, 0], [0, 0, 2.0], tol=1e-11)
    assert path.length == pytest.approx(np.pi, rel=1e-10) and path.surface_error == 0
    with pytest.raises(taut.NoRowsError):
        sphere_of_two.distance([2.0, 0, 0])
    clifford = taut.Equation(["x1^2 + x2^2 = 1", "x3^2 + x4^2 = 1"], coordinates=4)
    assert clifford.path([1.0, 0, 1, 0], [0.0, 1, 0, 1]).length == pytest.approx(np.pi / np.sqrt(2), rel=1e-6)
    far = taut.Equation("(x - 900)^2 + y^2 + z^2 = 1", bounds=([898, -2, -2], [902, 2, 2]))
    assert far.path([901.0, 0, 0], [900.0, 1, 0]).length == pytest.approx(np.pi / 2, rel=1e-6)
    assert taut.Shape("torus:1,0.4").path([1.4, 0, 0], [0.6, 0, 0]).length == pytest.approx(0.4 * np.pi, rel=1e-6)
    points = sphere(3000, 5)
    model = taut.Surface.fit(points)
    assert model.path(points[0], points[9]).length == pytest.approx(angle(points[0], points[9]), rel=1e-2)


def test_any_dtype_order_and_kind_of_ends():
    points = sphere(2000, 2)
    surface = taut.Surface(points)
    expected = surface.path(5, 900).length
    for same in (np.asfortranarray(points), points.tolist(), np.repeat(points, 2, axis=1)[:, ::2]):
        assert taut.Surface(same).path(np.int32(5), np.uint16(900)).length == expected
    single = taut.Surface(points.astype(np.float32))
    assert single.path(5, 900).length == pytest.approx(expected, rel=1e-5)
    before = points.copy()
    points.setflags(write=False)
    assert taut.Surface(points).distance([0, 1]).distance[0] < 1e-9
    assert (points == before).all()


def test_parts_are_told_apart():
    surface = taut.Surface(np.r_[sphere(1500, 1), sphere(1500, 2, offset=9.0)])
    path = surface.path(0, 2000)
    assert path.status == "no-path" and np.isinf(path.length) and len(path.points) == 0
    with pytest.raises(taut.NoPathError):
        path.checked()
    assert np.isinf(surface.distance(0).distance[1500:]).all()
    assert len(surface.check().parts) == 2


@pytest.mark.parametrize(
    ("error", "question"),
    [
        (taut.BadInputError, lambda surface: taut.Surface(np.zeros((5, 3)))),
        (taut.BadInputError, lambda surface: taut.Surface(np.zeros(12))),
        (taut.BadInputError, lambda surface: taut.Surface(sphere(100, 1)[:, [0, 1, 2, 0]])),
        (taut.BadInputError, lambda surface: taut.Surface(np.zeros((9, 17)))),
        (taut.BadInputError, lambda surface: surface.path("a", 3)),
        (taut.BadInputError, lambda surface: surface.path([1.0, 2.0], 3)),
        (taut.BadInputError, lambda surface: surface.path(-1, 3)),
        (taut.BadInputError, lambda surface: surface.path([0, 1], 3)),
        (taut.BadInputError, lambda surface: surface.paths([[1, 2, 3]])),
        (taut.NoPlaceError, lambda surface: surface.path(10**7, 3)),
        (taut.NoPlaceError, lambda surface: surface.distance([0, 10**7])),
        (taut.FormulaError, lambda surface: taut.Equation("x^2 +")),
        (taut.BadInputError, lambda surface: taut.Equation("x^2 + y^2 + z^2 = -1")),
        (taut.FormulaError, lambda surface: taut.Shape("cube:1")),
        (taut.BadInputError, lambda surface: surface.exp_map(0, [1.0, 0.0])),
    ],
)
def test_what_cannot_be_is_refused_by_name(cloud, error, question):
    with pytest.raises(error) as caught:
        question(cloud[1])
    assert isinstance(caught.value, (taut.TautError, ValueError)) and len(str(caught.value)) > 20
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is type(caught.value) and str(again) == str(caught.value)


def test_rows_that_are_no_points_have_no_place():
    points = sphere(2000, 4)
    points[7] = np.nan
    surface = taut.Surface(points)
    with pytest.raises(taut.NoPlaceError):
        surface.path(7, 3)
    found = surface.distance(3)
    assert np.isnan(found.distance[7]) and found.source[7] == -1 and np.isfinite(found.distance[8])


def test_all_pickles(cloud):
    points, surface = cloud
    again = pickle.loads(pickle.dumps(surface))
    assert again.path(1, 2) == surface.path(1, 2)
    assert (again.distance(1).distance == surface.distance(1).distance).all()
    ring = taut.Equation("(sqrt(x^2 + y^2) - 1)^2 + z^2 = 0.16")
    for made in (ring, taut.Shape("sphere:1")):
        assert repr(pickle.loads(pickle.dumps(made))) == repr(made)
    answers = [surface.path(1, 2), surface.distance(1), surface.log_map(1), surface.distance_matrix([1, 2]), surface.check()]
    for answer in [*answers, surface.exp_map(0, [0.1, 0.2, 0.3])]:
        assert pickle.loads(pickle.dumps(answer)) == answer and repr(answer)


def test_same_bits_on_any_number_of_threads(cloud):
    points, surface = cloud
    one = taut.Surface(points, threads=1).distance(9, threads=1)
    two = taut.Surface(points, threads=2).distance(9, threads=2)
    assert one == two == surface.distance(9)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda row: surface.path(row, 77).length, range(40)))
    assert found == [surface.path(row, 77).length for row in range(40)]


def _length(surface: taut.Surface) -> float:
    return float(surface.distance(9).distance.sum())


def test_a_forked_process_has_threads_of_its_own(cloud):
    surface = cloud[1]
    expected = _length(surface)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map_async(_length, [surface] * 3).get(timeout=120) == [expected] * 3


def test_the_lock_is_free_while_work_is_done():
    points = sphere(150_000, 8)
    ticks = 0
    done = threading.Event()

    def count() -> None:
        nonlocal ticks
        while not done.wait(0.001):
            ticks += 1

    counter = threading.Thread(target=count)
    counter.start()
    taut.Surface(points)
    done.set()
    counter.join()
    assert ticks > 10


def test_an_interrupt_ends_a_call():
    script = """
        import numpy as np, taut
        points = np.random.default_rng(1).normal(size=(3_000_000, 3))
        points /= np.linalg.norm(points, axis=1)[:, None]
        print("begun", flush=True)
        try:
            taut.Surface(points)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
            import os; os._exit(0)
    """
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(script)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "begun"
    time.sleep(1.0)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline().strip() == "interrupted"
    assert time.monotonic() - sent < 5.0
    assert process.wait(timeout=60) == 0
