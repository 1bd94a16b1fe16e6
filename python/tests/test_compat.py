"""The names of potpourri3d against closed forms on a sphere."""

from __future__ import annotations

import numpy as np
import pytest

import taut
import taut.compat.potpourri3d as pp3d


@pytest.fixture(scope="module")
def sphere() -> tuple[np.ndarray, pp3d.PointCloudHeatSolver]:
    points = np.random.default_rng(21).normal(size=(5000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points, pp3d.PointCloudHeatSolver(points, t_coef=1.0)


def angle(points: np.ndarray, row: int) -> np.ndarray:
    return 2 * np.arcsin(np.minimum(np.linalg.norm(points - points[row], axis=1) / 2, 1))


def test_distances_and_extensions(sphere):
    points, solver = sphere
    truth = np.array([angle(points, row) for row in (7, 100, 2000)])
    assert np.abs(solver.compute_distance(7) - truth[0]).max() < 1e-5
    assert np.abs(solver.compute_distance_multisource([7, 100, 2000]) - truth.min(axis=0)).max() < 1e-5
    extended = solver.extend_scalar([7, 100, 2000], [0.0, 10.0, 3.0])
    order = np.sort(truth, axis=0)
    clear = order[1] - order[0] > 1e-3
    assert np.array_equal(extended[clear], np.array([0.0, 10.0, 3.0])[truth.argmin(axis=0)][clear])


def test_frames_are_right_handed_and_tangent(sphere):
    points, solver = sphere
    first, second, normal = solver.get_tangent_frames()
    assert np.abs(np.abs(np.sum(normal * points, axis=1)) - 1).max() < 1e-6
    for a, b, dot in ((first, first, 1), (second, second, 1), (first, second, 0), (first, normal, 0)):
        assert np.allclose(np.sum(a * b, axis=1), dot, atol=1e-12)
    assert np.allclose(np.cross(first, second), normal)


def test_transport_follows_great_circles(sphere):
    points, solver = sphere
    first, second, _ = solver.get_tangent_frames()
    row = 42
    found = solver.transport_tangent_vector(row, [6.0, 2.0])
    vector = 6 * first[row] + 2 * second[row]
    # Along a great circle the part across it is kept, and the part along it turns with it.
    known = (angle(points, row) > 0.05) & (angle(points, row) < 3)
    axis = np.cross(points[row], points[known])
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    ahead = np.cross(axis, points[row])
    there = np.cross(axis, points[known])
    truth = (axis @ vector)[:, None] * axis + (ahead @ vector)[:, None] * there
    carried = found[known, :1] * first[known] + found[known, 1:] * second[known]
    # Directions are known less well near the source, as a share of the vector's length of 6.3.
    error = np.linalg.norm(carried - truth, axis=1) / np.hypot(6, 2)
    assert np.median(error) < 1e-4
    assert error.max() < 2e-2 and error[angle(points, row)[known] > 0.2].max() < 3e-3
    both = solver.transport_tangent_vectors([row, 77], [[6.0, 2.0], [3.0, 4.0]])
    lengths = np.linalg.norm(both, axis=1)
    assert np.all((np.abs(lengths - np.hypot(6, 2)) < 1e-5) | (np.abs(lengths - 5) < 1e-5))


def test_logarithms_are_in_the_frames(sphere):
    points, solver = sphere
    first, second, _ = solver.get_tangent_frames()
    found = solver.compute_log_map(1)
    known = angle(points, 1) < 2.8
    ahead = points - points[1] * (points @ points[1])[:, None]
    ahead *= (angle(points, 1) / np.maximum(np.linalg.norm(ahead, axis=1), 1e-300))[:, None]
    truth = np.stack([ahead @ first[1], ahead @ second[1]], axis=1)
    assert np.abs(found - truth)[known].max() < 4e-3 and np.median(np.abs(found - truth)) < 1e-4


def test_what_is_wrong_or_lacking_is_named(sphere):
    _, solver = sphere
    with pytest.raises(NotImplementedError, match="compute_signed_distance"):
        solver.compute_signed_distance([[0, 1]], None)
    with pytest.raises(taut.BadInputError, match="found 1 for 2"):
        solver.extend_scalar([1, 2], [0.5])
    with pytest.raises(taut.BadInputError, match=r"\(n, 3\)"):
        pp3d.PointCloudHeatSolver(np.zeros((5, 2)))
