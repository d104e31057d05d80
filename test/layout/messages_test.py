#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The requests of services are those of their records: SameFields copies them byte by byte; types of records are in one list.

A record (msg/XRecord.msg) holds the request that it answers. A service is asked the same fields, flat, so that calls from a
shell stay short; the goal of an action holds the request itself.
"""
import re
import unittest

from include_direction_test import ROOT, files, main

SERVICES = {
    "SimulateTrajectory": "SimulationRequest",
    "ComputeBDerivative": "DerivativeRequest",
    "CompareBDerivative": "ComparisonRequest",
    "CheckAssumptions": "AssumptionRequest",
    "LinearizeTrajectory": "LinearizationRequest",
    "ComputePoincareMap": "PoincareRequest",
    "DecideStability": "StabilityRequest",
    "FindStabilizingFeedback": "StepFeedbackRequest",
    "DecideControllability": "ControllabilityRequest",
    "ComputeCovariance": "CovarianceRequest",
    "ComputeGradient": "GradientRequest",
    "MakePolicy": "PolicyRequest",
}


def fields(text):
    """(type, name) of each field of a definition up to its first ---, in order; constants and comments left out."""
    lines = (line.split("#")[0].strip() for line in text.split("\n---")[0].splitlines())
    return [tuple(line.split()) for line in lines if line and "=" not in line]


def definition(path):
    return fields((ROOT / path).read_text(encoding="utf-8"))


class Requests(unittest.TestCase):
    def test_services_have_the_fields_of_their_requests(self):
        for service, request in SERVICES.items():
            self.assertEqual(definition("srv/%s.srv" % service), definition("msg/%s.msg" % request), service)

    def test_every_request_of_a_record_is_asked_for(self):
        goals = {dict((name, kind) for kind, name in definition(path.relative_to(ROOT))).get("request")
                 for path in sorted((ROOT / "action").glob("*.action"))}
        for path in sorted((ROOT / "msg").glob("*Record.msg")):
            request = dict((name, kind) for kind, name in definition(path.relative_to(ROOT)))["request"]
            self.assertIn(request, set(SERVICES.values()) | goals, path.name)


RECORDS = "src/ros/recording/record_types.h"
# What is repeated in another way than the others, or published besides.
SPECIAL = {"SimulationRecord", "EnsembleRecord", "PolicyRecord"}


def named_records(texts, records):
    """(path, record) of what publishes, records and verifies naming a record by itself; `texts` by path."""
    return sorted((path, name) for path, text in texts.items()
                  if path != RECORDS for name in set(re.findall(r"\b\w+Record\b", text)) & records)


class Records(unittest.TestCase):
    def test_are_named_in_one_list(self):
        records = {path.stem for path in (ROOT / "msg").glob("*Record.msg")}
        texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
                 for path in files(ROOT, ["src/ros/recording", "src/ros/verification"], [".h", ".cc"])}
        self.assertGreater(len(records), len(SPECIAL))
        self.assertEqual(set(), records - set(re.findall(r"RecordType<(\w+)", texts[RECORDS])))
        self.assertEqual([], named_records(texts, records - SPECIAL))

    def test_another_list_is_seen(self):
        texts = {RECORDS: "RecordType<ARecord>", "src/ros/recording/outlet.h": "void Deliver(ARecord*);  // BRecord"}
        self.assertEqual([("src/ros/recording/outlet.h", "ARecord")], named_records(texts, {"ARecord"}))


class Fields(unittest.TestCase):
    def test_differences_are_seen(self):
        self.assertEqual([("float64", "a"), ("uint8[]", "b")],
                         fields("# of\nfloat64 a  # [m]\nuint8 OK=0\n\nuint8[] b\n---\nfloat64 c\n"))
        self.assertNotEqual(fields("float64 a\nfloat64 b"), fields("float64 b\nfloat64 a"))
        self.assertNotEqual(fields("float64 a"), fields("float32 a"))


if __name__ == "__main__":
    main([Requests, Records, Fields], __doc__)
