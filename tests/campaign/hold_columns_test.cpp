// Columns of grasps with limits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "campaign/study_case.hpp"
#include "grapnel/campaign/column.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {
namespace hold_columns_test {

StudyCase with_limits() {
  const test::Folder folder;
  StudyCase point;
  point.problem = load_scenario(folder.write("limits.yaml", test::impact_at_once()));
  point.problem.grasps[0].holds = GraspLimits{100, 20};
  return point;
}

std::vector<std::string> names(const StudyCase& point) {
  std::vector<std::string> all;
  for (const Column& column : standard_columns(point.problem, true)) all.push_back(column.name);
  return all;
}

double value(const StudyCase& point, const CaptureResult& r, const std::string& name) {
  for (const Column& column : standard_columns(point.problem, true)) {
    if (column.name == name) return column.value(point, r);
  }
  throw std::runtime_error("no column " + name);
}

TEST(HoldColumns, LoadAndLosses) {
  const StudyCase point = with_limits();
  const std::string grasp = "grasps/" + point.problem.grasps[0].end_effector + "/";
  CaptureResult r;
  r.status = CaptureStatus::completed;
  GraspOutcome outcome;
  outcome.end_effector = point.problem.grasps[0].end_effector;
  outcome.largest_load = 0.75;
  r.grasps = {outcome};
  EXPECT_EQ(value(point, r, grasp + "load_used"), 0.75);
  EXPECT_TRUE(std::isnan(value(point, r, grasp + "lost")));
  EXPECT_EQ(value(point, r, grasp + "losses"), 0);
  r.losses = {{3, outcome.end_effector, "box", 90, 10, 1, false}, {5, outcome.end_effector, "box", 90, 10, 1, true}};
  EXPECT_EQ(value(point, r, grasp + "lost"), 3);
  EXPECT_EQ(value(point, r, grasp + "losses"), 2);
}

TEST(HoldColumns, SumsOfSlips) {
  StudyCase point = with_limits();
  const std::string effector = point.problem.grasps[0].end_effector, grasp = "grasps/" + effector + "/";
  EXPECT_THAT(names(point), ::testing::Not(::testing::Contains(grasp + "slips")));
  point.problem.grasps[0].holds->beyond = GraspLimits::Beyond::slips;
  CaptureResult r;
  r.status = CaptureStatus::completed;
  EXPECT_EQ(value(point, r, grasp + "slips"), 0);
  EXPECT_TRUE(std::isnan(value(point, r, grasp + "slip_time")));
  r.slips = {{3, effector, "box", 90, 10, SlipEnd::sticks, 4, 0.25, 1, 8},
             {5, "other", "box", 90, 10, SlipEnd::sticks, 6, 32, 32, 32},
             {7, effector, "box", 90, 10, SlipEnd::slips, 8, 0.5, 2, 16}};
  EXPECT_EQ(value(point, r, grasp + "slips"), 2);
  EXPECT_EQ(value(point, r, grasp + "slip_time"), 3);
  EXPECT_EQ(value(point, r, grasp + "slip_distance"), 0.75);
  EXPECT_EQ(value(point, r, grasp + "slip_angle"), 3);
  EXPECT_EQ(value(point, r, grasp + "slip_energy"), 24);
}

TEST(HoldColumns, OnlyGraspsWithLimitsHaveThem) {
  StudyCase point = with_limits();
  const std::string other = "grasps/" + point.problem.grasps[1].end_effector + "/load_used";
  EXPECT_THAT(names(point), ::testing::Not(::testing::Contains(other)));
  point.problem.grasps[1].holds = GraspLimits{};
  EXPECT_THAT(names(point), ::testing::Contains(other));
}

}  // namespace hold_columns_test
}  // namespace grapnel
