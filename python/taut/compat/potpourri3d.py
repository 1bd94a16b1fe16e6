"""The point cloud solver of potpourri3d, by its names.

>>> import numpy as np
>>> import taut.compat.potpourri3d as pp3d
>>> rng = np.random.default_rng(7)
>>> points = rng.normal(size=(2000, 3))
>>> points /= np.linalg.norm(points, axis=1)[:, None]
>>> solver = pp3d.PointCloudHeatSolver(points)
>>> distances = solver.compute_distance(7)
>>> bool(np.abs(distances - np.arccos(np.clip(points @ points[7], -1, 1))).max() < 1e-3)
True

Distances, logarithms and transport follow geodesics to their claimed errors; there is no diffusion, and nothing is
smoothed. Where several sources are given, each point answers to the nearest of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import BadInputError, Surface

Floats = npt.NDArray[np.float64]

__all__ = ["PointCloudHeatSolver"]


class PointCloudHeatSolver:
    """Distances, logarithms and parallel transport on a cloud of points in space.

    Parameters
    ----------
    P : (n, 3) array
        The points.
    t_coef : float
        Taken for compatibility: geodesics need no diffusion time.

    Raises
    ------
    BadInputError
        Where no surface goes through the points, or they are not points in space.
    """

    def __init__(self, P: npt.ArrayLike, t_coef: float = 1.0) -> None:
        points = np.ascontiguousarray(P, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise BadInputError(f"P: found an array of shape {points.shape}, expected (n, 3)")
        self.surface = Surface(points)
        self._frames: tuple[Floats, Floats, Floats] | None = None

    def compute_distance(self, p_ind: int) -> Floats:
        """Distances of all points from the point of index `p_ind`, as an (n,) array."""
        return self.compute_distance_multisource([p_ind])

    def compute_distance_multisource(self, p_inds: Sequence[int] | npt.NDArray[Any]) -> Floats:
        """Distances of all points from the nearest of the points of the indices `p_inds`, as an (n,) array."""
        return self.surface.distance(_rows(p_inds)).distance

    def extend_scalar(
        self, p_inds: Sequence[int] | npt.NDArray[Any], values: Sequence[float] | npt.NDArray[Any]
    ) -> Floats:
        """The value of the nearest of some points, for all points, as an (n,) array.

        Not a number where no source leads to a point.
        """
        rows = _rows(p_inds)
        known = np.asarray(values, dtype=np.float64).reshape(-1)
        _expect_one_each(rows, known, "values")
        nearest = self.surface.distance(rows).source
        return np.where(nearest >= 0, known[nearest], np.nan)

    def get_tangent_frames(self) -> tuple[Floats, Floats, Floats]:
        """Two orthonormal tangents and the unit normal of each point: three (n, 3) arrays, X, Y and N = X x Y."""
        if self._frames is None:
            first, second = np.moveaxis(self.surface.tangents(), 1, 0)
            self._frames = (first, second, np.cross(first, second))
        return self._frames

    def transport_tangent_vector(self, p_ind: int, vector: npt.ArrayLike) -> Floats:
        """A tangent vector of one point, carried in parallel to all points, as an (n, 2) array.

        `vector` and the answer are coordinates along X and Y of `get_tangent_frames`.
        """
        return self.transport_tangent_vectors([p_ind], [vector])

    def transport_tangent_vectors(self, p_inds: Sequence[int] | npt.NDArray[Any], vectors: Any) -> Floats:
        """Tangent vectors of some points, each carried in parallel along the shortest geodesics to the points that it
        is nearest to, as an (n, 2) array. Not a number where no geodesic leads to a point.
        """
        rows = _rows(p_inds)
        given = np.asarray(vectors, dtype=np.float64).reshape(-1, 2)
        _expect_one_each(rows, given, "vectors")
        first, second, _ = self.get_tangent_frames()
        in_space = given[:, :1] * first[rows] + given[:, 1:] * second[rows]
        logarithms = self.surface.log_map(rows)
        # Along the tangents of its source, which are carried to each point.
        along = np.einsum("sij,sj->si", logarithms.tangents, in_space)
        nearest = logarithms.source
        carried = np.einsum("ni,nij->nj", along[nearest], logarithms.transported)
        found = np.stack([np.sum(carried * first, axis=1), np.sum(carried * second, axis=1)], axis=1)
        return np.where(nearest[:, None] >= 0, found, np.nan)

    def compute_log_map(self, p_ind: int) -> Floats:
        """The logarithms of all points at one point, along its X and Y, as an (n, 2) array."""
        row = int(p_ind)
        first, second, _ = self.get_tangent_frames()
        logarithms = self.surface.log_map(row)
        in_space = logarithms.vectors @ logarithms.tangents[0]
        return np.stack([in_space @ first[row], in_space @ second[row]], axis=1)

    def compute_signed_distance(self, *arguments: Any, **options: Any) -> Floats:
        """Signed distances from curves are not known here."""
        raise NotImplementedError("PointCloudHeatSolver.compute_signed_distance: taut has no signed distances yet")


def _rows(p_inds: Any) -> npt.NDArray[np.int64]:
    rows = np.asarray(p_inds).reshape(-1)
    if rows.dtype.kind not in "iu":
        raise BadInputError(f"p_inds: found values of type {rows.dtype}, expected indices")
    return rows.astype(np.int64)


def _expect_one_each(rows: npt.NDArray[np.int64], given: Floats, what: str) -> None:
    if len(rows) != len(given):
        raise BadInputError(f"{what}: found {len(given)} for {len(rows)} points, expected one for each")
