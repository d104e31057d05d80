#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""run_action.py ACTION [REQUEST]: pursues a goal of a contact_flow action from the command line, with a progress bar.

  ACTION   …/find_periodic_orbit, …/optimize, …/optimize_trajectory or …/sweep
  REQUEST  its request in YAML, as for rosservice call; every field may be left out

    rosrun contact_flow run_action.py /trot/find_periodic_orbit "{section: {kind: apex, name: body_z}}"

Ctrl-C cancels the goal. Prints the result in YAML. Exit code: 0 when it was found, 1 when not, 2 for wrong use.
"""
import signal
import sys
import threading
import time

import actionlib
import genpy
import rospy
import yaml
from contact_flow.msg import (
    FindPeriodicOrbitAction, FindPeriodicOrbitGoal, OptimizeOutcomeAction, OptimizeOutcomeGoal,
    OptimizeTrajectoryAction, OptimizeTrajectoryGoal, OptimizeTrajectoryResult, SweepEnsembleAction,
    SweepEnsembleGoal)

KINDS = {"find_periodic_orbit": (FindPeriodicOrbitAction, FindPeriodicOrbitGoal),
         "optimize": (OptimizeOutcomeAction, OptimizeOutcomeGoal),
         "optimize_trajectory": (OptimizeTrajectoryAction, OptimizeTrajectoryGoal),
         "sweep": (SweepEnsembleAction, SweepEnsembleGoal)}
# Outcomes besides 0 for which it was found: a valley is a minimum, too.
FOUND = {"optimize_trajectory": (0, OptimizeTrajectoryResult.VALLEY)}
WIDTH = 30  # of the bar


class Bar:
    """One line on the standard error output that is written anew with each feedback."""

    def __init__(self):
        self.last, self.fraction = 0, 0

    def show(self, feedback):
        self.fraction = feedback.fraction
        if time.time() - self.last >= 0.1:
            self.last = time.time()
            self.write(self.of_runs(feedback) if hasattr(feedback, "rate") else
                       self.of_search(feedback.iteration, feedback.value))

    def close(self, result, found):
        """The last state, which feedback may be too late to tell."""
        if result.success and result.outcome in found:
            self.fraction = 1
        if hasattr(result.result, "runs"):
            self.write("%d runs: %s" % (result.result.runs, self.counts(result.result.outcomes)))
        elif result.result.iterations:
            last = result.result.iterations[-1]
            self.write(self.of_search(last.iteration, last.value if hasattr(last, "value") else last.cost))
        if self.last:
            sys.stderr.write("\n")

    @staticmethod
    def of_search(iteration, value):
        return "iteration %d, %.3g" % (iteration, value)

    @staticmethod
    def counts(outcomes):
        return ", ".join("%s %d" % (one.name, one.count) for one in outcomes)

    def of_runs(self, at):
        return "%d of %d runs, %.0f /s, %.0f s left: %s" % (at.done, at.total, at.rate, at.left,
                                                           self.counts(at.outcomes))

    def write(self, text):
        self.last = self.last or time.time()
        done = int(round(WIDTH * min(max(self.fraction, 0), 1)))
        sys.stderr.write("\r[%s%s] %3.0f %%  %s   " % (
            "#" * done, "." * (WIDTH - done), 100 * self.fraction, text))
        sys.stderr.flush()


def read_goal(kind, text):
    """The goal that a YAML text says; ValueError, with a sentence, for one that it is not."""
    goal = kind()
    try:
        fields = yaml.safe_load(text) if text else {}
        genpy.message.fill_message_args(goal.request, [fields or {}])
    except (yaml.YAMLError, genpy.MessageException, ValueError) as error:
        raise ValueError("the request is not in order: %s" % error)
    return goal


def main(arguments):
    if len(arguments) not in (2, 3) or arguments[1] in ("-h", "--help"):
        print(__doc__, file=sys.stderr)
        return 2
    name = arguments[1]
    if name.split("/")[-1] not in KINDS:
        print("%s is no action: expected …/%s" % (name, " or …/".join(sorted(KINDS))),
              file=sys.stderr)
        return 2
    action, goal_kind = KINDS[name.split("/")[-1]]
    try:
        goal = read_goal(goal_kind, arguments[2] if len(arguments) == 3 else "")
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    rospy.init_node("run_action", anonymous=True, disable_signals=True)
    client = actionlib.SimpleActionClient(name, action)
    if not client.wait_for_server(rospy.Duration(10)):
        print("no action server %s" % name, file=sys.stderr)
        return 1
    bar = Bar()
    interrupted = threading.Event()  # also while the goal is sent

    def interrupt(*_):
        interrupted.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a second Ctrl-C ends this script

    signal.signal(signal.SIGINT, interrupt)
    client.send_goal(goal, feedback_cb=bar.show)
    # A result that comes before send_goal has returned is known to its handle alone.
    while not client.wait_for_result(rospy.Duration(0.2)) and \
            client.gh.get_comm_state() != actionlib.CommState.DONE and not interrupted.is_set():
        pass
    if interrupted.is_set():
        client.cancel_goal()
        client.wait_for_result(rospy.Duration(30))
    result = client.get_result()
    if result is None:
        print("no result", file=sys.stderr)
        return 1
    found = FOUND.get(name.split("/")[-1], (0,))
    bar.close(result, found)
    print(result)
    return 0 if result.success and result.outcome in found else 1


if __name__ == "__main__":
    sys.exit(main([argument for argument in sys.argv if ":=" not in argument]))
