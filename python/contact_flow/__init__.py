# SPDX-License-Identifier: BSD-3-Clause
"""contact_flow: what happens, to first order, to a robot that makes and breaks contact.

>>> import contact_flow as cf
>>> biped = cf.Model("soft_biped")
>>> run = biped.simulate()
>>> run.modes
[(), ('left_foot', 'right_foot')]
>>> B = run.derivative()
>>> [round(float(slope), 4) for slope in (B("+body_pitch")[6], -B("-body_pitch")[6])]   # to each side
[0.9434, 0.8055]
>>> len(B.pieces()), B.is_differentiable
(2, False)

Names are those of C++ in snake_case. Vectors and matrices are numpy arrays: states x = (q, v) [nq+d],
tangents (δq, δv, δu, δp) [2d+k], SI units, angles in radians. How things came out is a value, `status`,
that is true where all is well; exceptions are for misuse and say field and value. Where ROS is
installed `contact_flow.msg` and `contact_flow.srv` are the node's messages.
"""
from pkgutil import extend_path as _extend_path
from typing import Any as _Any

# Messages that ROS generates may lie in a folder of this name elsewhere on the path.
__path__ = _extend_path(__path__, __name__)

try:
    from ._core import (
        Arc, Assumptions, BudgetExceeded, Controllability, CostGradient, Covariance, Derivative, Event,
        Feedback, FollowedOrbit, HorizonSolution, Interval, LinearInputs, LinearPiece, MapConsistency, Margins, Model,
        NoDerivative, NominalRun, NotPiecewiseLinear, OnlineFlow, Optimum, Orbit, Parameter, PiecewiseLinearMap, PoincareMap, PoincareReturn,
        Policy, PolicyTracker, PythonModel, QuotientReport, QuotientSample, RecedingLoop, Robot, RollingTangents, Run, RunStatistics, Stability,
        StabilityCertificate, Status, Summary, System, Tally, Trust, ValidityRadius, Warning, __version__,
        have_ipopt, have_linear_programs, load_configuration, models)
    from .batch import Batch, BatchEvent, simulate_batch
    from .draws import JointNormal, Normal, Table, Uniform
    from .ensemble import Ensemble, sweep
    from .ensemble_store import open_sweep
    from .python_model import Formulas
    from .report import write_report
    from .sections import After, Apex, Crossing, Grid, Section, Touchdown
    from .trajectories import OptimalTrajectory, optimize_trajectory, read_policy, write_policy
except ImportError as error:  # messages stay importable where the extension is not
    _reason = str(error)

    def __getattr__(name: str) -> _Any:
        if name.startswith("__"):
            raise AttributeError(name)
        raise ImportError("contact_flow.%s: the extension module cannot be loaded: %s" % (name, _reason))

__all__ = [
    "After", "Apex", "Arc", "Assumptions", "Batch", "BatchEvent", "BudgetExceeded", "Controllability", "CostGradient", "Covariance",
    "Crossing", "Derivative", "Ensemble", "Event", "Feedback", "FollowedOrbit", "Formulas", "Grid", "HorizonSolution",
    "Interval", "JointNormal", "LinearInputs", "LinearPiece",
    "MapConsistency", "Margins", "Model", "NoDerivative", "NominalRun", "Normal", "NotPiecewiseLinear",
    "OnlineFlow", "OptimalTrajectory", "Optimum", "Orbit", "Parameter", "PiecewiseLinearMap", "PoincareMap",
    "PoincareReturn", "Policy", "PolicyTracker",
    "PythonModel", "QuotientReport", "QuotientSample", "RecedingLoop", "Robot", "RollingTangents", "Run", "RunStatistics",
    "Section",
    "Stability", "StabilityCertificate", "Status", "Summary", "System", "Table", "Tally", "Touchdown",
    "Trust", "Uniform", "ValidityRadius", "Warning", "have_ipopt", "have_linear_programs", "load_configuration",
    "models", "open_sweep", "optimize_trajectory", "read_policy", "simulate_batch", "sweep", "write_policy", "write_report"]
