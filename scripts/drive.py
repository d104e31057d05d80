#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Drives a running simulator from the terminal, and shows mode, forces and margins live.

  drive.py [/NODE]                    keys, see below; /simulator unless given
  drive.py [/NODE] pause | unpause | reset | reset_world | show
  drive.py [/NODE] step SECONDS
  drive.py [/NODE] events COUNT
  drive.py [/NODE] push COORDINATE IMPULSE      [N s] or [N m s]

Keys: space pauses and goes on; s a step (0.01 s), S a long one (0.1 s); e to the next event; r resets the world,
R the simulation; left and right choose a coordinate, up and down push it, + and - make pushes ten times larger or
smaller; m marks the instant from which the derivative rolls; q quits.
"""
import argparse
import curses
import sys

import rospy
from contact_flow.msg import HybridState, RollingTangents, SimulatorEvent, SimulatorStatus
from contact_flow.srv import ApplyImpulse, MarkInstant, StepSimulation
from std_srvs.srv import Empty

SHORT_STEP, LONG_STEP = 0.01, 0.1  # [s]
TIMEOUT = 10  # [s]


class Remote:
    """The services of a simulator; each answers what there is to say."""

    def __init__(self, node):
        self.node = node
        self.services = {}

    def call(self, name, kind, **request):
        try:
            if name not in self.services:
                rospy.wait_for_service(self.node + "/" + name, timeout=TIMEOUT)
                self.services[name] = rospy.ServiceProxy(self.node + "/" + name, kind)
            answer = self.services[name](**request)
        except (rospy.ServiceException, rospy.ROSException) as error:
            return False, "{}: {}".format(name, error)
        if getattr(answer, "success", True):
            return True, getattr(answer, "message", "") or name
        return False, answer.message

    def simply(self, name):
        return self.call(name, Empty)

    def step(self, seconds=0, events=0):
        return self.call("step", StepSimulation, seconds=seconds, events=events)

    def push(self, coordinate, impulse):
        return self.call("apply_impulse", ApplyImpulse, names=[coordinate], impulse=[impulse])

    def mark(self):
        return self.call("mark", MarkInstant)


class View:
    """The last messages of a simulator, as lines of text."""

    def __init__(self, node):
        self.state = self.status = self.event = self.tangents = None
        rospy.Subscriber(node + "/state", HybridState, lambda m: setattr(self, "state", m))
        rospy.Subscriber(node + "/status", SimulatorStatus, lambda m: setattr(self, "status", m))
        rospy.Subscriber(node + "/events", SimulatorEvent, lambda m: setattr(self, "event", m))
        rospy.Subscriber(node + "/rolling_derivative", RollingTangents,
                         lambda m: setattr(self, "tangents", m))

    def wait(self):
        for _ in range(TIMEOUT * 20):  # by the wall: simulated time may stand still
            if (self.state and self.status) or rospy.is_shutdown():
                break
            rospy.rostime.wallsleep(0.05)
        return self.state is not None and self.status is not None

    def lines(self, chosen=None):
        s, status = self.state, self.status
        if s is None or status is None:
            return ["waiting for the simulator ..."]
        what = "ended: " + status.message if status.outcome else "paused" if status.paused else "running"
        lines = ["t = {:.6f} s   epoch {}   {} events   {}".format(s.t, s.epoch, s.events, what),
                 "real-time factor {:.3g} of {:.3g}   lateness {:.3f} ms (largest {:.3f} ms)   "
                 "{:.3g} events/s".format(status.achieved_factor, status.real_time_factor,
                                          1e3 * status.lateness, 1e3 * status.largest_lateness,
                                          status.events_per_second),
                 "", "mode {" + ", ".join(s.mode) + "}"]
        for name, force in zip(s.constraints, s.force):
            bar = "#" * min(40, int(abs(force) / 2 + 0.5)) if name in s.mode else ""
            lines.append("  {:<24}{:>12.4f} N  {}".format(name, force, bar))
        margins = status.margins
        lines += ["", "margins: approach {:.3g} m/s, release {:.3g} N/s, gap {:.3g} m, force {:.3g} N, "
                      "interval {:.3g} s".format(margins.approach_speed, margins.release_rate,
                                                 margins.gap, margins.force, margins.event_interval)]
        if self.event is not None:
            e = self.event.transition
            lines.append("last event {} at {:.6f} s: {{{}}} -> {{{}}}, impulse {:.4g} N s".format(
                self.event.index, e.t, ", ".join(e.mode_before), ", ".join(e.mode_after),
                sum(e.impulse)))
        if self.tangents is not None and self.tangents.epoch == s.epoch:
            rolled = self.tangents
            largest = max(map(abs, rolled.tangents.data), default=0)
            lines.append("derivative since {:.4f} s along {} directions: {}".format(
                rolled.t_mark, len(rolled.direction_names),
                rolled.message if rolled.outcome else "largest entry {:.4g}".format(largest)))
        lines.append("")
        velocities = dict(zip(s.velocities, s.v))
        positions = dict(zip(s.coordinates, s.q))
        for k, name in enumerate(s.velocities):
            lines.append("{} {:<24}{:>14} {:>14.6f}".format(
                ">" if k == chosen else " ", name,
                "{:.6f}".format(positions[name]) if name in positions else "", velocities[name]))
        return lines


def drive(screen, node):
    remote, view = Remote(node), View(node)
    curses.curs_set(0)
    screen.timeout(100)
    chosen, impulse, note = 0, 0.1, "? space s S e r R m arrows + - q"
    while not rospy.is_shutdown():
        screen.erase()
        height, width = screen.getmaxyx()
        lines = ["{}   push {:g}".format(node, impulse), ""] + view.lines(chosen) + ["", note]
        for row, line in enumerate(lines[:height - 1]):
            screen.addnstr(row, 0, line, width - 1)
        screen.refresh()
        key = screen.getch()
        names = view.state.velocities if view.state else []
        paused = view.status is None or view.status.paused
        actions = {
            ord(" "): lambda: remote.simply("unpause_physics" if paused else "pause_physics"),
            ord("s"): lambda: remote.step(SHORT_STEP),
            ord("S"): lambda: remote.step(LONG_STEP),
            ord("e"): lambda: remote.step(events=1),
            ord("r"): lambda: remote.simply("reset_world"),
            ord("R"): lambda: remote.simply("reset_simulation"),
            ord("m"): remote.mark,
        }
        if key == ord("q"):
            return
        if key in actions:
            note = actions[key]()[1]
        elif key in (curses.KEY_LEFT, curses.KEY_RIGHT) and names:
            chosen = (chosen + (1 if key == curses.KEY_RIGHT else -1)) % len(names)
        elif key in (curses.KEY_UP, curses.KEY_DOWN) and names:
            note = remote.push(names[chosen], impulse if key == curses.KEY_UP else -impulse)[1]
        elif key in (ord("+"), ord("-")):
            impulse *= 10 if key == ord("+") else 0.1


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*", metavar="[/NODE] [COMMAND ...]")
    words = parser.parse_args(rospy.myargv()[1:]).words
    commands = {"pause": 0, "unpause": 0, "reset": 0, "reset_world": 0, "show": 0, "step": 1,
                "events": 1, "push": 2}
    node = words.pop(0) if words and words[0].startswith("/") else "/simulator"
    if words and (words[0] not in commands or len(words) != 1 + commands[words[0]]):
        parser.error("unknown command, or wrong number of arguments: " + " ".join(words))
    rospy.init_node("drive", anonymous=True, disable_signals=True)
    if not words:
        if not sys.stdin.isatty():
            parser.error("keys need a terminal; give a command")
        curses.wrapper(drive, node)
        return 0
    remote = Remote(node)
    try:
        ok, note = {
            "pause": lambda: remote.simply("pause_physics"),
            "unpause": lambda: remote.simply("unpause_physics"),
            "reset": lambda: remote.simply("reset_simulation"),
            "reset_world": lambda: remote.simply("reset_world"),
            "step": lambda: remote.step(float(words[1])),
            "events": lambda: remote.step(events=int(words[1])),
            "push": lambda: remote.push(words[1], float(words[2])),
            "show": lambda: (True, "show"),
        }[words[0]]()
    except ValueError as error:
        parser.error(str(error))
    if not ok:
        print(note, file=sys.stderr)
        return 1
    if words[0] == "show":
        view = View(node)
        ok = view.wait()
        print("\n".join(view.lines()))
        return 0 if ok else 1
    print(note)
    return 0


if __name__ == "__main__":
    sys.exit(main())
