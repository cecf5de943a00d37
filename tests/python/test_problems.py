"""Problem and Plan: a variant's problem, solved once from Python."""

import unittest

import numpy as np
import solenoid

START = [0.01, 0.02, 2e5, 2e5]  # of the actuator: m, m/s, Pa, Pa


def posed(solver, **keys):
    horizon = keys.pop("horizon", {"steps": 40, "blocks": [1, 1, 2, 4]})
    problem = solenoid.Problem(solenoid.variant("posed", base="nine_robust", solver=solver, horizon=horizon, **keys))
    problem.initial = START
    problem.reference = [0.012, 0.0]
    return problem


class Problems(unittest.TestCase):
    def test_the_search_finds_what_trying_all_finds_and_a_plan_by_hand_costs_what_it_says(self):
        pruned, tried = posed("branch_and_bound"), posed("exhaustive")
        found, all_of_them = pruned.solve(), tried.solve()
        self.assertEqual(found.status, "optimal")
        self.assertEqual(found.cost, all_of_them.cost)
        np.testing.assert_array_equal(found.modes, all_of_them.modes)
        self.assertLess(found.nodes, all_of_them.nodes)
        self.assertEqual(pruned.plan(found.modes, found.inputs).cost, found.cost)
        others = [pruned.plan([mode] * 4).cost for mode in range(len(pruned.modes))]
        self.assertLessEqual(found.cost, min(others))
        self.assertIsNone(found.weights)

    def test_shapes(self):
        problem = posed("branch_and_bound")
        np.testing.assert_array_equal(problem.blocks, [5, 5, 10, 20])
        np.testing.assert_array_equal(problem.initial, START)
        self.assertEqual(problem.reference.shape, (40, 2))
        np.testing.assert_array_equal(problem.reference, np.tile([0.012, 0.0], (40, 1)))
        self.assertEqual(problem.points.shape, (9, 4))
        self.assertEqual(problem.solve().inputs.shape, (4, 1))

    def test_relaxed_weights_ride_in_the_plan_and_a_better_plan_is_gone_on_from(self):
        relaxed = posed("relaxed_pulses", rounding={"iterations": 50}).solve()
        self.assertEqual(relaxed.weights.shape, (40, 9))
        np.testing.assert_allclose(relaxed.weights.sum(axis=1), 1.0, atol=1e-12)
        self.assertGreaterEqual(relaxed.weights.min(), 0.0)
        best = posed("branch_and_bound").solve()
        self.assertLessEqual(posed("cia").solve(best).cost, best.cost)

    def test_refusals(self):
        problem = posed("branch_and_bound")
        short = posed("branch_and_bound", horizon={"steps": 5, "blocks": [1]}).solve()
        thrusters = solenoid.variant("other", system="thrusters", solver="cia")
        foreign = solenoid.Problem(thrusters).solve()
        for wrong, named in ((lambda: problem.plan([1]), "1 modes"), (lambda: problem.plan([9] * 4), "mode 9"),
                             (lambda: setattr(problem, "initial", [0.0] * 3), "initial: 3 numbers"),
                             (lambda: setattr(problem, "reference", np.zeros((39, 2))), "reference: 78 numbers"),
                             (lambda: problem.solve(short), "1 blocks"),
                             (lambda: problem.solve(foreign), "another model")):
            with self.assertRaisesRegex(solenoid.ConfigError, named):
                wrong()


if __name__ == "__main__":
    unittest.main()
