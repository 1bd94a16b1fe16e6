"""Geodesics on point clouds and implicit surfaces, pulled taut to a tolerance.

Make a `Surface` of points, or one by an `Equation` or a `Shape`, and ask it for a `path`, for `distance`,
`distance_matrix`, `log_map` and `exp_map`. Ends are rows of the points or coordinates. Answers are in the coordinates and
units of the input, with their estimated errors and a status.
"""

from ._answers import Check, DistanceMatrix, Distances, Logarithms, Path, Shot
from ._errors import (
    BadInputError,
    FormulaError,
    NoPathError,
    NoPlaceError,
    NoRowsError,
    NotConvergedError,
    TautError,
)
from ._surface import Equation, Shape, Surface
from ._taut import __version__

__all__ = [
    "BadInputError",
    "Check",
    "DistanceMatrix",
    "Distances",
    "Equation",
    "FormulaError",
    "Logarithms",
    "NoPathError",
    "NoPlaceError",
    "NoRowsError",
    "NotConvergedError",
    "Path",
    "Shape",
    "Shot",
    "Surface",
    "TautError",
    "__version__",
]
