#pragma once

/// @file
/// Whole runs of scenarios that a test writes as text.

#include <gtest/gtest.h>

#include <string>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/verdicts.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {

/// The result of the scenario with this content.
inline CaptureResult run(const std::string& text) {
  const test::TemporaryFolder folder;
  return simulate_capture(load_scenario(folder.write("scenario.yaml", text)));
}

/// Expects a completed run whose ledger passes.
inline void expect_sound(const CaptureResult& r) {
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass()) << failure_text(*r.ledger.worst_failure());
}

}  // namespace grapnel::testing
