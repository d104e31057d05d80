# SPDX-License-Identifier: BSD-3-Clause
"""What is asked of models in Python before they are used: names, parameters, sizes."""
from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterable, List, Mapping, Tuple, Type

import numpy as np

if TYPE_CHECKING:
    from .python_model import Formulas, Terms

RANGES: Dict[str, Callable[[float], bool]] = {
    "any": lambda value: True,
    "positive": lambda value: value > 0,
    "non_negative": lambda value: value >= 0,
    "unit_interval": lambda value: 0 <= value <= 1,
}

MAX_CONSTRAINTS = 64  #: the bits of a mode in which formulas are told who holds
WAYS = ("duals", "differences")  #: to differentiate


class WrongForm(ValueError):
    """A formula has too few numbers, too many, or a matrix that is not symmetric."""


def check_names(terms: Terms) -> None:
    """ValueError for names that are too few, too many or not distinct, and for no way to differentiate."""
    model = terms.model
    if model.differentiation not in WAYS:
        raise ValueError("%s.differentiation is %r, expected %s" % (terms.name, model.differentiation,
                                                                    " or ".join(map(repr, WAYS))))
    if not (math.isfinite(model.difference_step) and model.difference_step > 0):
        raise ValueError("%s.difference_step is %r, expected a number > 0" % (terms.name, model.difference_step))
    if not terms.coordinates:
        raise ValueError("%s.coordinates is empty" % terms.name)
    if len(terms.units) != terms.d:
        raise ValueError("%s.units has %d names, expected %d" % (terms.name, len(terms.units), terms.d))
    if terms.rows > MAX_CONSTRAINTS:
        raise ValueError("%s has %d constraints, at most %d" % (terms.name, terms.rows, MAX_CONSTRAINTS))
    for name in terms.model.circles:
        if name not in terms.coordinates:
            raise ValueError("%s.circles: unknown coordinate '%s'" % (terms.name, name))
    for field in ("coordinates", "constraints", "bilateral", "inputs"):
        names = list(getattr(terms, field))
        for name in names:
            if names.count(name) > 1:
                raise ValueError("%s.%s has '%s' twice" % (terms.name, field, name))
    # A direction by name would be one of two.
    tangents = [("coordinates", name) for name in terms.coordinates]
    tangents += [("inputs", name) for name in terms.inputs]
    tangents += [("parameters", p[0]) for p in terms.parameter_list]
    seen: Dict[str, str] = {}
    for field, name in tangents:
        if name in seen:
            raise ValueError("%s: '%s' is in %s and in %s" % (terms.name, name, seen[name], field))
        seen[name] = field


def numbers(values: Any, shape: Tuple[int, ...], what: str) -> Any:
    if isinstance(values, np.ma.MaskedArray) and np.any(values.mask):
        raise TypeError("%s has masked numbers" % what)
    array = np.asarray(values, dtype=object)
    if array.shape != shape and array.size + sum(shape) > 0:
        raise WrongForm("%s has shape %s, expected %s" % (what, array.shape, shape))
    return array


def floats(values: Any, what: str) -> Any:
    try:
        array = np.asarray(values.tolist() if isinstance(values, np.ndarray) else values)
        if array.dtype.kind == "c":   # numpy would only warn
            raise TypeError("%s has complex numbers" % what)
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError) as error:
        if str(error).startswith(what):
            raise
        raise TypeError("%s has something else than numbers" % what) from None


def symmetric(M: Any, name: str) -> Any:
    """M, where it is to rounding; relative to √(M_ii M_kk)."""
    if np.array_equal(M, M.T):
        return M
    root = np.sqrt(np.abs(np.diagonal(M)))
    if np.any(np.abs(M - M.T) > 1e-9 * np.outer(root, root)):
        raise WrongForm("%s.mass_matrix(q) is not symmetric" % name)
    return M


def check_repeats(terms: Terms, *places: Any) -> None:
    """ValueError for formulas that depend on more than their arguments: on what was asked before, or on chance."""
    v, u, one_of_them = terms.nominal_x[terms.d:], terms.nominal_u, [p[3] for p in terms.parameter_list]
    for q in places:
        formulas: Dict[str, Callable[[Formulas], Any]] = {
            "mass_matrix(q)": lambda model: terms._mass_matrix(model, q),
            "force(q, v, u)": lambda model: terms._force(model, q, v, u, 0),
            "gaps(q)": lambda model: terms._all_gaps(model, q)}
        for what, formula in formulas.items():
            try:
                used, new = (floats(formula(model), "%s.%s" % (terms.name, what))
                             for model in (terms.model, terms._with(one_of_them)))
            except (ArithmeticError, ValueError):   # outside its domain
                continue
            if not np.array_equal(used, new, equal_nan=True):
                raise ValueError("%s.%s gives another result when it is asked again: formulas must depend on their "
                                 "arguments and parameters alone" % (terms.name, what))


def with_values(model: Formulas, values: Iterable[Tuple[str, Any]]) -> Formulas:
    """The model, with these as its attributes."""
    for name, value in values:
        setattr(model, name, value)
    return model


def read_parameters(formulas: Type[Formulas], values: Mapping[str, float]) -> List[Tuple[str, str, str, float]]:
    """(name, unit, meaning, value) of each parameter. ValueError for unknown names and values out of
    range."""
    label = formulas.name or formulas.__name__
    for name in values:
        if name not in formulas.parameters:
            raise ValueError("%s: unknown parameter '%s'; it has %s"
                             % (label, name, ", ".join(formulas.parameters) or "none"))
    listed: List[Tuple[str, str, str, float]] = []
    for name, given in formulas.parameters.items():
        if hasattr(formulas, name):
            raise ValueError("%s: a parameter cannot be called '%s'" % (label, name))
        fields: Tuple[Any, ...] = given if isinstance(given, tuple) else (given,)
        default, unit, meaning, allowed = fields + ("", "", "any")[len(fields) - 1:]
        value = float(values.get(name, default))
        if allowed not in RANGES:
            raise ValueError("%s: the range of '%s' is '%s', expected one of %s"
                             % (label, name, allowed, ", ".join(RANGES)))
        if not np.isfinite(value) or not RANGES[allowed](value):
            raise ValueError("%s: parameter '%s' is %r, expected %s" % (label, name, value, allowed))
        listed.append((name, str(unit), str(meaning), value))
    return listed
