/// Momentum of runs whose joints follow commanded rates, with contacts between shapes.

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "capture/scenario_run.hpp"

namespace grapnel::testing {
namespace commanded_rates_test {

// A base with a planar arm of three joints.
std::string scene(const std::string& rest) {
  return "schema: grapnel-scenario/1\n"
         "name: commanded\n"
         "robot:\n"
         "  name: r\n"
         "  base: {name: base, mass: 60, com: [0.02, 0.01, 0], inertia: [10, 12, 11], geometry: {shape: box, size: "
         "[0.5, 0.5, 0.5]}}\n"
         "  links:\n"
         "    - {name: upper, parent: base, mass: 6, com: [0.4, 0, 0], inertia: [0.05, 0.4, 0.4], joint: {name: "
         "shoulder, type: revolute, axis: [0, 0, 1], origin: {position: [0.5, 0, 0]}}}\n"
         "    - {name: fore, parent: upper, mass: 5, com: [0.4, 0, 0], inertia: [0.05, 0.3, 0.3], joint: {name: elbow, "
         "type: revolute, axis: [0, 0, 1], origin: {position: [0.8, 0, 0]}}}\n"
         "    - {name: hand, parent: fore, mass: 2, com: [0.1, 0, 0], inertia: [0.05, 0.05, 0.05], joint: {name: "
         "wrist, "
         "type: revolute, axis: [0, 0, 1], origin: {position: [0.8, 0, 0]}}, geometry: {shape: sphere, radius: 0.1, "
         "position: [0.1, 0, 0]}}\n"
         "  end_effectors: [{name: tip, link: hand, position: [0.3, 0, 0], approach_axis: [1, 0, 0], envelope: "
         "{position: 1e-3}}]\n" +
         rest + "materials: [{name: pad, stiffness: 2e4, restitution: 0.5, friction: 0.3}]\n";
}
// A spinning box that the arm does not reach.
const char* const kFarBox =
    "targets:\n"
    "  - {name: box, mass: 20, inertia: [1, 1.2, 0.9], geometry: {shape: box, size: [0.4, 0.4, 0.4]}, state: {at: "
    "start, position: [4, 3, 1], velocity: [0.01, 0.02, 0.01], angular_velocity: [0.05, -0.11, 0.18]}}\n";
const char* const kTouches = "contacts: {pairs: [[hand, box]], material: pad}\n";

double value_of(const CaptureResult& r, const std::string& row) {
  for (const LedgerEntry& entry : r.ledger.entries) {
    if (entry.name == row) return entry.value;
  }
  throw std::out_of_range(row);
}
void expect_momentum(const CaptureResult& r, double bound) {
  expect_sound(r);
  EXPECT_LT(value_of(r, "linear_momentum_drift"), bound);
  EXPECT_LT(value_of(r, "angular_momentum_drift"), bound);
}

// Positions and rates of the second piece differ by 5e-7 from the end of the first: the motion is continuous.
TEST(CommandedRates, PiecesOfRoundedCoefficientsKeepTheBalances) {
  const std::string pieces =
      "initial: {base: {angular_velocity: [0.02, 0.01, 0.03]}}\n"
      "approach:\n"
      "  pieces:\n"
      "    - {until: 2, series: [[0.1, 0.2, 0.05], [0.3, -0.1, 0.02], [0]]}\n"
      "    - {until: 4, series: [[0.9, 0.6000005, 0.05], [0.2, -0.02, 0], [0.0000005]]}\n"
      "motion: {duration: 1, joints: braked}\n";
  for (const std::string contacts : {kTouches, ""}) {
    SCOPED_TRACE(contacts.empty() ? "without contacts" : "with contacts");
    const CaptureResult r = run(scene(kFarBox + contacts + pieces));
    expect_momentum(r, 1e-12);  // measured 8e-15
    EXPECT_LT(value_of(r, "work_energy_residual"), 1e-11);
  }
}

// Nothing touches a spinning body: its momentum does not change, however long it spins.
TEST(CommandedRates, MomentumOfAFreeTargetDoesNotDriftBesideContacts) {
  const CaptureResult r =
      run(scene(kFarBox + std::string(kTouches) +
                "initial: {base: {angular_velocity: [0.02, 0.01, 0.03]}, joints: [0.1, -0.2, 0.3]}\n"
                "motion: {duration: 60, joints: braked}\n"));
  expect_momentum(r, 1e-12);
}

// A ball pushes the box during the final straight approach, whose rates follow those of the box.
TEST(CommandedRates, FollowAPushedTargetWithoutADriftOfMomentum) {
  const CaptureResult r = run(scene(
      "initial: {base: {angular_velocity: [0, 0, 0.01], velocity: [0, 0.005, 0]}, joints: [0.8, -1.4, 0.6]}\n"
      "targets:\n"
      "  - {name: box, mass: 20, inertia: [1, 1, 1], geometry: {shape: box, size: [0.4, 0.4, 0.4]}, state: {at: start, "
      "position: [2.1, 0, 0], angular_velocity: [0, 0, 0.02]}, grasp_points: [{name: face, position: [-0.2, 0, 0], "
      "approach_direction: [1, 0, 0]}]}\n"
      "  - {name: ball, mass: 20, inertia: [0.1, 0.1, 0.1], geometry: {shape: sphere, radius: 0.1}, state: {at: start, "
      "position: [2.8, 0.05, 0], velocity: [-0.03, 0, 0]}}\n"
      "contacts: {pairs: [[box, ball]], material: pad}\n"
      "grasps: [{end_effector: tip, target: box, point: face, orientation: free}]\n"
      "approach: {duration: 20, plan: {}, straight_in: {stand_off: 0.1, duration: 10}}\n"
      "impact: {}\n"
      "post_impact: {duration: 1, joints: braked}\n"));
  EXPECT_EQ(pair_of(r, "box", "ball").touches, 1);
  expect_momentum(r, 1e-12);
}

}  // namespace commanded_rates_test
}  // namespace grapnel::testing
