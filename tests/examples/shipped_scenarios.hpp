#pragma once

/// @file
/// The shipped scenarios in tests: their files, their grasp points and the schema of their results.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "grapnel/describe/contract.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/schema_check.hpp"

namespace grapnel::testing::examples_test {

inline const std::filesystem::path kScenarios = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "scenarios";

// Scenarios with a plan, torque tracking, a capture and post-impact motion.
inline const std::vector<std::string> kPlanned{
    "dual-arm-tumbling-targets",  "dual-arm-envelope-capture", "heavy-satellite-flat-spin",
    "heavy-satellite-detumble",   "heavy-satellite-braking",   "six-arm-servicer",
    "dual-arm-satellite-handles", "triple-arm-satellite",      "second-grip-later",
    "dual-arm-detumbling",        "tumbling-window",           "quiet-approach"};

inline CaptureProblem load(const std::string& name, const std::vector<Override>& overrides = {}) {
  return load_scenario(kScenarios / (name + ".yaml"), overrides);
}

inline const TargetSetup& target_in(const CaptureProblem& p, const GraspSetup& grasp) {
  return *std::find_if(p.targets.begin(), p.targets.end(), [&](const auto& t) { return t.name == grasp.target; });
}
inline const GraspPoint& point_of(const CaptureProblem& p, const GraspSetup& grasp) {
  const auto& points = target_in(p, grasp).grasp_points;
  return *std::find_if(points.begin(), points.end(), [&](const auto& g) { return g.name == grasp.grasp_point; });
}

inline std::vector<std::string> schema_faults(const CaptureResult& result) {
  static const test::SchemaCheck schema(json_schema(type_of<Summary>(), "summary"));
  return schema.faults_of(nlohmann::json::parse(summary_json(result, "test")));
}

inline std::string name_of_test(const ::testing::TestParamInfo<std::string>& file) {
  std::string words;
  for (const char c : file.param) words += std::isalnum(c) ? c : '_';
  return words;
}

}  // namespace grapnel::testing::examples_test
