// Columns of loads and margins where a load is zero.
#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/study/column.hpp"
#include "grapnel/study/quantity.hpp"
#include "study/study_case.hpp"

namespace grapnel {
namespace load_columns_test {

// An end-effector beside a target that approaches, rests, or recedes; `speed` along the normal of the contact [m/s].
StudyCase touching(const char* speed) {
  const std::string text =
      "schema: grapnel-scenario/1\n"
      "name: touching\n"
      "robot: {name: r, base: {name: base, mass: 100, inertia: [10, 10, 10]}, links: [{name: a, parent: base, joint: "
      "{name: ja, type: revolute, axis: [0, 0, 1], origin: {position: [0.5, 0, 0]}, rating: {moment: 20, "
      "driving_impulse: 3}}, mass: 5, com: [0.5, 0, 0], inertia: [0.01, 0.5, 0.5]}], end_effectors: [{name: e, link: "
      "a, position: [1, 0, 0]}]}\n"
      "initial: {joints: {ja: 0}}\n"
      "targets: [{name: t, mass: 20, inertia: [2, 2, 2], state: {position: [2, 0, 0], velocity: [" +
      std::string(speed) +
      ", 0, 0]}, grasp_points: [{name: g, position: [-0.5, 0, 0], normal: [-1, 0, 0]}]}]\n"
      "grasps: [{end_effector: e, target: t, point: g, model: contact}]\n"
      "impact: {law: restitution, restitution: 0.5}\n"
      "post_impact: {duration: 1}\n"
      "clearance: {enabled: false}\n";
  const test::Folder folder;
  StudyCase point;
  point.problem = load_scenario(folder.write("touching.yaml", text));
  point.inward_normals = inward_normals(point.problem);
  return point;
}

double value_of(const std::string& name, const StudyCase& point, const CaptureResult& result) {
  for (const Column& column : load_columns(point.problem, true)) {
    if (column.name == name) return column.value(point, result);
  }
  ADD_FAILURE() << name;
  return NAN;
}

TEST(LoadColumns, ZeroIsANumber) {
  for (const char* speed : {"-0.1", "0", "0.1"}) {
    const StudyCase point = touching(speed);
    const CaptureResult r = simulate_capture(point.problem, {}, CaptureDetail::columns_and_loads);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    for (const Column& column : load_columns(point.problem, true)) {
      const double value = column.value(point, r);
      if (column.name.starts_with("load_times/")) continue;
      EXPECT_TRUE(std::isfinite(value)) << column.name << " at " << speed;
    }
    const double force = value_of("loads/e/force", point, r);
    if (speed[0] == '-') {
      EXPECT_GT(force, 100);
    }
    if (speed[0] != '-') {
      EXPECT_EQ(force, 0);
    }
    if (speed[0] != '-') {
      EXPECT_TRUE(std::isnan(value_of("load_times/e/force", point, r)));
    }
  }
}

TEST(LoadColumns, MarginsWithoutLoadAreOne) {
  const StudyCase point = touching("0.1");
  CaptureResult nothing;
  nothing.status = CaptureStatus::completed;
  EXPECT_EQ(value_of("margins/ja/moment", point, nothing), 1);
  EXPECT_EQ(value_of("worst_margin", point, nothing), 1);
  EXPECT_EQ(value_of("loads/ja/driving", point, nothing), 0);
  PeakLoad none;
  none.rating = 0;
  EXPECT_EQ(none.margin(), 1);
  nothing.status = CaptureStatus::failed;
  EXPECT_TRUE(std::isnan(value_of("loads/ja/driving", point, nothing)));
  EXPECT_TRUE(std::isnan(value_of("margins/ja/moment", point, nothing)));
}

}  // namespace load_columns_test
}  // namespace grapnel
