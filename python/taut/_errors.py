"""What can go wrong, by name. All errors pickle."""

from __future__ import annotations


class TautError(Exception):
    """The base of all errors of taut's."""


class BadInputError(TautError, ValueError):
    """Points, options or a surface that cannot be used; the message says what was found and what was expected."""


class FormulaError(BadInputError):
    """The text of an equation, or the name of a shape, that cannot be read."""


class NoPlaceError(BadInputError):
    """An end or a source that has no place on the surface."""


class NoRowsError(BadInputError):
    """Rows were asked for on a surface that was not put through points."""


class NoPathError(TautError):
    """No path exists, or it is unknown whether one does."""


class NotConvergedError(TautError):
    """A path did not reach the tolerance."""
