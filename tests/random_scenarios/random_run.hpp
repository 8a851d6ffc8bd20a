#pragma once

/// @file
/// Runs a check on random scenarios from a seed that comes from outside:
///
///   random_closed_loop_test --seed 42 --cases 100     the command line
///   RC_PARAMS="seed=42 max_success=100" ...           else RapidCheck's own parameters
///   GRAPNEL_TEST_SEED=42 ...                          else the seed; what none of these says is always the same
///
/// The parameters in force are printed first. A failing case is shrunk for at most a minute and printed as a scenario
/// file, to be saved and given to `grapnel run`. Thread safety: one run at a time.

#include <rapidcheck.h>

#include <filesystem>
#include <functional>
#include <string>

#include "grapnel/result/capture_result.hpp"
#include "random_scenarios/scenario_text.hpp"

namespace grapnel::testing {

/// Whether `check`, which throws or RC_FAILs on what is wrong with a scenario file, passes on so many random ones.
bool passes_on_random(const std::string& property, const rc::Gen<ScenarioText>& generator, int cases,
                      const std::function<void(const std::filesystem::path&)>& check);

/// RC_FAILs where a series or the summary is not finite, except where NaN says that there is nothing (a joint that
/// follows no reference, a grasp that does not hold or closes no loop).
void require_finite(const CaptureResult& result);
/// RC_FAILs where two results differ in a bit of their series or a character of their summaries.
void require_same(const CaptureResult& a, const CaptureResult& b);

}  // namespace grapnel::testing
