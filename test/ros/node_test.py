#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The node's answers against the reference cases, and what it publishes."""
import threading
import unittest

import numpy
import rospy
import rostest
from client import Client, case, labels, matrix
from contact_flow.msg import (
    ContactTrajectory, InitialState, ModelDescription, ModeSequence, OutcomeDerivative,
    ResultWarning, RowMajorMatrix, SimulationOptions)
from contact_flow.srv import ComputeBDerivativeResponse as Outcome

TIGHT = SimulationOptions(relative_tolerance=1e-12, absolute_tolerance=1e-12)


def relative_error(derivative, expected):
    return numpy.max(numpy.abs(derivative - expected)) / max(1, numpy.max(numpy.abs(expected)))


def is_first_order(modes, simulated):
    """The modes of a perturbed run to first order are those simulated, or fewer where two touchdowns
    are apart by the square of the perturbation only."""
    rest = iter(simulated)
    return modes[0] == simulated[0] and modes[-1] == simulated[-1] and all(m in rest for m in modes)


class Simulate(unittest.TestCase):
    def test_nothing_asked_is_the_nominal_run(self):
        reference = case("soft_biped_simultaneous")
        answer = Client("soft").simulate()
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, Outcome.OK)
        self.assertEqual(answer.recorded, "")
        run = answer.trajectory
        self.assertEqual(run.model, "soft_biped")
        self.assertEqual(run.coordinates, reference["coordinates"])
        self.assertEqual(run.duration, reference["horizon"])
        self.assertEqual(answer.mode_sequence, labels(reference["mode_sequence"]))
        numpy.testing.assert_allclose(answer.event_times, reference["event_times"], atol=1e-9)
        x = numpy.array(run.final_q + run.final_v)
        self.assertLess(numpy.max(numpy.abs(x - reference["final_state"]["x"])), 1e-7)
        self.assertFalse(run.header.stamp.is_zero())

    def test_every_case_of_the_model_at_tight_tolerance(self):
        for node, names in (("soft", ["soft_biped_simultaneous", "soft_biped_tilted"]),
                            ("rigid", ["rigid_biped_simultaneous", "rigid_biped_left_first",
                                       "rigid_biped_right_first"]),
                            ("wall", ["wall_and_floor"]),
                            ("light", ["soft_biped_decoupled"])):
            for name in names:
                reference = case(name)
                state = InitialState(q=reference["initial_state"]["q"],
                                     v=reference["initial_state"]["v"])
                answer = Client(node).simulate(duration=reference["horizon"], state=state,
                                               options=TIGHT)
                self.assertTrue(answer.success, answer.message)
                self.assertEqual(answer.mode_sequence, labels(reference["mode_sequence"]), name)
                numpy.testing.assert_allclose(answer.event_times, reference["event_times"],
                                              atol=1e-11)
                x = numpy.array(answer.trajectory.final_q + answer.trajectory.final_v)
                self.assertLess(numpy.max(numpy.abs(x - reference["final_state"]["x"])), 1e-10,
                                name)

    def test_samples_arcs_and_transitions_fit_together(self):
        answer = Client("soft").simulate(samples=50)
        run = answer.trajectory
        q, v = matrix(run.q), matrix(run.v)
        self.assertEqual(len(run.t), q.shape[0])
        self.assertEqual(q.shape, v.shape)
        self.assertTrue(numpy.all(numpy.diff(run.t) >= 0))
        self.assertEqual(len(run.arcs), len(run.transitions) + 1)
        self.assertEqual(sum(arc.num_samples for arc in run.arcs), len(run.t))
        for arc, transition in zip(run.arcs, run.transitions):
            last = arc.first_sample + arc.num_samples - 1
            self.assertEqual(list(v[last]), list(transition.v_before))
            self.assertEqual(list(v[last + 1]), list(transition.v_after))
            self.assertEqual(list(q[last]), list(transition.q))
        self.assertEqual(list(q[-1]), list(run.final_q))
        few = Client("soft").simulate(samples=1).trajectory
        self.assertEqual(len(few.t), 2 * len(few.arcs))
        self.assertEqual(few.final_q, run.final_q)

    def test_states_by_name(self):
        client = Client("soft")
        reference = case("soft_biped_tilted")
        i = reference["coordinates"].index("body_pitch")
        state = InitialState(names=["body_pitch"], positions=[reference["initial_state"]["q"][i]])
        by_name = client.simulate(state=state)
        self.assertTrue(by_name.success, by_name.message)
        self.assertEqual(matrix(by_name.trajectory.q)[0][i], reference["initial_state"]["q"][i])
        moving = client.simulate(state=InitialState(names=["body_x", "body_z"],
                                                    velocities=[0.1, 0.2]))
        self.assertEqual(list(matrix(moving.trajectory.v)[0]), [0.1, 0, 0, 0.2, 0, 0, 0])

    def test_requests_at_once_give_the_bits_of_one_alone(self):
        client = Client("soft")
        alone = client.simulate().trajectory
        answers = []
        threads = [threading.Thread(target=lambda: answers.append(client.simulate()))
                   for _ in range(12)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(answers), 12)
        for answer in answers:
            self.assertEqual(answer.trajectory.q.data, alone.q.data)
            self.assertEqual(answer.trajectory.final_v, alone.final_v)
        stamps = {answer.trajectory.header.stamp.to_nsec() for answer in answers}
        self.assertEqual(len(stamps), 12)

    def test_a_small_budget_is_an_outcome_and_keeps_the_run_so_far(self):
        answer = Client("soft").simulate(options=SimulationOptions(max_steps=5))
        self.assertTrue(answer.success)
        self.assertEqual(answer.outcome, Outcome.BUDGET_EXCEEDED)
        self.assertIn("max_steps", answer.message)
        self.assertLess(answer.trajectory.t_end, 1.4)
        self.assertGreater(len(answer.trajectory.t), 0)


class Differentiate(unittest.TestCase):
    def check(self, node, name, tolerance, options, **fields):
        reference = case(name)
        expected = reference["directional_derivatives"]
        directions = numpy.array([d["direction"] for d in expected], dtype=float)
        state = InitialState(q=reference["initial_state"]["q"], v=reference["initial_state"]["v"])
        answer = Client(node).b_derivative(
            duration=reference["horizon"], state=state, options=options,
            direction_matrix=RowMajorMatrix(data=list(directions.flatten())), **fields)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, Outcome.OK, answer.message)
        result = answer.derivative
        self.assertTrue(numpy.array_equal(matrix(result.directions), directions))
        scale = max(numpy.max(numpy.abs(d["derivative"])) for d in expected)
        for row, modes, d in zip(matrix(result.derivatives), result.direction_modes, expected):
            self.assertLess(numpy.max(numpy.abs(row - d["derivative"])), tolerance * scale, name)
            self.assertTrue(is_first_order(modes.names, labels(d["mode_sequence"])),
                            (d["direction"], modes.names, d["mode_sequence"]))
        return result

    def test_reference_derivatives(self):
        result = self.check("soft", "soft_biped_simultaneous", 1e-8, TIGHT, all_pieces=True)
        self.assertFalse(result.is_differentiable)
        self.assertEqual(len(result.pieces), 2)
        self.assertEqual({tuple(p.omega[0].names) for p in result.pieces},
                         {("left_foot", "right_foot"), ("right_foot", "left_foot")})
        for w, derivative in zip(matrix(result.directions), matrix(result.derivatives)):
            best = max(result.pieces, key=lambda p: numpy.min(matrix(p.cone) @ w))
            self.assertLess(relative_error(matrix(best.matrix) @ w, derivative), 1e-10)
        self.assertTrue(self.check("soft", "soft_biped_tilted", 1e-8, TIGHT).is_differentiable)
        self.assertTrue(self.check("light", "soft_biped_decoupled", 1e-8, TIGHT).is_differentiable)
        self.check("wall", "wall_and_floor", 1e-8, TIGHT)

    def test_reference_derivatives_at_the_default_tolerance(self):
        self.check("soft", "soft_biped_simultaneous", 1e-6, SimulationOptions())

    def test_no_direction_means_both_signs_of_every_coordinate(self):
        result = Client("soft").b_derivative().derivative
        self.assertEqual(len(result.direction_names), 4 * 7)
        self.assertEqual(result.direction_names[:2], ["+body_x", "-body_x"])
        self.assertEqual(result.direction_names[-1], "-d/dt body_pitch")
        self.assertTrue(numpy.array_equal(matrix(result.directions)[0], numpy.eye(14)[0]))
        self.assertTrue(numpy.array_equal(matrix(result.directions)[-1], -numpy.eye(14)[13]))

    def test_directions_by_name(self):
        result = Client("soft").b_derivative(
            directions=["left_foot_z", "-body_pitch", "+d/dt body_z"]).derivative
        self.assertEqual(result.direction_names, ["+left_foot_z", "-body_pitch", "+d/dt body_z"])
        expected = numpy.array([numpy.eye(14)[4], -numpy.eye(14)[6], numpy.eye(14)[10]])
        self.assertTrue(numpy.array_equal(matrix(result.directions), expected))

    def test_time_derivative_is_the_velocity_reached(self):
        result = Client("soft").b_derivative(directions=["body_x"]).derivative
        self.assertEqual(result.time_derivative[:7], result.final_v)

    def test_directions_that_leave_the_initial_mode(self):
        client = Client("wall")
        by_default = client.b_derivative()
        self.assertTrue(by_default.success, by_default.message)
        self.assertNotIn("+y", by_default.derivative.direction_names)
        self.assertIn("+x", by_default.derivative.direction_names)
        self.assertIn("+y", by_default.message)
        self.assertIn("{floor}", by_default.message)
        self.assertEqual([w.code for w in by_default.warnings], [ResultWarning.LEFT_OUT])
        self.assertIn("+y", by_default.warnings[0].message)
        asked = client.b_derivative(directions=["x", "+y"])
        self.assertFalse(asked.success)
        self.assertIn("+y", asked.message)
        projected = client.b_derivative(directions=["x", "+y"], project_directions=True)
        self.assertTrue(projected.success, projected.message)
        self.assertIn("+y", projected.message)
        self.assertEqual([w.code for w in projected.warnings], [ResultWarning.PROJECTED])
        compared = client.compare(directions=["+y"], project_directions=True, alphas=[1e-3])
        self.assertEqual([w.code for w in compared.warnings], [ResultWarning.PROJECTED])
        self.assertTrue(numpy.array_equal(matrix(projected.derivative.directions)[1],
                                          numpy.zeros(6)))

    def test_discontinuous_outcome_lists_the_orders(self):
        answer = Client("rigid").b_derivative()
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.outcome, Outcome.DISCONTINUOUS)
        self.assertNotEqual(answer.message, "")
        self.assertEqual(answer.derivative.derivatives.data, ())
        orders = {tuple(o.order): o for o in answer.derivative.orders}
        self.assertEqual(set(orders), {("left_foot", "right_foot"), ("right_foot", "left_foot")})
        left_first = orders["left_foot", "right_foot"]
        right_first = orders["right_foot", "left_foot"]
        self.assertEqual(left_first.mode_after, ["right_foot"])
        self.assertEqual(right_first.mode_after, ["left_foot"])
        self.assertAlmostEqual(left_first.t, 1, places=9)
        self.assertGreater(abs(left_first.v_after[2] - right_first.v_after[2]), 0.1)
        self.assertEqual(left_first.outcome, Outcome.OK)
        self.assertFalse(left_first.continued)
        compared = Client("rigid").compare()
        self.assertTrue(compared.success)
        self.assertEqual(compared.outcome, Outcome.DISCONTINUOUS)

    def test_orders_continued_to_the_horizon(self):
        client = Client("rigid")
        pitch = 1e-6
        answer = client.b_derivative(continue_orders=True, options=TIGHT)
        self.assertEqual(answer.outcome, Outcome.DISCONTINUOUS)
        self.assertEqual(len(answer.derivative.orders), 2)
        for order in answer.derivative.orders:
            self.assertTrue(order.continued)
            self.assertEqual((order.outcome, order.message), (Outcome.OK, ""))
            self.assertEqual(order.modes[0], "{%s}" % order.mode_after[0])
            # Pitched up, the right foot is higher: the left one lands first, and the other way round.
            # The run is within O(pitch) of the limit, and 0.1 away from any other.
            up = pitch if order.order[0] == "left_foot" else -pitch
            state = InitialState(names=["body_pitch"], positions=[up])
            run = client.simulate(state=state, options=TIGHT)
            self.assertEqual(run.trajectory.transitions[0].activated, [order.order[0]])
            near = numpy.array(run.trajectory.final_q + run.trajectory.final_v)
            end = numpy.array(order.final_q + order.final_v)
            self.assertLess(numpy.max(numpy.abs(near - end)), 100 * pitch)
            both = numpy.array(answer.derivative.final_q + answer.derivative.final_v)
            self.assertGreater(numpy.max(numpy.abs(both - end)), 0.1)
        smooth = Client("soft").b_derivative(continue_orders=True)
        self.assertEqual((smooth.outcome, smooth.derivative.orders), (Outcome.OK, []))


class Compare(unittest.TestCase):
    def test_quotients_converge_with_slope_one(self):
        answer = Client("soft").compare(directions=["+body_pitch", "-body_pitch"])
        self.assertTrue(answer.success, answer.message)
        result = answer.comparison
        self.assertEqual([c.name for c in result.comparisons], ["+body_pitch", "-body_pitch"])
        for c in result.comparisons:
            self.assertEqual(list(c.alphas), [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
            self.assertEqual(list(c.outcomes), [b for b in c.outcomes])
            self.assertAlmostEqual(c.slope, 1, delta=0.1)
            self.assertLess(c.errors[-1], 1e-4)
            errors = numpy.max(numpy.abs(matrix(c.quotients) - numpy.array(c.prediction)), axis=1)
            numpy.testing.assert_allclose(errors, c.errors, rtol=1e-12)
            self.assertEqual(c.modes[-1].names[0], "{}")
        self.assertLess(result.worst_error, 1e-4)

    def test_every_direction_by_default(self):
        answer = Client("wall").compare(alphas=[1e-3, 1e-4, 1e-5])
        self.assertTrue(answer.success, answer.message)
        self.assertGreater(len(answer.comparison.comparisons), 4)
        self.assertLess(answer.comparison.worst_error, 1e-3)


class Describe(unittest.TestCase):
    def test_own_model(self):
        answer = Client("light").describe_model()
        self.assertTrue(answer.success, answer.message)
        d = answer.description
        self.assertEqual(d.name, "soft_biped")
        self.assertIn("rigid_biped", answer.models)
        self.assertEqual({p.name: p.value for p in d.parameters}["flywheel"], 0)
        self.assertTrue(all(p.meaning for p in d.parameters))
        self.assertEqual(len(d.nominal_q), len(d.coordinates))
        self.assertEqual(d.options.relative_tolerance, 1e-10)
        self.assertEqual(d.options.max_steps, 20000)
        self.assertEqual(d.options.impact_law, "complementarity")
        self.assertEqual(d.samples, 200)

    def test_another_model(self):
        answer = Client("soft").describe_model(model="ball_in_corner")
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.description.coordinates, ["x", "y"])
        self.assertEqual(list(answer.description.restitution), [0.7, 0.7])


class Topics(unittest.TestCase):
    """Results are latched: who subscribes later still gets the last one."""

    def test_latched_results_are_the_answers(self):
        client = Client("soft")
        run = client.simulate(duration=1.2)
        derivative = client.b_derivative(directions=["+body_z"])

        def last(topic, kind):
            message = rospy.wait_for_message("soft/" + topic, kind, timeout=10)
            message.header.seq = 0  # counted by every publisher for itself
            return message

        self.assertEqual(last("trajectory", ContactTrajectory), run.trajectory)
        self.assertEqual(last("b_derivative", OutcomeDerivative), derivative.derivative)
        modes = last("mode_sequence", ModeSequence)
        self.assertEqual(labels(m.active for m in modes.modes), run.mode_sequence)
        self.assertEqual(modes.header, run.trajectory.header)
        self.assertEqual(last("model_description", ModelDescription).name, "soft_biped")
        self.assertGreater(derivative.derivative.header.stamp, run.trajectory.header.stamp)


if __name__ == "__main__":
    rospy.init_node("node_test")
    rostest.rosrun("contact_flow", "node", "__main__")
