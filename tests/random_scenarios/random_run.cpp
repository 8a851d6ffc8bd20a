#include "random_scenarios/random_run.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "grapnel/describe/contract.hpp"
#include "grapnel/result/result_documents.hpp"
#include "scenario/scenario_files.hpp"
#include "support/schema_check.hpp"

namespace grapnel::testing {
namespace {

std::string arguments;  // of the command line, in RapidCheck's syntax

// Call before RapidCheck reads its parameters: its default is a different seed each time. The last of equal keys
// applies.
void set_parameters(int cases) {
  const char* seed = getenv("GRAPNEL_TEST_SEED");
  const char* given = getenv("RC_PARAMS");
  const std::string parameters = std::string("seed=") + (seed != nullptr ? seed : "20240711") +
                                 " max_success=" + std::to_string(cases) + " " + (given != nullptr ? given : "") +
                                 arguments;
  setenv("RC_PARAMS", parameters.c_str(), 1);
  std::printf("RC_PARAMS=\"%s\"\n", parameters.c_str());
  std::fflush(stdout);
}

// --seed N and --cases N.
bool take_arguments(int argc, char** argv) {
  for (int i = 1; i < argc; i += 2) {
    const std::string key = argv[i], value = i + 1 < argc ? argv[i + 1] : "";
    const bool number = !value.empty() && value.find_first_not_of("0123456789") == std::string::npos;
    if ((key != "--seed" && key != "--cases") || !number) {
      std::fprintf(stderr, "usage: %s [--seed N] [--cases N] [--gtest_...]\n", argv[0]);
      return false;
    }
    arguments += (key == "--seed" ? " seed=" : " max_success=") + value;
  }
  return true;
}

}  // namespace

bool passes_on_random(const std::string& property, const rc::Gen<ScenarioText>& generator, int cases,
                      const std::function<void(const std::filesystem::path&)>& check) {
  set_parameters(cases);
  const grapnel::test::TemporaryFolder folder;
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> first_failure;
  std::string failing;
  return rc::check(property, [&] {
    const ScenarioText scenario = *generator;
    // End of shrinking: other cases pass from here on; the last failing case still fails.
    const bool enough = first_failure && Clock::now() - *first_failure > std::chrono::minutes(1);
    if (enough && scenario.yaml != failing) return;
    try {
      check(folder.write("random.yaml", scenario.yaml));
    } catch (...) {
      if (!first_failure) first_failure = Clock::now();
      failing = scenario.yaml;
      throw;
    }
  });
}

void require_finite(const CaptureResult& result) {
  for (const Series& series : result.series.series) {
    if (series.path.starts_with("joints/reference_")) continue;  // NaN for joints without a reference
    // NaN for open grasps and grasps without a loop, for joint reactions at impacts without duration, for couplings of
    // prescribed joints, and for contact points of bodies that are apart.
    const bool may_be_absent = series.path.starts_with("loops/") || series.path.starts_with("couplings/") ||
                               (series.path.starts_with("contacts/") && series.path.ends_with("/point")) ||
                               series.path.ends_with("/force") || series.path.ends_with("/moment") ||
                               series.path.starts_with("joints/reaction_");
    for (const double value : series.data) {
      if (std::isinf(value) || (std::isnan(value) && !may_be_absent)) RC_FAIL("not finite: series " + series.path);
    }
  }
  // Non-finite numbers become null in the summary; so do values that do not apply.
  const std::string summary = summary_json(result, "test");
  for (std::size_t at = 0; (at = summary.find(": null", at)) != std::string::npos; ++at) {
    const std::string line = summary.substr(summary.rfind('\n', at) + 1, 80);
    const auto is = [&](const char* key) { return line.find(key) < 12; };
    // Not checked; not rated; without a breakaway effort or torque constant; control that is not unstable; an immovable
    // end-effector; grasps of a run that failed before.
    const bool ended = result.status != CaptureStatus::completed;
    const bool unevaluated =
        is("\"pass\"") || is("\"rating\"") || is("\"margin\"") || is("\"friction_share\"") || is("\"copper_loss\"") ||
        is("\"electrical_energy\"") || is("\"since\"") || is("\"robot_effective_mass\"") ||
        (ended && (is("\"distance\"") || is("\"angle\"") || is("\"velocity\"") || is("\"angular_velocity\"")));
    if (!unevaluated) RC_FAIL("not finite: summary " + line);
  }
  static const test::SchemaCheck schema(json_schema(type_of<Summary>(), "summary"));
  for (const std::string& fault : schema.faults_of(nlohmann::json::parse(summary)))
    RC_FAIL("the summary is not as its schema says: " + fault);
}

void require_same(const CaptureResult& a, const CaptureResult& b) {
  RC_ASSERT(summary_json(a, "test") == summary_json(b, "test"));
  RC_ASSERT(a.series.series.size() == b.series.series.size());
  for (std::size_t i = 0; i < a.series.series.size(); ++i) {
    const auto &x = a.series.series[i].data, &y = b.series.series[i].data;
    RC_ASSERT(x.size() == y.size());
    if (!x.empty() && std::memcmp(x.data(), y.data(), x.size() * sizeof(double)) != 0) {
      RC_FAIL("another run gives other bits: series " + a.series.series[i].path);
    }
  }
}

}  // namespace grapnel::testing

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  return grapnel::testing::take_arguments(argc, argv) ? RUN_ALL_TESTS() : 2;
}
