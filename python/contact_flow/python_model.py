# SPDX-License-Identifier: BSD-3-Clause
"""Models of one's own in Python, and their derivatives by forward jets (contact_flow.jet) or by differences."""
from __future__ import annotations

import copy
import re
from typing import Any, Callable, Dict, List, Mapping, Sequence, Tuple, Type

import numpy as np

from . import differences, jet, ties
from .model_checks import (WrongForm, check_names, check_repeats, floats, numbers, read_parameters, symmetric,
                           with_values)

CLOSED = 1e-6   #: gaps may have a kink where they are larger than this
LACKS = re.compile(r"'(Jet|int|float)' object has no attribute")   #: what numpy asks of elements of an array
OF_A_NUMBER = re.compile(r"'(int|float)' object has no attribute|of type (int|float) which has no callable")


class Formulas:
    """A mechanical system as formulas; make a system of it by PythonModel(TheClass, name=value, …).

    The equations are M(q) v̇ = f(q, v, u) + c(q, v) v + Da(q)ᵀ λ with a(q) ≥ 0 (and b(q) = 0); the
    Coriolis terms c, Da and all derivatives follow from the formulas by forward differentiation. Each
    formula gets numpy arrays, of floats or of jets, and may use +, −, *, /, **, @, np.sin and the like;
    `self.NAME` is the value of a parameter. Formulas must depend on their arguments alone. What jets do not
    pass through, as np.interp or a compiled function, is an error, but for `differentiation = "differences"`:
    then formulas see floats alone, and derivatives have nine digits or so (contact_flow.differences).

    Coordinates are numbers on lines, those named in `circles` angles; rotations in space by
    quaternions, and friction, are left to models in C++.
    """

    name: str = ""  #: of the model; the class's where it is empty
    summary: str = ""  #: one sentence
    coordinates: Sequence[str] = ()  #: names [d]
    units: Sequence[str] = ()  #: theirs, "m" or "rad"; "m" where it is empty
    constraints: Sequence[str] = ()  #: names of the contacts [n]
    bilateral: Sequence[str] = ()  #: names of the closures [l]
    inputs: Sequence[str] = ()  #: names [m]
    circles: Sequence[str] = ()  #: coordinates whose difference wraps at 2π
    compliant: Sequence[str] = ()  #: contacts that only switch the effort
    #: name: value, or (value, unit, meaning[, "positive", "non_negative" or "unit_interval"])
    parameters: Mapping[str, Any] = {}
    constant_mass: bool = False  #: M does not depend on q: a promise that saves work
    affine_constraints: bool = False  #: Da does not depend on q: the same
    contact_effort: bool = False  #: force() takes a fifth argument, the names of the contacts that hold
    differentiation: str = "duals"  #: or "differences"
    difference_step: float = 6e-3  #: of differences, in m, rad, …, and as a part of each parameter

    def mass_matrix(self, q: Any) -> Any:
        """M(q) [d×d], symmetric."""
        raise NotImplementedError("%s lacks mass_matrix(self, q)" % type(self).__name__)

    def force(self, q: Any, v: Any, u: Any) -> Any:
        """f(q, v, u) [d], without Coriolis terms."""
        raise NotImplementedError("%s lacks force(self, q, v, u)" % type(self).__name__)

    def gaps(self, q: Any) -> Any:
        """a(q) [n]."""
        return []

    def closures(self, q: Any) -> Any:
        """b(q) [l]."""
        return []

    def restitutions(self) -> Any:
        """γ of each contact [n]; where this is left out the parameter `restitution`, or plastic."""
        return [getattr(self, "restitution", 0.0)] * len(self.constraints)

    def nominal(self) -> Tuple[Any, Any, float]:
        """(x, u, duration) of the run of who asks for nothing in particular."""
        return np.zeros(2 * len(self.coordinates)), np.zeros(len(self.inputs)), 1.0


class Terms:
    """What C++ asks of the formulas: values and derivatives of the residuals
    r₁ = M v̇ − f − c v − Daᵀ λ and r₂ = Da v̇ + (d/dt Da) v."""

    def __init__(self, formulas: Type[Formulas], values: Mapping[str, float]) -> None:
        self.parameter_list = read_parameters(formulas, values)
        self._unused = formulas()   # it has computed nothing of parameters yet, as a cached_property may
        self.model = self._with([p[3] for p in self.parameter_list])
        model = self.model
        self.name = model.name or formulas.__name__
        self.summary = model.summary
        self.coordinates = list(model.coordinates)
        self.units = list(model.units) or ["m"] * len(self.coordinates)
        self.constraints, self.bilateral = list(model.constraints), list(model.bilateral)
        self.inputs, self.compliant = list(model.inputs), list(model.compliant)
        self.circles = [name in model.circles for name in self.coordinates]
        self.contact_effort = model.contact_effort
        self.constant_mass, self.affine_constraints = model.constant_mass, model.affine_constraints
        self.d = len(self.coordinates)
        self.rows = len(self.constraints) + len(self.bilateral)
        check_names(self)
        self.restitution = floats(model.restitutions(), self.name + ".restitutions()")
        if not np.all((self.restitution >= 0) & (self.restitution <= 1)):
            raise ValueError("%s.restitutions() is %s, expected numbers in [0, 1]"
                             % (self.name, self.restitution.tolist()))
        x, u, self.nominal_duration = model.nominal()
        self.nominal_x, self.nominal_u = np.array(x, dtype=float), np.array(u, dtype=float)
        self.nominal_x.flags.writeable = self.nominal_u.flags.writeable = False
        if self.nominal_x.shape != (2 * self.d,):
            raise ValueError("%s.nominal(): x has shape %s, expected %d numbers (q, v)"
                             % (self.name, self.nominal_x.shape, 2 * self.d))
        self._values = np.array([p[3] for p in self.parameter_list])
        origin = self.nominal_x[:self.d]
        self._mass = self._float_mass(origin) if self.constant_mass else None
        self._jacobian = self._gap_jacobian(origin)[1] if self.affine_constraints else None
        self._check_promises(origin)

    def _check_promises(self, origin: Any) -> None:
        """What is said to be constant is the same at another place; nothing depends on what was asked before."""
        self._float_mass(origin)
        try:
            self._gap_jacobian(origin)
            self._force(self.model, origin, self.nominal_x[self.d:], self.nominal_u, 0)
        except WrongForm:
            raise
        except (ArithmeticError, ValueError):   # outside the domain of the formulas: runs will say so
            pass
        elsewhere = origin + 0.01 * np.cos(np.arange(1, self.d + 1))
        elsewhere.flags.writeable = False
        try:
            mass, jacobian = self._float_mass(elsewhere), self._gap_jacobian(elsewhere)[1]
        except WrongForm:
            raise
        except (ArithmeticError, ValueError):
            return
        check_repeats(self, origin, elsewhere)
        if self._mass is not None and not np.allclose(mass, self._mass, rtol=1e-9, atol=0):
            raise ValueError("%s.constant_mass is True, but mass_matrix(q) depends on q" % self.name)
        if self._jacobian is not None and not np.allclose(jacobian, self._jacobian, rtol=1e-9, atol=1e-12):
            raise ValueError("%s.affine_constraints is True, but the gradient of gaps(q) depends on q"
                             % self.name)

    # The formulas, with their sizes checked

    def _all_gaps(self, model: Formulas, q: Any) -> Any:
        gaps = list(numbers(model.gaps(q), (len(self.constraints),), self.name + ".gaps(q)"))
        return gaps + list(numbers(model.closures(q), (len(self.bilateral),), self.name + ".closures(q)"))

    def _mass_matrix(self, model: Formulas, q: Any) -> Any:
        return numbers(model.mass_matrix(q), (self.d, self.d), self.name + ".mass_matrix(q)")

    def _force(self, model: Formulas, q: Any, v: Any, u: Any, mode: int) -> Any:
        arguments: List[Any] = [q, v, u]
        if self.contact_effort:
            arguments.append(frozenset(n for k, n in enumerate(self.constraints) if mode >> k & 1))
        return numbers(model.force(*arguments), (self.d,), self.name + ".force(q, v, u)")

    def _float_mass(self, q: Any) -> Any:
        return symmetric(floats(self._mass_matrix(self.model, q), self.name + ".mass_matrix(q)"), self.name)

    # Their derivatives: coefficients along directions of q, v, u and of the parameters p, where these vary

    def _coefficients(self, what: str, formula: Callable[..., Any], p: Any, arguments: Sequence[Any],
                      shape: Tuple[int, int], series: bool = False, away: float = np.inf) -> Any:
        """Of formula(model, *arguments) [… × shape]; p: None, or all parameters, numbers and jets."""
        if self.model.differentiation == "differences":
            return self._by_differences(what, formula, p, arguments, shape, series)
        try:
            return ties.settled(lambda: jet.coefficients(formula(self._with(p), *arguments), shape),
                                "%s.%s" % (self.name, what), away)
        except (TypeError, AttributeError) as error:
            if isinstance(error, AttributeError) and not LACKS.search(str(error)):
                raise
            hint = "; its array has numbers beside duals: add 0 * q[0] to them" if OF_A_NUMBER.search(str(error)) else ""
            raise TypeError("%s.%s: %s; forward duals do not pass through it%s, differentiation = 'differences' does"
                            % (self.name, what, error, hint)) from error

    def _with(self, p: Any) -> Formulas:
        if p is None:
            return self.model
        try:
            model = copy.deepcopy(self._unused)
        except TypeError:   # as of a handle of a library
            model = copy.copy(self._unused)
        return with_values(model, zip([entry[0] for entry in self.parameter_list], p))

    def _by_differences(self, what: str, formula: Callable[..., Any], p: Any, arguments: Sequence[Any],
                        shape: Tuple[int, int], series: bool) -> Any:
        scales = [np.maximum(1.0, np.abs(jet.values(a))) for a in arguments]
        name = "%s.%s" % (self.name, what)
        if p is None:
            return differences.coefficients(lambda *a: formula(self.model, *a), arguments, scales, shape, series,
                                            self.model.difference_step, name)
        scale = np.where(self._values == 0, 1.0, np.abs(self._values))
        return differences.coefficients(lambda p, *a: formula(self._with(p.tolist()), *a), [p, *arguments],
                                        [scale, *scales], shape, series, self.model.difference_step, name)

    def _gap_jacobian(self, q: Any) -> Tuple[Any, Any]:
        c = self._gaps(None, jet.variables(q, 0, self.d), (1, 1 + self.d))
        return c[:, 0, 0], c[:, 0, 1:]

    def _gaps(self, p: Any, q: Any, shape: Tuple[int, int], series: bool = False) -> Any:
        c = self._coefficients("gaps(q)", self._all_gaps, p, [q], shape, series, CLOSED)
        return c.reshape((self.rows,) + shape)

    def _masses(self, p: Any, q: Any, shape: Tuple[int, int]) -> Any:
        return self._coefficients("mass_matrix(q)", self._mass_matrix, p, [q], shape)

    def _forces(self, p: Any, arguments: Sequence[Any], mode: int, directions: int) -> Any:
        """Derivatives of f along directions [d × directions]."""
        return self._coefficients("force(q, v, u)", lambda model, q, v, u: self._force(model, q, v, u, mode), p,
                                  arguments, (1, 1 + directions))[:, 0, 1:]

    # Values

    def dynamics(self, q: Any, v: Any, u: Any, mode: int) -> Tuple[Any, Any]:
        """M and f + c v."""
        force = floats(self._force(self.model, q, v, u, mode), self.name + ".force(q, v, u)")
        if self._mass is not None:
            return self._mass, force
        c = self._masses(None, jet.variables(q, 0, self.d), (1, 1 + self.d))
        slope = c[:, :, 0, 1:]  # ∂M_ij/∂q_k
        coriolis = 0.5 * np.einsum("ijk,i,j->k", slope, v, v) - np.einsum("kjl,l,j->k", slope, v, v)
        return symmetric(c[:, :, 0, 0], self.name), force + coriolis

    def constraint_terms(self, q: Any, v: Any) -> Tuple[Any, Any, Any]:
        """a, Da and (d/dt Da) v, of closures behind."""
        if self._jacobian is not None:
            gaps = floats(self._all_gaps(self.model, q), self.name + ".gaps(q)")
            return gaps, self._jacobian, np.zeros(self.rows)
        gap, jacobian = self._gap_jacobian(q)
        return gap, jacobian, self._gap_acceleration(None, q, v, np.zeros(self.d), 0, False)[:, 0]

    def _gap_acceleration(self, p: Any, q: Any, v: Any, acceleration: Any, directions: int,
                          by_state: bool) -> Any:
        """r₂ and its derivatives [rows × 1+directions]."""
        along = jet.motion(q, v, acceleration, directions, by_state)
        return 2.0 * self._gaps(p, along, (3, 1 + directions), True)[:, 2, :]

    # Derivatives by (q, v, u)

    def differentiate_dynamics(self, q: Any, v: Any, u: Any, mode: int, acceleration: Any,
                               force: Any) -> Tuple[Any, ...]:
        d, n = self.d, 2 * self.d + len(self.inputs)
        f = self._forces(None, [jet.variables(q, 0, n), jet.variables(v, d, n), jet.variables(u, 2 * d, n)], mode, n)
        by_q, by_v = -f[:, :d], -f[:, d:2 * d]
        if not self.constant_mass:
            slope, bend = self._mass_slopes(q)
            by_q = by_q + slope.transpose(0, 2, 1) @ acceleration - (
                0.5 * np.einsum("abik,a,b->ik", bend, v, v) - np.einsum("ijlk,l,j->ik", bend, v, v))
            by_v = by_v - (np.einsum("kbi,b->ik", slope, v) - np.einsum("ijk,j->ik", slope, v)
                           - np.einsum("ikl,l->ik", slope, v))
        if self.affine_constraints:
            return by_q, by_v, -f[:, 2 * d:], np.zeros((self.rows, d)), np.zeros((self.rows, d))
        by_q = by_q - np.einsum("r,rik->ik", force, self._gap_bend(q))
        r2 = self._gap_acceleration(None, q, v, acceleration, 2 * d, True)[:, 1:]
        return by_q, by_v, -f[:, 2 * d:], r2[:, :d], r2[:, d:]

    def _mass_slopes(self, q: Any) -> Tuple[Any, Any]:
        """∂M_ij/∂q_k and ∂²M_ij/∂q_k∂q_l."""
        d = self.d
        c = self._masses(None, jet.variables(q, 0, d, d, True), (1 + d, 1 + d))
        return c[:, :, 0, 1:], c[:, :, 1:, 1:]

    def _gap_bend(self, q: Any) -> Any:
        """∂²a_r/∂q_i∂q_k."""
        d = self.d
        return self._gaps(None, jet.variables(q, 0, d, d, True), (1 + d, 1 + d))[:, 1:, 1:]

    def differentiate_impact(self, q: Any, jump: Any, impulse: Any, s: Any) -> Tuple[Any, Any]:
        momentum = np.zeros((self.d, self.d))
        constraint = np.zeros((self.rows, self.d))
        if not self.constant_mass:
            slope = self._masses(None, jet.variables(q, 0, self.d), (1, 1 + self.d))[:, :, 0, 1:]
            momentum = np.einsum("ijk,j->ik", slope, jump)
        if not self.affine_constraints:
            bend = self._gap_bend(q)
            momentum = momentum - np.einsum("r,rik->ik", impulse, bend)
            constraint = np.einsum("rik,i->rk", bend, s)
        return momentum, constraint

    # Derivatives by parameters

    def _vary(self, parameters: Sequence[int], left: int, series: bool = False) -> Any:
        """All parameters: those of these indices jets of derivative 1, the others numbers."""
        jets = np.empty(len(self.parameter_list), dtype=object)
        jets[:] = self._values.tolist()
        for k in parameters:
            c = np.zeros((3 if series else 1 + left, 1 + len(parameters)))
            c[0, 0] = self._values[k]
            for column, index in enumerate(parameters):
                c[0, 1 + column] = 1.0 if index == k else 0.0
            jets[k] = jet.Jet(c, series)
        return jets

    def differentiate_dynamics_by_parameters(self, q: Any, v: Any, u: Any, mode: int, acceleration: Any,
                                             force: Any, parameters: Sequence[int]) -> Tuple[Any, Any]:
        d, k = self.d, len(parameters)
        f = self._forces(self._vary(parameters, 0), [q, v, u], mode, k)
        p, at = self._vary(parameters, d), jet.variables(q, -1, k, d, True)
        M = self._masses(p, at, (1 + d, 1 + k))
        slope, bend = M[:, :, 0, 1:], M[:, :, 1:, 1:]  # by p; by q and p
        inertial = np.einsum("ijp,j->ip", slope, acceleration) - (
            0.5 * np.einsum("abip,a,b->ip", bend, v, v) - np.einsum("ijlp,l,j->ip", bend, v, v))
        push = np.einsum("r,rip->ip", force, self._gaps(p, at, (1 + d, 1 + k))[:, 1:, 1:])
        r2 = self._gap_acceleration(self._vary(parameters, 0, True), q, v, acceleration, k, False)
        return inertial - f - push, r2[:, 1:]

    def differentiate_impact_by_parameters(self, q: Any, jump: Any, impulse: Any, s: Any,
                                           parameters: Sequence[int]) -> Tuple[Any, ...]:
        d, k = self.d, len(parameters)
        p, at = self._vary(parameters, d), jet.variables(q, -1, k, d, True)
        M = self._masses(p, at, (1 + d, 1 + k))
        gaps = self._gaps(p, at, (1 + d, 1 + k))
        momentum = np.einsum("ijp,j->ip", M[:, :, 0, 1:], jump) - np.einsum(
            "r,rip->ip", impulse, gaps[:, 1:, 1:])
        restitution = self._coefficients("restitutions()", lambda model: list(model.restitutions()),
                                         self._vary(parameters, 0), [], (1, 1 + k))
        by_restitution = restitution.reshape((len(self.constraints), 1, 1 + k))[:, 0, 1:]
        return momentum, np.einsum("rip,i->rp", gaps[:, 1:, 1:], s), gaps[:, 0, 1:], by_restitution


def make_terms(formulas: Type[Formulas], values: Dict[str, float]) -> Terms:
    """Called from C++, by PythonModel."""
    if not (isinstance(formulas, type) and issubclass(formulas, Formulas)):
        raise TypeError("PythonModel is given %r, expected a subclass of contact_flow.Formulas" % (formulas,))
    return Terms(formulas, values)
