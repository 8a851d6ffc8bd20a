#pragma once

/// @file
/// What is kept of one case.

#include <cstdint>
#include <string>
#include <vector>

#include "grapnel/study/run_case.hpp"

namespace grapnel {

struct CampaignRow {
  std::uint64_t index = 0;  // k
  CaseStatus status = CaseStatus::failed;
  bool success = false;        // ok, and all criteria hold
  std::string reason;          // one line; empty if ok
  std::vector<double> inputs;  // as drawn
  std::vector<double> values;  // per column; NaN where there is nothing
};

}  // namespace grapnel
