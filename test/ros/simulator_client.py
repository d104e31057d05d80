# SPDX-License-Identifier: BSD-3-Clause
"""What the rostests of the simulator share."""
import os
import re
import signal
import subprocess
import threading

import rospy
from client import executable
from contact_flow.srv import (
    ApplyImpulse, GetSimulatorState, MarkInstant, PredictOutcome, SetInput, SetSimulatorParameters,
    SetSimulatorState, SimulateTrajectory, StartRecording, StepSimulation, StopRecording)
from std_srvs.srv import Empty

SERVICES = {
    "pause_physics": Empty,
    "unpause_physics": Empty,
    "reset_simulation": Empty,
    "reset_world": Empty,
    "step": StepSimulation,
    "set_state": SetSimulatorState,
    "get_state": GetSimulatorState,
    "set_input": SetInput,
    "apply_impulse": ApplyImpulse,
    "set_parameters": SetSimulatorParameters,
    "mark": MarkInstant,
    "predict": PredictOutcome,
    "simulate": SimulateTrajectory,
    "start_recording": StartRecording,
    "stop_recording": StopRecording,
}


class Simulator:
    """simulator.step(seconds=0.1) calls the service `step`."""

    def __init__(self, node):
        self.node = node
        for name, kind in SERVICES.items():
            rospy.wait_for_service(node + "/" + name, timeout=30)
            setattr(self, name, rospy.ServiceProxy(node + "/" + name, kind))


class Listener:
    """All messages of a topic."""

    def __init__(self, topic, kind):
        self.messages = []
        self.lock = threading.Lock()
        self.subscriber = rospy.Subscriber(topic, kind, self.take, queue_size=10000)

    def take(self, message):
        with self.lock:
            self.messages.append(message)

    def all(self):
        with self.lock:
            return list(self.messages)


def state(message):
    return list(message.q) + list(message.v)


class RecordingNode:
    """A recording simulator of its own."""

    def __init__(self, directory, name, **parameters):
        self.name = name
        settings = {"online": "true", "record": "true", "bag_name": "run", "bag_directory": directory,
                    "paused": "false", **parameters}
        self.process = subprocess.Popen(
            [executable("contact_flow_node"), "__name:=" + name] +
            ["_{}:={}".format(key, value) for key, value in settings.items()],
            stdout=subprocess.DEVNULL)
        self.bag = os.path.join(directory, "run_online.bag")

    def stop(self, how=signal.SIGINT):
        self.process.send_signal(how)
        self.process.wait(timeout=30)


def verify(*bags):
    return subprocess.run([executable("verify_bag"), *bags], stdout=subprocess.PIPE, text=True)


def verified(result):
    """How many results verify_bag has found to be the same."""
    return int(re.search(r"(\d+) verified", result.stdout).group(1))
