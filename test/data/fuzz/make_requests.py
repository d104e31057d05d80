#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the corpus of request_fuzz_test beside itself: requests that were findings once, as they travel, one a file,
MODEL.KIND.WHAT.bin. A new finding of the driver is kept under such a name, to be put here as it is."""
import math
import os

from contact_flow.msg import (AssumptionRequest, ComparisonRequest, CovarianceRequest, DerivativeRequest,
                              GradientRequest, InitialState, LinearizationRequest, OptimizationRequest,
                              PeriodicOrbitRequest, PoincareRequest, PolicyRequest, PredictionRequest, ReturnSection, RowMajorMatrix,
                              SimulationOptions, SimulationRequest, StabilityRequest)
from contact_flow.srv import ApplyImpulseRequest, SetInputRequest, SetSimulatorParametersRequest, SetSimulatorStateRequest

STANDING = InitialState(names=["body_z", "left_foot_z", "right_foot_z"], positions=[0, 0, 0])
APEX = ReturnSection(kind="apex", name="d/dt elbow")
RUNS = {"simulate": SimulationRequest, "b_derivative": DerivativeRequest, "compare": ComparisonRequest,
        "check_assumptions": AssumptionRequest, "linearize": LinearizationRequest,
        "propagate_covariance": CovarianceRequest}

REQUESTS = {
    **{"soft_biped.%s.no_solution" % name: kind(state=STANDING) for name, kind in RUNS.items()},
    "soft_biped.set_state.no_solution": SetSimulatorStateRequest(state=STANDING),
    "rigid_biped.set_parameters.tiny_mass": SetSimulatorParametersRequest(names=["body_mass"], values=[1e-310]),
    "double_pendulum.poincare_map.tiny_horizon": PoincareRequest(section=APEX, horizon=5e-324),
    "double_pendulum.assess_stability.tiny_horizon": StabilityRequest(
        return_map=PoincareRequest(section=APEX, horizon=5e-324)),
    "double_pendulum.find_periodic_orbit.tiny_horizon": PeriodicOrbitRequest(section=APEX, horizon=5e-324),
    "falling_box.set_state.fast_turn": SetSimulatorStateRequest(state=InitialState(v=[0, 0, 1e9])),
    "falling_box.apply_impulse.hard": ApplyImpulseRequest(impulse=[1e5, 1e5, 1e5]),
    "falling_box.b_derivative.fast": DerivativeRequest(state=InitialState(v=[0, -50, 500]), all_pieces=True),
    "falling_box.check_assumptions.fast": AssumptionRequest(state=InitialState(v=[0, -50, 500]), duration=100),
    "falling_box.simulate.not_a_number": SimulationRequest(duration=math.nan),
    "falling_box.simulate.endless": SimulationRequest(duration=1e6, options=SimulationOptions(
        max_step=1e-9, max_steps=10**9, max_seconds=1)),
    "soft_biped.poincare_map.empty_matrix": PoincareRequest(
        section=ReturnSection(kind="apex", name="d/dt body_z"), neutral=RowMajorMatrix(rows=0, cols=7)),
    "soft_biped.predict.huge_direction": PredictionRequest(
        horizon=0.05, direction_matrix=RowMajorMatrix(rows=1, cols=14, data=[1e308] * 14)),
    "soft_biped.set_input.far_ahead": SetInputRequest(at=4e9, values=[0.0]),
    "block_on_incline.linearize.tiny_duration": LinearizationRequest(
        duration=1e-310, state=InitialState(names=["x"], positions=[0.5])),
    "compass_walker.optimize.huge_weight": OptimizationRequest(
        duration=0.05, unknowns=["right_leg"], outcomes=["right_leg"], targets=[0.5], weights=[1e100]),
    "driven_ball.gradient.huge_weight": GradientRequest(duration=0.5, outcomes=["z"], weights=[1e100]),
    "soft_biped.optimize.nothing": OptimizationRequest(duration=1e-300),
    "block_on_incline.make_policy.long": PolicyRequest(duration=1e6),
}

for name, request in REQUESTS.items():
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), name + ".bin"), "wb") as file:
        request.serialize(file)
