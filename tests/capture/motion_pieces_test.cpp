// Motion stated piece by piece: the same as the trajectories that it was made from, and followed exactly.
#include "grapnel/problem/capture_problem.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "capture/recorded.hpp"
#include "grapnel/approach/approach_plan.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace motion_pieces_test {

// Pieces of every kind; each begins where and how the one before ends, the thesis's profile from rest.
std::vector<JointTrajectory> of_all_kinds() {
  std::vector<JointTrajectory> joints;
  for (int j = 0; j < 3; ++j) {
    const double q = 0.4 * j - 0.3;
    JointTrajectory joint(0, JointPath{JointProfile::quartic, 7.3, q, q + 1.1, 0, 0.07 - 0.04 * j});
    joint.pieces.push_back(
        {7.3, 19.1, JointPath{JointProfile::cycloidal, 19.1 - 7.3, q + 1.1, q - 2.3, 0.07 - 0.04 * j, -0.11}});
    joint.pieces.push_back({19.1, 20.6, JointPath{JointProfile::quintic, 20.6 - 19.1, q - 2.3, q - 2, -0.11, 0.3}});
    joint.pieces.push_back({20.6, 33, ChebyshevPiece{{q - 1, 1.5, 0.5, -0.01 * j}}});
    joints.push_back(joint);
  }
  return joints;
}

TEST(MotionPieces, AreTheSameMotion) {
  const std::vector<JointTrajectory> joints = of_all_kinds();
  const std::vector<MotionPiece> pieces = motion_segments(joints);
  ASSERT_EQ(pieces.size(), 4u);
  EXPECT_EQ(pieces[2].until, 20.6);
  EXPECT_EQ(pieces[3].series[1], std::get<ChebyshevPiece>(joints[1].pieces[3].shape).coefficients);
  Worst position("position"), rate("rate"), acceleration("acceleration");
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const JointTrajectory stated = trajectory_of(pieces, j);
    EXPECT_NO_THROW(validate(stated));
    EXPECT_EQ(break_times(stated), break_times(joints[j]));
    for (const JointPiece& piece : joints[j].pieces) {
      for (int k = 0; k <= 50; ++k) {
        const double t = piece.begin + (piece.end - piece.begin) * k / 50;
        const double inside = 0.5 * (piece.begin + piece.end);
        const JointPoint a = evaluate(stated, t, inside), b = evaluate(joints[j], t, inside);
        EXPECT_LT(position.note(std::abs(a.position - b.position), k), 1e-14);              // measured 2e-15
        EXPECT_LT(rate.note(std::abs(a.rate - b.rate), k), 1e-12);                          // measured 3e-14
        EXPECT_LT(acceleration.note(std::abs(a.acceleration - b.acceleration), k), 1e-11);  // measured 4e-13
      }
    }
  }
}

TEST(MotionPieces, EndTogether) {
  std::vector<JointTrajectory> joints = of_all_kinds();
  joints[1].pieces.pop_back();
  EXPECT_THROW(motion_segments(joints), std::invalid_argument);
  joints = of_all_kinds();
  joints[2].pieces[0].end = joints[2].pieces[1].begin = 7.4;
  EXPECT_THROW(motion_segments(joints), std::invalid_argument);
}

// The thesis's case planned, and its plan stated piece by piece.
CaptureProblem planned() {
  CaptureProblem p = thesis_case();
  p.approach->profile = JointProfile::cycloidal;
  p.approach->final_position.clear();
  p.approach->plan.emplace();
  p.approach->match = RateMatch::twist;
  p.approach->waypoints.resize(1);
  p.approach->waypoints[0].time = 6;
  p.approach->waypoints[0].joints = {0.5, -1.2, 0.8, 2.2, 1.2, -0.7};
  return p;
}
CaptureProblem stated(const CaptureProblem& planned) {
  const ApproachPlan plan = plan_approach(planned, plan_targets(planned));
  CaptureProblem p = planned;
  p.approach->plan.reset(), p.approach->match.reset(), p.approach->waypoints.clear();
  p.approach->profile = {};
  p.approach->pieces = motion_segments(plan.joints);
  return p;
}

TEST(MotionPieces, AreFollowed) {
  const CaptureProblem by_plan = planned(), by_pieces = stated(by_plan);
  const CaptureResult a = simulate_capture(by_plan), b = simulate_capture(by_pieces);
  ASSERT_EQ(a.status, CaptureStatus::completed) << a.failure;
  ASSERT_EQ(b.status, CaptureStatus::completed) << b.failure;
  expect_passes(b);
  Worst difference("state at the end of the approach");
  const std::size_t s = last_sample(a, "approach");
  ASSERT_EQ(last_sample(b, "approach"), s);
  for (const char* channel : {"joints/position", "joints/velocity"}) {
    const auto planned_values = joints_at(a, channel, s), values = joints_at(b, channel, s);
    for (std::size_t j = 0; j < 6; ++j)
      EXPECT_LT(difference.note(std::abs(values[j] - planned_values[j]), static_cast<int>(j)),
                1e-12);  // measured 2e-14
  }
}

// Nothing has to be worked out, and what is stated is what planning takes over.
TEST(MotionPieces, NeedNoPlanning) {
  const CaptureProblem p = stated(planned());
  const auto quick = stated_approach(p, make_servicer(p));
  ASSERT_TRUE(quick);
  const ApproachPlan plan = plan_approach(p, plan_targets(p));
  EXPECT_EQ(quick->report.joints, plan.report.joints);
  EXPECT_EQ(quick->report.final_position, plan.report.final_position);
  EXPECT_EQ(quick->report.final_rates, plan.report.final_rates);
  EXPECT_FALSE(plan.report.searched);
  ASSERT_EQ(quick->joints.size(), plan.joints.size());
  for (std::size_t j = 0; j < plan.joints.size(); ++j)
    EXPECT_EQ(evaluate(quick->joints[j], 7.7).position, evaluate(plan.joints[j], 7.7).position);
}

TEST(MotionPieces, ProgrammedPiecesAreChecked) {
  const CaptureProblem good = stated(planned());
  const auto refused = [&](auto change) {
    CaptureProblem p = good;
    change(*p.approach);
    try {
      simulate_capture(p);
    } catch (const CaptureProblemError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  using ::testing::HasSubstr;
  const auto need = HasSubstr("approach: pieces need increasing ends");
  EXPECT_THAT(refused([](ApproachSetup& a) { a.pieces[0].until = 0; }), need);
  EXPECT_THAT(refused([](ApproachSetup& a) { a.pieces[1].series.pop_back(); }), need);
  EXPECT_THAT(refused([](ApproachSetup& a) { a.pieces[1].series[2].clear(); }), need);
  EXPECT_THAT(refused([](ApproachSetup& a) { a.pieces[1].series[2][0] = NAN; }), need);
  EXPECT_THAT(refused([](ApproachSetup& a) { a.duration += 1; }), need);
  EXPECT_THAT(refused([](ApproachSetup& a) { a.plan.emplace(); }), HasSubstr("give one of"));
  EXPECT_THAT(refused([](ApproachSetup& a) { a.match = RateMatch::twist; }), HasSubstr("state the whole motion"));
}

}  // namespace motion_pieces_test
}  // namespace grapnel::testing
