// The API for programs: what the examples do not show.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "grapnel/api/grapnel.hpp"
#include "grapnel/result/atomic_file.hpp"

namespace grapnel {
namespace api_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const fs::path kSource = GRAPNEL_SOURCE_DIR;
const fs::path kScenario = kSource / "scenarios/own-controller.yaml";

TEST(Api, SavedScenariosReadBack) {
  const ScratchFolder folder;
  const std::vector<Override> changes = {{"targets[0].mass", "12.5"}, {"robot.base.mass", "150"}};
  save_scenario(kScenario, changes, folder.path() / "changed.yaml");
  const CaptureProblem problem = load_scenario(folder.path() / "changed.yaml");
  EXPECT_EQ(problem.targets[0].mass, 12.5);
  EXPECT_EQ(problem.robot.bodies[0].mass, 150);
  EXPECT_EQ(problem.approach->duration, load_scenario(kScenario).approach->duration);
  const std::vector<Override> unknown = {{"targets[0].masss", "1"}};
  EXPECT_THAT([&] { save_scenario(kScenario, unknown, folder.path() / "wrong.yaml"); },
              ThrowsMessage<InputError>(HasSubstr("masss")));
  EXPECT_FALSE(fs::exists(folder.path() / "wrong.yaml"));
}

TEST(Api, AStoppedRunKeepsItsResults) {
  std::stop_source stop;
  const auto stop_in_approach = [&](const std::string& phase, double time, double) {
    if (phase == "approach" && time > 5) stop.request_stop();
  };
  const CaptureResult result =
      simulate_capture(load_scenario(kScenario), until_stopped(stop.get_token(), stop_in_approach));
  EXPECT_EQ(result.status, CaptureStatus::failed);
  EXPECT_THAT(result.failure, HasSubstr("stopped"));
  EXPECT_TRUE(result.approach_start.has_value());
  EXPECT_THAT(summary_json(result), HasSubstr(version()));
}

CaptureProblem controlled(std::function<ControllerUpdate()> make) {
  CaptureProblem problem = load_scenario(kScenario);
  set_controller(problem, std::move(make), "mine");
  problem.post_impact->duration = 1;
  return problem;
}

TEST(Api, ExceptionsOfControllersEndTheRun) {
  const CaptureResult result = simulate_capture(controlled([] {
    return [](const ControllerInput& in, const ControllerModel&, ControllerOutput&) {
      if (in.time > 20.5) throw std::runtime_error("half a second is enough");
    };
  }));
  EXPECT_EQ(result.status, CaptureStatus::failed);
  EXPECT_THAT(result.failure, HasSubstr("the controller 'mine'"));
  EXPECT_THAT(result.failure, HasSubstr("half a second is enough"));
}

TEST(Api, ControllersQueryTheModel) {
  const CaptureResult result = simulate_capture(controlled([] {
    return [](const ControllerInput& in, const ControllerModel& model, ControllerOutput& out) {
      const Eigen::MatrixXd M = model.mass_matrix(), J = model.generalized_jacobian("tip-1");
      if (M.rows() != model.velocities() || !M.isApprox(M.transpose(), 1e-12)) throw std::runtime_error("M");
      if (J.cols() != model.velocities() - 6 || model.bias().size() != M.rows()) throw std::runtime_error("J or c");
      if (norm(model.momentum().linear) > 1e-8) throw std::runtime_error("p");
      for (int j = 0; j < in.joints; ++j) out.effort[j] = -in.rate[j];
    };
  }));
  EXPECT_EQ(result.status, CaptureStatus::completed) << result.failure;
  const CaptureResult unknown = simulate_capture(controlled([] {
    return [](const ControllerInput&, const ControllerModel& model, ControllerOutput&) {
      static_cast<void>(model.generalized_jacobian("tip-9"));
    };
  }));
  EXPECT_THAT(unknown.failure, HasSubstr("the generalized Jacobian of 'tip-9'"));
}

bool same_number(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

TEST(Api, CampaignsInMemoryAndInAFolderHaveTheSameRows) {
  const ScratchFolder folder;
  const fs::path file = kSource / "examples/cpp/campaign.yaml";
  const CampaignOutcome one = simulate_campaign(file, CampaignRun{.threads = 1});
  const CampaignOutcome two = simulate_campaign(file, CampaignRun{.threads = 2});
  ASSERT_EQ(one.cases.size(), 500);
  std::uint64_t successes = 0;
  for (std::size_t k = 0; k < one.cases.size(); ++k) {
    EXPECT_EQ(one.cases[k].index, k);
    EXPECT_EQ(one.cases[k].inputs.size(), one.inputs.size());
    ASSERT_EQ(one.cases[k].values.size(), one.columns.size());
    EXPECT_TRUE(std::ranges::equal(one.cases[k].values, two.cases[k].values, same_number)) << k;
    successes += one.cases[k].success ? 1 : 0;
  }
  EXPECT_EQ(one.summary.successes, successes);

  // Stopped immediately, then continued.
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(simulate_campaign(file, folder.path(), CampaignRun{.stop = stop.get_token()}).stopped);
  EXPECT_FALSE(fs::exists(folder.path() / "campaign.json"));
  const CampaignSummary summary = simulate_campaign(file, folder.path());
  EXPECT_FALSE(summary.stopped);
  EXPECT_EQ(summary.successes, successes);
  for (const char* name : {"table.h5", "table.csv", "campaign.json"}) EXPECT_TRUE(fs::exists(folder.path() / name));
  EXPECT_EQ(fs::exists(folder.path() / "report.html"), has_reports());
}

}  // namespace api_test
}  // namespace grapnel
