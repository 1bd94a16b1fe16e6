"""The surface that everything is asked of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from . import _taut
from ._answers import Check, DistanceMatrix, Distances, Logarithms, Path, Shot
from ._errors import BadInputError, NoRowsError

#: A row, a point, rows or points.
Ends = Union[int, npt.ArrayLike]


def _places(ends: Ends, coordinates: int, what: str) -> npt.NDArray[Any]:
    """Rows as an int64 array, or points as a float64 array of one point a row."""
    array = np.asarray(ends)
    if array.dtype.kind not in "iuf":
        raise BadInputError(f"{what}: found values of type {array.dtype}, expected rows (int) or coordinates (float)")
    if array.dtype.kind in "iu" and array.ndim <= 1:
        rows = np.ascontiguousarray(array.reshape(-1), dtype=np.int64)
        if (rows < 0).any():
            raise BadInputError(f"{what}: found the row {rows[rows < 0][0]}, expected rows counted from 0")
        return rows
    points = np.atleast_2d(np.asarray(array, dtype=np.float64))
    if points.ndim != 2 or points.shape[1] != coordinates:
        raise BadInputError(
            f"{what}: found an array of shape {array.shape}, expected points of {coordinates} coordinates"
        )
    return np.ascontiguousarray(points)


def _place(end: Ends, coordinates: int, what: str) -> npt.NDArray[Any]:
    places = _places(end, coordinates, what)
    if len(places) != 1:
        raise BadInputError(f"{what}: found {len(places)} ends, expected one row or one point")
    return places


class Surface:
    """A smooth surface through points.

    Parameters
    ----------
    points : (n, d) array
        Coordinates, d from 2 to 16, of any dtype and order. Rows with a value that is not finite have no place on the
        surface.
    dimension : int, optional
        The dimension of the surface: 2 unless given for points in the plane and in space; to be given for others.
    threads : int, optional
        How many threads work; all cores unless given.

    Raises
    ------
    BadInputError
        Where no surface goes through the points.

    Notes
    -----
    O(n log n) time and O(n) memory. A surface pickles as its points and is built anew, to the same bits. It keeps a
    reference to a C-ordered float64 array for that; do not change the array.

    Examples
    --------
    >>> import numpy as np, taut
    >>> i = np.arange(2000)
    >>> z = 1 - (2 * i + 1) / 2000
    >>> points = np.c_[np.sqrt(1 - z**2) * np.cos(2.399963 * i), np.sqrt(1 - z**2) * np.sin(2.399963 * i), z]
    >>> surface = taut.Surface(points)
    >>> path = surface.path([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    >>> path.converged, round(path.length, 5)
    (True, 1.5708)
    >>> round(float(surface.distance(0).distance.max()), 3)
    3.132
    """

    _raw: _taut.Surface
    _recipe: tuple[str, tuple[Any, ...]]

    def __init__(self, points: npt.ArrayLike, dimension: int | None = None, *, threads: int | None = None) -> None:
        self._make("points", (points, dimension, False, None), threads)

    @classmethod
    def fit(
        cls,
        points: npt.ArrayLike,
        accuracy: float | None = None,
        dimension: int | None = None,
        *,
        threads: int | None = None,
    ) -> Surface:
        """A surface of few large charts that keep within `accuracy` of the points, in their units.

        The accuracy is a thousandth of the diagonal of the points' box unless given.
        """
        return cls._of("points", (points, dimension, True, accuracy), threads)

    @classmethod
    def _of(cls, kind: str, arguments: tuple[Any, ...], threads: int | None) -> Surface:
        surface = cls.__new__(cls)
        surface._make(kind, arguments, threads)
        return surface

    def _make(self, kind: str, arguments: tuple[Any, ...], threads: int | None) -> None:
        if kind == "points":
            points = np.ascontiguousarray(arguments[0], dtype=np.float64)
            if points.ndim != 2:
                raise BadInputError(f"found points of shape {points.shape}, expected (n, d)")
            arguments = (points, *arguments[1:])
        make = getattr(_taut.Surface, f"of_{kind}")
        self._raw = make(*arguments, threads or 0)
        self._recipe = (kind, arguments)

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return (Surface._of, (*self._recipe, None))

    @property
    def coordinates(self) -> int:
        """The number of coordinates of a point."""
        return self._raw.coordinates

    @property
    def intrinsic_dimension(self) -> int:
        """The dimension of the surface."""
        return self._raw.intrinsic_dimension

    def path(
        self,
        start: Ends,
        end: Ends,
        *,
        tol: float = 1e-6,
        max_nodes: int = 8192,
        prove_shortest: bool = False,
        threads: int | None = None,
    ) -> Path:
        """The shortest geodesic found between two points, pulled taut until its length is known to a relative `tol`.

        Parameters
        ----------
        start, end : int or (d,) array
            A row of the points, or coordinates, which are moved onto the surface.
        prove_shortest : bool
            Shoot rays to find out whether it is the shortest there is, which takes some milliseconds.

        Raises
        ------
        NoPlaceError
            For an end that has no place on the surface.
        """
        first, last = _place(start, self.coordinates, "start"), _place(end, self.coordinates, "end")
        (found,) = self._raw.paths(first, last, tol, max_nodes, prove_shortest, threads or 1)
        return Path(**found)

    def paths(
        self, pairs: npt.ArrayLike, *, tol: float = 1e-6, max_nodes: int = 8192, threads: int | None = None
    ) -> list[Path]:
        """The paths of many pairs, in their order, on all threads.

        Parameters
        ----------
        pairs : (n, 2) array of int, or (n, 2, d) array
            Rows, or coordinates.
        """
        array = np.asarray(pairs)
        if array.size == 0:
            return []
        if array.ndim not in (2, 3) or array.shape[1] != 2:
            raise BadInputError(
                f"pairs: found an array of shape {array.shape}, expected (n, 2) rows or (n, 2, d) points"
            )
        start, end = (_places(array[:, side], self.coordinates, "pairs") for side in (0, 1))
        found = self._raw.paths(start, end, tol, max_nodes, False, threads or 0)
        return [Path(**path) for path in found]

    def distance(
        self,
        sources: Ends,
        to: Ends | None = None,
        *,
        tol: float = 1e-6,
        max_distance: float = np.inf,
        threads: int | None = None,
    ) -> Distances:
        """Distances from the nearest of some sources to every row of the points, or to the points `to`.

        Parameters
        ----------
        sources : int, (s,) array of int, (d,) or (s, d) array
            Rows or points.
        to : rows or points, optional
            Where to find distances; needed on surfaces that were not put through points.
        tol : float
            Relative error of the rays that carry the distances.
        max_distance : float
            Distances beyond this are not looked for.

        Raises
        ------
        NoPlaceError
            For a source that has no place on the surface.
        NoRowsError
            Where `to` is needed.
        """
        places = _places(sources, self.coordinates, "sources")
        targets = None if to is None else _places(to, self.coordinates, "to")
        return Distances(**self._raw.distances(places, targets, tol, max_distance, threads or 0))

    def log_map(
        self,
        sources: Ends,
        to: Ends | None = None,
        *,
        tol: float = 1e-6,
        max_distance: float = np.inf,
        threads: int | None = None,
    ) -> Logarithms:
        """The vectors at the nearest source whose geodesics lead to every row of the points, or to the points `to`.

        Only smooth surfaces of dimension 2 have them. See `distance` for the parameters.
        """
        places = _places(sources, self.coordinates, "sources")
        targets = None if to is None else _places(to, self.coordinates, "to")
        return Logarithms(**self._raw.logarithms(places, targets, tol, max_distance, threads or 0))

    def tangents(self, at: Ends | None = None, *, threads: int | None = None) -> npt.NDArray[np.float64]:
        """Orthonormal tangents at every row of the points, or at the points `at`: an (n, k, d) array.

        Not numbers where there is no place on the surface.

        Raises
        ------
        NoRowsError
            Where `at` is needed.
        """
        if at is None:
            if self._recipe[0] != "points":
                raise NoRowsError("the surface was not put through points: say where tangents are wanted, with at=")
            at = np.arange(len(self._recipe[1][0]))
        return self._raw.tangents(_places(at, self.coordinates, "at"), threads or 0)

    def exp_map(self, start: Ends, vector: npt.ArrayLike, *, tol: float = 1e-6) -> Shot:
        """The geodesic that leaves a point along a vector of space, as long as the vector's tangential part."""
        values = np.asarray(vector, dtype=np.float64).reshape(-1)
        return Shot(**self._raw.shoot(_place(start, self.coordinates, "start"), values.tolist(), tol, 1))

    def distance_matrix(
        self,
        sources: Ends,
        targets: Ends | None = None,
        *,
        tol: float = 1e-6,
        max_nodes: int = 8192,
        threads: int | None = None,
    ) -> DistanceMatrix:
        """Lengths of the paths from each source to each target; between all sources where no targets are given."""
        rows = _places(sources, self.coordinates, "sources")
        columns = rows if targets is None else _places(targets, self.coordinates, "targets")
        found = self._raw.matrix(rows, columns, tol, max_nodes, threads or 0)
        status = np.array(found["status"], dtype=np.str_).reshape(found["length"].shape)
        return DistanceMatrix(found["length"], found["error"], status)

    def check(self) -> Check:
        """What is known of the surface, and what speaks against answers on it."""
        return Check(**self._raw.check())

    def __repr__(self) -> str:
        return f"Surface(dimension {self.intrinsic_dimension} in R^{self.coordinates}, from {self._recipe[0]})"


def Equation(
    texts: str | Sequence[str],
    coordinates: int = 3,
    bounds: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    *,
    threads: int | None = None,
) -> Surface:
    """The surface on which an equation holds, or all of several.

    Parameters
    ----------
    texts : str or list of str
        In x, y, z or x1 to x16, such as ``"x^2 + y^2 + z^2 = 1"``.
    coordinates : int
        The number of variables.
    bounds : pair of (d,) arrays, optional
        The lowest and the highest coordinates of the box that is meant. Without it the surface is looked for about the
        origin, and sampled as far as it goes.

    Raises
    ------
    FormulaError
        Where a text cannot be read.
    BadInputError
        Where no point of the surface is found.

    Examples
    --------
    >>> import taut
    >>> torus = taut.Equation("(sqrt(x^2 + y^2) - 1)^2 + z^2 = 0.16")
    >>> round(torus.path([1.4, 0.0, 0.0], [0.6, 0.0, 0.0], tol=1e-12).length, 10)
    1.2566370614
    """
    listed = [texts] if isinstance(texts, str) else list(texts)
    box = None
    if bounds is not None:
        low, high = (np.asarray(corner, dtype=np.float64).reshape(-1).tolist() for corner in bounds)
        if len(low) != coordinates or len(high) != coordinates:
            raise BadInputError(f"bounds: found {len(low)} and {len(high)} coordinates, expected {coordinates}")
        box = (low, high)
    return Surface._of("equations", (listed, coordinates, box), threads)


def Shape(text: str, *, threads: int | None = None) -> Surface:
    """A shape that taut knows by name, such as ``"sphere:1"`` or ``"torus:2,0.7"``.

    Raises
    ------
    FormulaError
        Where the name or its numbers cannot be read.

    Examples
    --------
    >>> import taut
    >>> sphere = taut.Shape("sphere:1")
    >>> sphere.distance([0.0, 0.0, 1.0], to=[1.0, 0.0, 0.0]).distance.round(5).tolist()
    [1.5708]
    """
    return Surface._of("shape", (text,), threads)
