/// Impact results besides the impulses: loads against ratings, measures, sensitivities, and their entries in
/// summary.json.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "capture/impact_case.hpp"
#include "grapnel/result/result_documents.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace impact_figures_test {

using Law = ImpactSetup::Law;

// Ratings of all joints and end-effectors, comparable to the loads.
void rate(CaptureProblem& p) {
  for (const BodyDescription& b : p.robot.bodies) {
    if (b.joint.type != JointType::revolute) continue;
    p.robot.ratings.push_back({b.joint.name, {900, 500, 3, 2, 40, 0.2}});
  }
  for (EndEffectorSetup& e : p.robot.end_effectors) e.rating = {800, 300, 2, 1};
}

CaptureProblem rated(Law law, int index) {
  CaptureProblem p = rebound_case(law, 0.4, 0.3, index);
  for (GraspSetup& g : p.grasps) g.contact = law == Law::friction || law == Law::restitution;
  p.impact->joints = ImpactSetup::Joints::driven;  // for non-zero drive loads
  rate(p);
  return p;
}

// Scales all velocities before the impact by a factor.
CaptureProblem faster(CaptureProblem p, double factor) {
  p.V_WB = Twistd{factor * p.V_WB->angular, factor * p.V_WB->linear};
  for (double& rate : p.joint_rate) rate *= factor;
  for (TargetSetup& t : p.targets) t.V_WT = {factor * t.V_WT.angular, factor * t.V_WT.linear};
  return p;
}

double load_of(const ImpactReport& impact, const std::string& of, const std::string& quantity) {
  const double T = impact.duration;
  for (const JointImpulse& j : impact.joints) {
    if (j.joint != of) continue;
    if (quantity == "force") return norm(j.impulse) / T;
    if (quantity == "moment") return norm(j.angular_impulse) / T;
    if (quantity == "impulse") return norm(j.impulse);
    if (quantity == "angular_impulse") return norm(j.angular_impulse);
    if (quantity == "driving") return std::abs(j.along_axis) / T;
    if (quantity == "driving_impulse") return std::abs(j.along_axis);
  }
  for (const GraspImpulse& g : impact.grasps) {
    if (g.end_effector != of) continue;
    if (quantity == "force") return norm(g.impulse) / T;
    if (quantity == "moment") return norm(g.angular_impulse) / T;
    if (quantity == "impulse") return norm(g.impulse);
    if (quantity == "angular_impulse") return norm(g.angular_impulse);
  }
  return NAN;
}

class Margins : public ::testing::TestWithParam<Law> {};
INSTANTIATE_TEST_SUITE_P(Laws, Margins,
                         ::testing::Values(Law::plastic, Law::bilateral_restitution, Law::restitution, Law::friction));

TEST_P(Margins, RatingReachedAtSpeedLimit) {
  Worst reached("rating reached"), others("others");
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(seed_note(i));
    const CaptureProblem p = rated(GetParam(), i);
    const CaptureResult r = simulate_impact_only(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    ASSERT_EQ(r.impact()->margins.size(), 8u * 6 + 2 * 4);
    for (const LoadMargin& m : r.impact()->margins) EXPECT_DOUBLE_EQ(m.load, load_of(*r.impact(), m.of, m.quantity));
    ASSERT_EQ(r.impact()->speed_limits.size(), 2u);
    for (const SpeedLimit& limit : r.impact()->speed_limits) {
      const std::size_t arm = limit.end_effector == "hand0" ? 0 : 1;
      EXPECT_NEAR(limit.largest_speed, limit.factor * norm(r.impact()->grasps[arm].relative_velocity_before), 1e-14);
      const CaptureResult at = simulate_impact_only(faster(p, limit.factor));
      ASSERT_TRUE(at.impact());
      EXPECT_NEAR(norm(at.impact()->grasps[arm].relative_velocity_before), limit.largest_speed,
                  1e-13 * limit.largest_speed);
      const std::string own = std::to_string(arm);
      double worst = 0;
      for (const LoadMargin& m : at.impact()->margins) {
        if (m.of != "hand" + own && !m.of.starts_with("arm" + own)) continue;
        worst = std::max(worst, m.load / m.rating);
        if (m.of == limit.of && m.quantity == limit.quantity) {
          EXPECT_LT(reached.note(std::abs(m.load / m.rating - 1), i), 1e-10);
        }
      }
      EXPECT_LT(others.note(std::abs(worst - 1), i), 1e-10);  // measured 2e-15
    }
  }
}

TEST(Margins, CompliantImpactUsesPeaks) {
  CaptureProblem p = yielding_case(1e7, 1);
  rate(p);
  const CaptureResult r = simulate_impact_only(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  for (const LoadMargin& m : r.impact()->margins) {
    for (const GraspImpulse& g : r.impact()->grasps) {
      if (m.of == g.end_effector && m.quantity == "force") {
        EXPECT_EQ(m.load, g.profile->peak_force);
      }
    }
    for (const JointImpulse& j : r.impact()->joints) {
      if (m.of == j.joint && m.quantity == "force") {
        EXPECT_EQ(m.load, j.peak_force);
      }
      if (m.of == j.joint && m.quantity == "driving") {
        EXPECT_EQ(m.load, j.peak_driving);
      }
    }
  }
  EXPECT_EQ(r.impact()->speed_limits.size(), 2u);
}

TEST(Margins, UnlimitedWithoutLoadAndValidJson) {
  CaptureProblem p = contact_capture_case(1);
  p.robot.end_effectors[0].rating.moment = 5;
  p.grasps[0].model = GraspModel::point;  // transmits no moment
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.impact()->margins.size(), 1u);
  EXPECT_EQ(r.impact()->margins[0].load, 0);
  ASSERT_EQ(r.impact()->speed_limits.size(), 1u);
  EXPECT_TRUE(std::isinf(r.impact()->speed_limits[0].factor));
  EXPECT_EQ(r.impact()->speed_limits[0].of, "");
  const auto json = nlohmann::json::parse(summary_json(r, "test"));
  EXPECT_TRUE(json["impact"]["speed_limits"][0]["factor"].is_null());
}

// --- Measures ---

bool finite_or_null(const nlohmann::json& json) {
  if (json.is_number_float()) return std::isfinite(json.get<double>());
  if (!json.is_structured()) return true;
  for (const auto& item : json) {
    if (!finite_or_null(item)) return false;
  }
  return true;
}

TEST(Measures, InSummaryForEveryLaw) {
  for (Law law : {Law::plastic, Law::bilateral_restitution, Law::restitution, Law::friction, Law::compliant}) {
    CaptureProblem p = law == Law::compliant ? yielding_case(1e7, 2) : rated(law, 2);
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    expect_finite(r);
    const auto json = nlohmann::json::parse(summary_json(r, "test"));
    EXPECT_TRUE(finite_or_null(json));
    const auto& impact = json["impact"];
    EXPECT_EQ(impact.contains("measures"), law != Law::compliant);
    EXPECT_EQ(impact.contains("compliant"), law == Law::compliant);
    EXPECT_EQ(impact["sensitivities"].empty(), law != Law::plastic);
    EXPECT_EQ(impact.contains("hypothesis"), law == Law::restitution || law == Law::friction);
    EXPECT_EQ(impact["grasps"][0].contains("rebound"), law == Law::restitution || law == Law::friction);
    EXPECT_EQ(impact["grasps"][0].contains("profile"), law == Law::compliant);
    EXPECT_EQ(impact["joints_during"], law == Law::compliant ? "free" : "driven");
    EXPECT_EQ(impact["held_joints"].size(), law == Law::compliant ? 0u : 8u);
    if (law == Law::compliant) continue;
    ASSERT_EQ(impact["measures"]["end_effectors"].size(), 2u);
    EXPECT_EQ(impact["measures"]["end_effectors"][0]["inverse_inertia"].size(), 6u);
    EXPECT_TRUE(impact["measures"]["miss_of_system_com"].is_number());
  }
}

// For a single arm, the inverse inertia of the pair relates impulse and relative velocity.
TEST(Measures, ImpulseFollowsFromInverseInertia) {
  Worst off("W P + u");
  for (int i = 0; i < 4; ++i) {
    CaptureProblem p = contact_capture_case(i);
    p.grasps.pop_back(), p.targets.pop_back();
    const CaptureResult r = simulate_impact_only(p);
    const GraspImpulse& g = r.impact()->grasps[0];
    const EndEffectorMeasure& m = r.impact()->measures->end_effectors[0];
    double worst = 0;
    for (std::size_t row = 0; row < 6; ++row) {
      double sum = row < 3 ? g.relative_angular_velocity_before[static_cast<int>(row)]
                           : g.relative_velocity_before[static_cast<int>(row) - 3];
      for (int c = 0; c < 3; ++c) {
        const std::size_t at = 6 * row + static_cast<std::size_t>(c);
        sum += m.pair_inverse_inertia[at] * g.angular_impulse[c] + m.pair_inverse_inertia[at + 3] * g.impulse[c];
      }
      worst = std::max(worst, std::abs(sum));
    }
    EXPECT_LT(off.note(worst, i), 1e-12);  // measured 2e-15
    // The base response relates the impulse and the base's velocity change.
    const std::vector<double>& B = r.impact()->measures->base_response.at(0);
    for (std::size_t row = 0; row < 6; ++row) {
      double sum = row < 3 ? r.impact()->base_angular_velocity_change[static_cast<int>(row)]
                           : r.impact()->base_velocity_change[static_cast<int>(row) - 3];
      for (int c = 0; c < 3; ++c) {
        const std::size_t at = 6 * row + static_cast<std::size_t>(c);
        sum -= B[at] * g.angular_impulse[c] + B[at + 3] * g.impulse[c];
      }
      EXPECT_LT(std::abs(sum), 1e-13);
    }
  }
}

// Without relative motion there is no line of impulse and no miss distance.
TEST(Measures, NullWithoutImpulse) {
  CaptureProblem p = faster(contact_capture_case(1), 0);
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_EQ(norm(r.impact()->grasps[0].impulse), 0);
  const auto json = nlohmann::json::parse(summary_json(r, "test"));
  EXPECT_TRUE(finite_or_null(json));
  const auto& miss = json["impact"]["measures"]["miss_of_system_com"];
  EXPECT_TRUE(miss.is_null() || miss.is_number());
  std::printf("[ measured ] miss of no impulse: %s\n", miss.dump().c_str());
}

// Sensitivity to the target's mass, against finite differences of whole runs.
TEST(Sensitivities, PredictRunWithOtherMass) {
  CaptureProblem p = contact_capture_case(3);
  const CaptureResult r = simulate_impact_only(p);
  const ImpactSensitivity* mass = nullptr;
  for (const ImpactSensitivity& s : r.impact()->sensitivities) {
    if (s.parameter == "target mass" && s.target == "target0") mass = &s;
  }
  ASSERT_TRUE(mass);
  const double h = 1e-4 * p.targets[0].mass;
  const auto at = [&](double step) {
    CaptureProblem other = p;
    other.targets[0].mass += step;
    return simulate_impact_only(other);
  };
  const CaptureResult more = at(h), less = at(-h);
  for (std::size_t k = 0; k < 2; ++k) {
    const Vector3d slope = (0.5 / h) * (more.impact()->grasps[k].impulse - less.impact()->grasps[k].impulse);
    EXPECT_LT(norm(slope - mass->impulse[k]), 1e-7 * norm(slope));
  }
  const Vector3d base = (0.5 / h) * (more.impact()->base_velocity_change - less.impact()->base_velocity_change);
  EXPECT_LT(norm(base - mass->base_velocity_change), 1e-7 * norm(base));
}

}  // namespace impact_figures_test
}  // namespace grapnel::testing
