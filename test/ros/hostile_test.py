#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A campaign of generated hostile requests against a live node, over all services, the input topic and reconfigure:
it does not die, no answer takes longer than its budget, a good request in between is answered to the same bits, and
refusals have words. What comes depends on the seed alone, in each client. Its size is the argument `requests`:

    rostest contact_flow hostile.test requests:=1000000 clients:=8
"""
import io
import math
import os
import random
import threading
import time
import unittest
import xmlrpc.client

import rosgraph
import rospy
import rostest
from client import SERVICES as ANSWERS
from contact_flow.msg import InputCommand, ReturnSection
from contact_flow.srv import SimulateTrajectory
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from simulator_client import SERVICES as COMMANDS

BUDGET, SLACK = 2, 20  # [s] of a request, and of what has none yet, on a busy machine
HOSTILE = [math.nan, math.inf, -math.inf, 5e-324, 1e-310, 1e-100, 1e-9, 0.0, -0.0, 1.0, -1.0, 1e5, 1e9, 4e9, 1e15, 1e100,
           1e200, 1e308, -1e308]
WORDS = ["body_x", "body_z", "body_pitch", "left_foot_z", "left_foot", "apex", "coordinate", "touchdown", "clock",
         "body_mass", "gravity", "projection", "+body_x", "-d/dt body_z", "", "%s%n", "x" * 5000, "ä\0b"]
WHOLE = {"int8": 7, "int16": 15, "int32": 31, "int64": 63, "uint8": 8, "uint16": 16, "uint32": 32, "uint64": 64}


class Mutator:
    """Fills messages of any type with what nobody would mean."""

    def __init__(self, dice):
        self.dice = dice

    def value(self, kind, depth):
        dice = self.dice
        if kind.endswith("]"):
            inner = kind[:kind.index("[")]
            sizes = [0, 0, 1, 2, 3, 7, 14] + ([1000] if inner == "float64" else [])
            return [self.value(inner, depth + 1) for _ in range(dice.choice(sizes))]
        if kind in ("float64", "float32"):
            return dice.choice(HOSTILE) if dice.random() < 0.3 else dice.gauss(0, 1)
        if kind == "bool":
            return dice.random() < 0.5
        if kind in WHOLE:
            bits, least = WHOLE[kind], 0 if kind[0] == "u" else -2 ** WHOLE[kind]
            return dice.choice([0, 0, 1, 2, 3, 10, 1000, 2 ** bits - 1, least]) if bits > 8 else dice.choice([0, 1, 2, 7])
        if kind == "string":
            return dice.choice(WORDS)
        if kind in ("time", "duration"):
            return rospy.Time(dice.choice([0, 1, 4000000000, 4294967295]))
        return self.message(ReturnSection if kind.endswith("ReturnSection") else find_message(kind), depth + 1)

    def message(self, kind, depth=0, share=None):
        """Some of the fields are hostile, the others as they are left out."""
        message = kind()
        share = share or self.dice.choice([0.1, 0.3, 0.8])
        for name, slot in zip(message.__slots__, message._slot_types):  # pylint: disable=protected-access
            if self.dice.random() < share and depth < 4:
                setattr(message, name, self.value(slot, depth))
        return message


def find_message(kind):
    import roslib.message  # pylint: disable=import-outside-toplevel
    return roslib.message.get_message_class(kind)


def serialized(answer):
    stamp = answer.trajectory.header
    stamp.stamp, stamp.seq = rospy.Time(), 0
    buffer = io.BytesIO()
    answer.serialize(buffer)
    return buffer.getvalue()


class Client:
    """Sends hostile requests, one after the other."""

    def __init__(self, number, count, seed):
        self.dice = random.Random("%d %d" % (seed, number))
        self.mutator = Mutator(self.dice)
        self.count, self.wrong = count, []
        self.sent = self.refused = self.dropped = 0
        self.slowest = (0, "")
        services = {**ANSWERS, **COMMANDS}
        # Their own tests; here bags would fill the disk, and steps wait for others' motion.
        for name in ("start_recording", "stop_recording"):
            del services[name]
        self.services = {name: (rospy.ServiceProxy("besieged/" + name, kind), kind)
                         for name, kind in services.items()}
        self.reconfigure = rospy.ServiceProxy("besieged/simulator/set_parameters", Reconfigure)
        self.input = rospy.Publisher("besieged/input", InputCommand, queue_size=10)

    def run(self):
        try:
            for _ in range(self.count):
                self.one()
                self.sent += 1
        except Exception as error:  # pylint: disable=broad-except
            self.wrong.append("%s: %s" % (type(error).__name__, error))

    def one(self):
        if self.dice.random() < 0.05:
            self.input.publish(self.mutator.message(InputCommand))
            return
        if self.dice.random() < 0.03:
            name = self.dice.choice(["rate", "real_time_factor", "display_rate"])
            self.reconfigure(Config(doubles=[DoubleParameter(name=name, value=self.dice.choice(HOSTILE))]))
            return
        name = self.dice.choice(sorted(self.services))
        service, kind = self.services[name]
        request = self.mutator.message(kind._request_class)  # pylint: disable=protected-access
        self.bound(name, request)
        begin = time.time()
        try:
            try:
                answer = service(request)
            except rospy.ServiceException as error:
                # Seen once in 55 000: the connection drops before the answer. The same request is answered then.
                if "transport error" not in str(error):
                    raise
                self.dropped += 1
                answer = service(request)
            if hasattr(answer, "success") and not answer.success:
                self.refused += 1
                if len(answer.message) < 5:
                    self.wrong.append("%s is refused without words" % name)
        except rospy.ServiceException as error:
            if "unpause_physics" not in str(error):
                self.wrong.append("%s: %s\n%s" % (name, error, request))
        took = time.time() - begin
        self.slowest = max(self.slowest, (took, name))
        if took > BUDGET + SLACK:
            self.wrong.append("%s took %.1f s:\n%s" % (name, took, request))

    @staticmethod
    def bound(name, request):
        """No request asks for more time than the campaign has."""
        options = getattr(getattr(request, "return_map", request), "options", None)
        if options is not None:
            options.max_seconds = options.max_seconds if not 0 < options.max_seconds <= 3600 else 1
            options.max_steps = options.max_steps if not 20000 < options.max_steps <= 10 ** 9 else 0
        if name == "step":
            request.seconds = request.seconds if not 0.1 < request.seconds <= 1e6 else 0.1
        for field in ("max_words", "max_linear_programs"):
            if hasattr(request, field):
                setattr(request, field, min(getattr(request, field) or 500, 500))


class Hostile(unittest.TestCase):
    def test_campaign(self):
        count = rospy.get_param("~requests", 2000)
        clients = rospy.get_param("~clients", 3)
        for name in {**ANSWERS, **COMMANDS}:
            rospy.wait_for_service("besieged/" + name, timeout=30)
        good = rospy.ServiceProxy("besieged/simulate", SimulateTrajectory)
        expected = serialized(good(duration=0.3))
        process = self.process_of("besieged")
        crowd = [Client(k, count // clients, rospy.get_param("~seed", 1)) for k in range(clients)]
        threads = [threading.Thread(target=client.run, daemon=True) for client in crowd]
        begin = time.time()
        for thread in threads:
            thread.start()
        asked, resident = 0, 0
        while any(thread.is_alive() for thread in threads):
            self.assertEqual(serialized(good(duration=0.3)), expected, "a good request in between")
            asked += 1
            resident = max(resident, self.resident(process))
            if any(client.wrong for client in crowd):
                break
            time.sleep(0.2)
        wrong = [text for client in crowd for text in client.wrong]
        self.assertEqual(wrong[:3], [])
        sent, refused = sum(c.sent for c in crowd), sum(c.refused for c in crowd)
        dropped = sum(c.dropped for c in crowd)
        self.assertLessEqual(dropped, 1 + sent // 10000, "connections without an answer")
        print("%d hostile requests in %.0f s, %d refused; the slowest %.2f s (%s); %d good ones in between; resident %.0f MB; %d dropped connections"
              % ((sent, time.time() - begin, refused) + max(c.slowest for c in crowd) + (asked, resident, dropped)))
        self.assertGreaterEqual(sent, count // clients * clients)
        self.assertEqual(serialized(good(duration=0.3)), expected)

    @staticmethod
    def process_of(name):
        uri = rosgraph.Master(rospy.get_name()).lookupNode("/" + name)
        return xmlrpc.client.ServerProxy(uri).getPid(rospy.get_name())[2]

    @staticmethod
    def resident(process):
        with open(os.path.join("/proc", str(process), "status")) as file:
            for line in file:
                if line.startswith("VmRSS"):
                    return int(line.split()[1]) / 1000
        return 0


if __name__ == "__main__":
    rospy.init_node("hostile_test")
    rostest.rosrun("contact_flow", "hostile", Hostile)
