from typing import Any

import numpy as np
import numpy.typing as npt

__version__: str

_Array = npt.NDArray[Any]
_Bounds = tuple[list[float], list[float]] | None

class Surface:
    @staticmethod
    def of_points(
        points: npt.NDArray[np.float64], dimension: int | None, fitted: bool, accuracy: float | None, threads: int
    ) -> Surface: ...
    @staticmethod
    def of_equations(texts: list[str], coordinates: int, bounds: _Bounds, threads: int) -> Surface: ...
    @staticmethod
    def of_shape(text: str, threads: int) -> Surface: ...
    @property
    def coordinates(self) -> int: ...
    @property
    def intrinsic_dimension(self) -> int: ...
    def paths(
        self, start: _Array, end: _Array, tol: float, max_nodes: int, prove_shortest: bool, threads: int
    ) -> list[dict[str, Any]]: ...
    def matrix(
        self, sources: _Array, targets: _Array, tol: float, max_nodes: int, threads: int
    ) -> dict[str, Any]: ...
    def distances(
        self, sources: _Array, to: _Array | None, tol: float, max_distance: float, threads: int
    ) -> dict[str, Any]: ...
    def logarithms(
        self, sources: _Array, to: _Array | None, tol: float, max_distance: float, threads: int
    ) -> dict[str, Any]: ...
    def shoot(self, start: _Array, vector: list[float], tol: float, threads: int) -> dict[str, Any]: ...
    def check(self) -> dict[str, Any]: ...
