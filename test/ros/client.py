# SPDX-License-Identifier: BSD-3-Clause
"""What the rostests share: the services of a node as functions, reference cases, matrices."""
import json
import os
import subprocess
import time

import numpy
import rospkg
import rospy
from contact_flow.srv import (
    CheckAssumptions, CompareBDerivative, ComputeBDerivative, ComputeCovariance, ComputeGradient,
    ComputePoincareMap, DecideControllability, DecideStability, DescribeModel, FindStabilizingFeedback, LinearizeTrajectory,
    SimulateTrajectory,
    StartRecording, StopRecording)

SERVICES = {
    "simulate": SimulateTrajectory,
    "b_derivative": ComputeBDerivative,
    "compare": CompareBDerivative,
    "check_assumptions": CheckAssumptions,
    "linearize": LinearizeTrajectory,
    "poincare_map": ComputePoincareMap,
    "assess_stability": DecideStability,
    "find_stabilizing_feedback": FindStabilizingFeedback,
    "assess_controllability": DecideControllability,
    "propagate_covariance": ComputeCovariance,
    "gradient": ComputeGradient,
    "describe_model": DescribeModel,
    "start_recording": StartRecording,
    "stop_recording": StopRecording,
}


class Client:
    """client.simulate(duration=1.4) calls the service `simulate` of the node."""

    def __init__(self, node):
        self.node = node
        for name, kind in SERVICES.items():
            rospy.wait_for_service(node + "/" + name, timeout=20)
            setattr(self, name, rospy.ServiceProxy(node + "/" + name, kind))


def package_path():
    return rospkg.RosPack().get_path("contact_flow")


def executable(name):
    """Path of an executable of the package, in the devel or the install space."""
    found = subprocess.check_output(["catkin_find", "--first-only", "--libexec", "contact_flow", name])
    return found.decode().strip()


def case(name):
    """A reference case of test/data, with its state as one vector."""
    with open(os.path.join(package_path(), "test", "data", name + ".json")) as file:
        data = json.load(file)
    for key in ("initial_state", "final_state"):
        data[key]["x"] = numpy.array(data[key]["q"] + data[key]["v"])
    return data


def matrix(message):
    return numpy.array(message.data).reshape(message.rows, message.cols)


def labels(modes):
    return ["{" + ", ".join(mode) + "}" for mode in modes]


def wait_until(condition, seconds=20):
    end = time.time() + seconds
    while time.time() < end:
        if condition():
            return True
        time.sleep(0.05)
    return False
