#pragma once

/// @file
/// Whole runs of scenarios that a test writes as text.

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/verdicts.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {

/// The result of the scenario with this content.
inline CaptureResult run(const std::string& text) {
  const test::TemporaryFolder folder;
  return simulate_capture(load_scenario(folder.write("scenario.yaml", text)));
}

/// The keys `robot` and `initial` of a base with an arm, a ball of 0.1 m that slides along x, whose end-effector `tip`
/// is on its surface. `base_keys`, `tip_keys`: further keys of the base and of the end-effector.
inline std::string sliding_arm(const std::string& base_keys = "", const std::string& tip_keys = "") {
  return "robot:\n"
         "  name: r\n"
         "  base: {name: base, mass: 100, inertia: [10, 10, 10]" +
         base_keys +
         "}\n"
         "  links:\n"
         "    - name: arm\n"
         "      parent: base\n"
         "      joint: {name: slide, type: prismatic, axis: [1, 0, 0], origin: {position: [0.5, 0, 0]}}\n"
         "      mass: 5\n"
         "      inertia: [0.1, 0.1, 0.1]\n"
         "      geometry: {shape: sphere, radius: 0.1, position: [0.2, 0, 0]}\n"
         "  end_effectors: [{name: tip, link: arm, position: [0.3, 0, 0]" +
         tip_keys +
         "}]\n"
         "initial: {joints: [0]}\n";
}

/// The report of a pair of bodies that may touch.
inline const ContactPairReport& pair_of(const CaptureResult& r, const std::string& a, const std::string& b) {
  for (const ContactPairReport& one : r.contacts) {
    if ((one.body_a == a && one.body_b == b) || (one.body_a == b && one.body_b == a)) return one;
  }
  throw std::out_of_range(a + ", " + b);
}

/// Expects a completed run whose ledger passes.
inline void expect_sound(const CaptureResult& r) {
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass()) << failure_text(*r.ledger.worst_failure());
}

}  // namespace grapnel::testing
