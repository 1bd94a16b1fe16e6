"""What is answered: small records of arrays, in the coordinates and units of the input."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import NoPathError, NotConvergedError

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        a, b = np.asarray(a), np.asarray(b)
        return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f" == b.dtype.kind))
    return bool(a == b or (a != a and b != b))


class _Record:
    """Equality of records of arrays; a value that is not a number equals itself."""

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return all(_same(value, vars(other)[name]) for name, value in vars(self).items())

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True, eq=False, repr=False)
class Path(_Record):
    """A geodesic between two points.

    Attributes
    ----------
    status : str
        "converged", "not-taut", "not-resolved", "off-surface", "no-path" or "unknown".
    length : float
        Length of the path; infinite where there is none, not a number where it is unknown.
    length_error : float
        Estimated absolute error of the length against the geodesic of the same surface.
    surface_error : float
        Estimated absolute error that the surface adds, which was reconstructed from points; 0 for equations.
    shortest : bool
        Known to be the shortest path; false where that is not known.
    stable : bool
        The path is a strict local minimum of length.
    points : (m, d) array
        Points from start to end; empty where there is no path.
    arc_length : (m,) array
        Length from the start to each point.
    moved : tuple of two floats
        How far the two ends were moved onto the surface.
    doubts : list of str
        What speaks against all answers on this surface.
    """

    status: str
    length: float
    length_error: float
    surface_error: float
    shortest: bool
    stable: bool
    points: Floats
    arc_length: Floats
    moved: tuple[float, float]
    doubts: list[str]

    @property
    def converged(self) -> bool:
        """Whether the estimated relative error of the length is within the tolerance."""
        return self.status == "converged"

    @property
    def error(self) -> float:
        """Both estimated errors together."""
        return self.length_error + self.surface_error

    def checked(self) -> Path:
        """The path itself if it converged.

        Raises
        ------
        NoPathError
            Where there is no path, or that is unknown.
        NotConvergedError
            Where the path did not reach the tolerance.
        """
        if self.status in ("no-path", "unknown"):
            raise NoPathError(f"{self.status}: no path was found between the two points")
        if not self.converged:
            raise NotConvergedError(f"{self.status}: the length is {self.length} as far as the path got")
        return self

    def __repr__(self) -> str:
        return f"Path({self.status}, length {self.length:.10g} ± {self.error:.1e}, {len(self.points)} points)"


@dataclass(frozen=True, eq=False, repr=False)
class Distances(_Record):
    """Distances at some points, one value each in their order. It can be used as the array of distances.

    Attributes
    ----------
    distance : (n,) array
        From the nearest source: infinite where none leads to the point, not a number where the point has no place on
        the surface or where that is unknown.
    error : (n,) array
        Estimated absolute errors; not a number where there is no distance.
    source : (n,) array of int
        The nearest source, counted from 0 in the order given; -1 where there is none.
    """

    distance: Floats
    error: Floats
    source: Indices

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Floats:
        array = np.asarray(self.distance, dtype=dtype)
        return array.copy() if copy else array

    def __len__(self) -> int:
        return len(self.distance)

    def __repr__(self) -> str:
        known = self.distance[np.isfinite(self.distance)]
        farthest = f"up to {known.max():.6g}" if len(known) else "none reached"
        return f"Distances({len(self)} points, {farthest}, {len(self) - len(known)} without)"


@dataclass(frozen=True, eq=False, repr=False)
class Logarithms(_Record):
    """Logarithms of some points: the vectors at the sources whose geodesics lead there.

    Attributes
    ----------
    vectors : (n, 2) array
        Coordinates along the tangents of the nearest source; a vector is as long as its geodesic.
    error : (n,) array
        Estimated absolute errors of the ends of the vectors.
    source : (n,) array of int
        The nearest source; -1 where no geodesic leads to the point.
    tangents : (s, 2, d) array
        The two orthonormal tangents of each source.
    transported : (n, 2, d) array
        The tangents of the nearest source, carried in parallel along the geodesic to each point; not numbers where none
        leads there.
    """

    vectors: Floats
    error: Floats
    source: Indices
    tangents: Floats
    transported: Floats

    def __repr__(self) -> str:
        return f"Logarithms({len(self.vectors)} points, {len(self.tangents)} sources)"


@dataclass(frozen=True, eq=False, repr=False)
class Shot(_Record):
    """A geodesic shot from a point.

    Attributes
    ----------
    points : (m, d) array
        Points on it from the start on.
    arc_length : (m,) array
        Length from the start to each point.
    complete : bool
        Whether it was followed to its full length. If not, the surface ends, or is not known well enough to go on.
    error : float
        Estimated absolute error of the end.
    """

    points: Floats
    arc_length: Floats
    complete: bool
    error: float

    @property
    def end(self) -> Floats:
        """The last point."""
        return np.asarray(self.points[-1])

    def __repr__(self) -> str:
        whole = "" if self.complete else ", not complete"
        return f"Shot(length {self.arc_length[-1]:.10g} ± {self.error:.1e}{whole})"


@dataclass(frozen=True, eq=False, repr=False)
class DistanceMatrix(_Record):
    """Lengths of the paths between sources and targets. It can be used as the array of lengths.

    Attributes
    ----------
    length : (s, t) array
        Infinite where no path exists, not a number where that is unknown.
    error : (s, t) array
        Estimated absolute errors, those of the surface included.
    status : (s, t) array of str
        How each query ended.
    """

    length: Floats
    error: Floats
    status: npt.NDArray[np.str_]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Floats:
        array = np.asarray(self.length, dtype=dtype)
        return array.copy() if copy else array

    def __repr__(self) -> str:
        rows, columns = self.length.shape
        return f"DistanceMatrix({rows} x {columns}, {int((self.status == 'converged').sum())} converged)"


@dataclass(frozen=True, eq=False, repr=False)
class Check(_Record):
    """What is known of a surface before anything is asked of it.

    Attributes
    ----------
    coordinates, intrinsic_dimension : int
        The number of coordinates of a point, and the dimension of the surface.
    parts : list of int
        The number of nodes of the graph on each connected part, largest first.
    spacing, noise : float or None
        Median distance between neighbouring points, and of points from the surface fitted without them. None for
        surfaces that were not put through points.
    doubts : list of str
        What speaks against all answers.
    """

    coordinates: int
    intrinsic_dimension: int
    parts: list[int]
    spacing: float | None
    noise: float | None
    doubts: list[str]

    def __repr__(self) -> str:
        facts = [f"dimension {self.intrinsic_dimension} in R^{self.coordinates}", f"{len(self.parts)} part(s)"]
        if self.spacing is not None:
            facts.append(f"spacing {self.spacing:.3g}")
        if self.noise is not None:
            facts.append(f"noise {self.noise:.1e}")
        return f"Check({', '.join(facts + self.doubts)})"
