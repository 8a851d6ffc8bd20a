#pragma once

/// @file
/// Runs a check on random scenarios. The first of these that is set determines the parameters (default: fixed):
///
///   random_closed_loop_test --seed 42 --cases 100     the command line
///   RC_PARAMS="seed=42 max_success=100" ...           else RapidCheck's own parameters
///   GRAPNEL_TEST_SEED=42 ...                          else the seed
///
/// The parameters are printed first. A failing case is shrunk for at most a minute and printed as a scenario file,
/// which can be saved for `grapnel run`. Thread safety: one run at a time.

#include <rapidcheck.h>

#include <filesystem>
#include <functional>
#include <string>

#include "grapnel/result/capture_result.hpp"
#include "random_scenarios/scenario_text.hpp"

namespace grapnel::testing {

/// Whether `check`, which throws or calls RC_FAIL for an error in a scenario file, passes on `cases` random ones.
bool passes_on_random(const std::string& property, const rc::Gen<ScenarioText>& generator, int cases,
                      const std::function<void(const std::filesystem::path&)>& check);

/// Calls RC_FAIL for non-finite values in a series or the summary, except where NaN marks absent values (a joint
/// without a reference, an open grasp, a grasp without a loop, a coupling of prescribed joints, bodies that are apart).
void require_finite(const CaptureResult& result);
/// Calls RC_FAIL if two results differ in a bit of their series or a character of their summaries.
void require_same(const CaptureResult& a, const CaptureResult& b);

}  // namespace grapnel::testing
