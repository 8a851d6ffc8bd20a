// Columns of contacts between shapes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "campaign/study_case.hpp"
#include "grapnel/campaign/column.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {
namespace contact_columns_test {

using ::testing::Contains;
using ::testing::Each;
using ::testing::Not;
using ::testing::StartsWith;

constexpr const char* kText =
    "schema: grapnel-scenario/1\n"
    "name: touching\n"
    "robot: {name: r, base: {name: base, mass: 100, inertia: [10, 10, 10], geometry: {shape: sphere, radius: 0.2}}}\n"
    "targets: [{name: ball, mass: 20, inertia: [2, 2, 2], geometry: {shape: sphere, radius: 0.2}, state: {position: "
    "[2, 0, 0]}}]\n"
    "motion: {duration: 1}\n";

StudyCase touching() {
  const test::Folder folder;
  StudyCase point;
  point.problem = load_scenario(folder.write("touching.yaml", kText));
  point.problem.obstacles = {{"wall", Posed::identity(), {}}};
  MaterialSetup rubber;
  rubber.name = "rubber";
  rubber.surface.stiffness = 1e4;
  point.problem.materials = {rubber};
  ContactPairsSetup pairs;
  pairs.materials = {"rubber"};
  pairs.pairs = {{"base", BodyName::of_target(0)}, {BodyName::of_target(0), BodyName::of_obstacle(0)}};
  point.problem.contacts = {pairs};
  return point;
}

CaptureResult result_of_touching() {
  CaptureResult r;
  r.status = CaptureStatus::completed;
  r.contacts.resize(2);
  ContactPairReport &first = r.contacts[0], &second = r.contacts[1];
  first.body_a = "base", first.body_b = "ball", second.body_a = "ball", second.body_b = "wall";
  first.touches = 2, first.first_time = 3, first.duration = 0.5, first.impulse = 4, first.peak_force = 100;
  first.largest_depth = 1e-4, first.slip_distance = 0.25, first.damping_loss = 0.125, first.friction_loss = 0.0625;
  first.touches_at_end = true;
  second.touches = 1, second.first_time = 2, second.impulse = 16, second.peak_force = 30;
  second.largest_depth = 3e-4, second.damping_loss = 1;
  return r;
}

std::vector<std::string> names(const std::vector<Column>& columns) {
  std::vector<std::string> all;
  for (const Column& column : columns) all.push_back(column.name);
  return all;
}

const Column& named(const std::vector<Column>& columns, const std::string& name) {
  for (const Column& column : columns) {
    if (column.name == name) return column;
  }
  throw std::runtime_error("no column " + name);
}

TEST(ContactColumns, HardPairsHaveTheirImpacts) {
  StudyCase point = touching();
  EXPECT_THAT(names(standard_columns(point.problem, true)), Not(Contains("contacts/impacts")));
  point.problem.materials[0].surface.hard = true;
  point.problem.materials[0].restitution = 0.5;
  CaptureResult r = result_of_touching();
  r.contacts[0].hard = HardContactReport{5, 0.25, 4, 3.5, 0.5, 0.25, {}};
  r.contacts[1].hard = HardContactReport{2, 0.5, 4, 1, 0.125, 0, {}};
  const std::vector<Column> columns = standard_columns(point.problem, true);
  const auto value = [&](const std::string& name) { return named(columns, name).value(point, r); };
  EXPECT_EQ(value("contacts/impacts"), 7);
  EXPECT_EQ(value("contacts/base/ball/hard/impacts"), 5);
  EXPECT_EQ(value("contacts/base/ball/hard/last_time"), 4);
  EXPECT_EQ(value("contacts/ball/wall/hard/fastest_impact"), 0.5);
  EXPECT_TRUE(std::isnan(value("contacts/base/ball/hard/persistent_since")));
  EXPECT_EQ(value("contacts/loss"), 0.125 + 0.0625 + 1 + 0.875);
}

TEST(ContactColumns, PairsAndTotals) {
  const StudyCase point = touching();
  const CaptureResult r = result_of_touching();
  const std::vector<Column> columns = standard_columns(point.problem, true);
  const auto value = [&](const std::string& name) { return named(columns, name).value(point, r); };
  EXPECT_EQ(value("contacts/base/ball/touches"), 2);
  EXPECT_EQ(value("contacts/base/ball/touches_at_end"), 1);
  EXPECT_EQ(value("contacts/base/ball/first_time"), 3);
  EXPECT_EQ(value("contacts/base/ball/duration"), 0.5);
  EXPECT_EQ(value("contacts/base/ball/impulse"), 4);
  EXPECT_EQ(value("contacts/base/ball/peak_force"), 100);
  EXPECT_EQ(value("contacts/base/ball/largest_depth"), 1e-4);
  EXPECT_EQ(value("contacts/base/ball/slip_distance"), 0.25);
  EXPECT_EQ(value("contacts/base/ball/damping_loss"), 0.125);
  EXPECT_EQ(value("contacts/base/ball/friction_loss"), 0.0625);
  EXPECT_EQ(value("contacts/ball/wall/peak_force"), 30);
  EXPECT_EQ(value("contacts/ball/wall/touches_at_end"), 0);
  EXPECT_EQ(value("contacts/touches"), 3);
  EXPECT_EQ(value("contacts/pairs"), 2);
  EXPECT_EQ(value("contacts/first_time"), 2);
  EXPECT_EQ(value("contacts/impulse"), 20);
  EXPECT_EQ(value("contacts/peak_force"), 100);
  EXPECT_EQ(value("contacts/largest_depth"), 3e-4);
  EXPECT_EQ(value("contacts/loss"), 1.1875);
  EXPECT_EQ(value("contacts/beyond_model"), 0);
  EXPECT_EQ(named(columns, "contacts/ball/wall/peak_force").unit, "N");
  EXPECT_EQ(named(columns, "contacts/ball/wall/touches_at_end").unit, "1");
  // Reports of contacts do not require the loads of every step.
  EXPECT_EQ(detail_of(contact_columns(point.problem)), CaptureDetail::columns);
}

TEST(ContactColumns, MissingValuesAreNotNumbers) {
  const StudyCase point = touching();
  const std::vector<Column> columns = contact_columns(point.problem);
  ASSERT_FALSE(columns.empty());
  for (const Column& column : columns) EXPECT_TRUE(std::isnan(column.value(point, {}))) << column.name;
  CaptureResult apart = result_of_touching();
  for (ContactPairReport& pair : apart.contacts) pair.touches = 0, pair.first_time.reset();
  EXPECT_TRUE(std::isnan(named(columns, "contacts/base/ball/first_time").value(point, apart)));
  EXPECT_TRUE(std::isnan(named(columns, "contacts/first_time").value(point, apart)));
  EXPECT_EQ(named(columns, "contacts/touches").value(point, apart), 0);
}

TEST(ContactColumns, OnlyRunsOfProblemsWithContactsHaveThem) {
  StudyCase point = touching();
  EXPECT_THAT(names(standard_columns(point.problem, false)), Each(Not(StartsWith("contacts/"))));
  EXPECT_THAT(names(offered_columns(point.problem, false)), Each(Not(StartsWith("contacts/"))));
  point.problem.contacts.clear();
  EXPECT_THAT(names(offered_columns(point.problem, true)), Each(Not(StartsWith("contacts/"))));
}

TEST(ContactColumns, ManyPairsAreStoredOnRequest) {
  StudyCase point = touching();
  for (int i = 0; i < 10; ++i) {
    point.problem.obstacles.push_back({"wall-" + std::to_string(i), Posed::identity(), {}});
    point.problem.contacts[0].pairs.emplace_back("base", BodyName::of_obstacle(i + 1));
  }
  const std::vector<std::string> standard = names(standard_columns(point.problem, true));
  EXPECT_THAT(standard, Contains("contacts/peak_force"));
  EXPECT_THAT(standard, Not(Contains("contacts/base/ball/peak_force")));
  EXPECT_THAT(names(offered_columns(point.problem, true)), Contains("contacts/base/ball/peak_force"));
}

TEST(StageColumns, AreZeroOrOne) {
  StudyCase point = touching();
  StagesSetup& setup = point.problem.stages.emplace_back();
  setup.target = "ball", setup.speed = 1e-3, setup.rate = 1e-3, setup.time = 1;
  CaptureResult r = result_of_touching();
  StagesReport& stages = r.stages.emplace_back();
  stages.target = "ball", stages.contact_time = 3, stages.settled_time = 5, stages.grip_force = 7;
  stages.failure = StagesReport::Failure::slipped;
  const std::vector<Column> columns = standard_columns(point.problem, true);
  const auto value = [&](const std::string& key) { return named(columns, "stages/ball/" + key).value(point, r); };
  EXPECT_EQ(value("contact"), 1);
  EXPECT_EQ(value("closed"), 0);
  EXPECT_EQ(value("caged"), 0);
  EXPECT_EQ(value("settled"), 1);
  EXPECT_EQ(value("latched"), 0);
  EXPECT_EQ(value("slipped"), 1);
  EXPECT_EQ(value("lost"), 0);
  EXPECT_EQ(value("settled_time"), 5);
  EXPECT_EQ(value("grip_force"), 7);
  EXPECT_TRUE(std::isnan(value("latched_time")));
  r.stages.clear();  // the run failed before
  EXPECT_TRUE(std::isnan(value("contact")));
}

}  // namespace contact_columns_test
}  // namespace grapnel
