/// Whole captures of random robots in three dimensions.

#include <gtest/gtest.h>

#include <cstring>
#include <thread>

#include "capture/capture_case.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace random_capture_test {

constexpr int kCaptures = 60;

TEST(RandomCapture, LedgerPassesWithNonzeroMomentum) {
  SKIP_UNDER_SANITIZERS();
  Worst linear("linear momentum"), angular("angular momentum"), work("work-energy"), energy("energy"),
      identity("impact energy identity");
  int brakes = 0, moved = 0;
  for (int i = 0; i < kCaptures; ++i) {
    SCOPED_TRACE(seed_note(i));
    const CaptureProblem p = random_capture(i);
    const CaptureResult r = simulate_capture(p);
    EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
    for (const LedgerEntry& e : r.ledger.entries) EXPECT_TRUE(e.pass()) << e.name << " " << e.value << " > " << e.bound;
    linear.note(row(r, "linear_momentum_drift").value, i), angular.note(row(r, "angular_momentum_drift").value, i);
    work.note(row(r, "work_energy_residual").value, i), energy.note(row(r, "energy_drift").value, i);
    identity.note(row(r, "energy_identity_residual").value, i);
    ASSERT_TRUE(r.post_impact_end);
    EXPECT_GT(norm(vector_at(r, "system/linear_momentum", 0)), 0.01 * r.ledger.scale.linear_momentum);
    EXPECT_GT(norm(vector_at(r, "system/angular_momentum", 0)), 0.01 * r.ledger.scale.angular_momentum);
    for (const GraspImpulse& g : r.impact()->grasps) EXPECT_GT(g.impulse_magnitude, 1e-3);
    brakes += r.impact()->brake.has_value();
    moved += norm(r.impact()->grasps[0].target_displacement) > 0;
    // Independent check of the ledger: total momenta in the first and last samples are equal if no target is displaced.
    if (p.contact.gap != ContactSetup::Gap::translate_target) {
      const std::size_t end = r.series.time.size() - 1;
      const auto off = [&](const char* path) { return norm(vector_at(r, path, end) - vector_at(r, path, 0)); };
      EXPECT_LT(off("system/linear_momentum"), 1e-11 * r.ledger.scale.linear_momentum);
      EXPECT_LT(off("system/angular_momentum"), 1e-11 * r.ledger.scale.angular_momentum);
    }
  }
  EXPECT_EQ(brakes, kCaptures / 5);
  EXPECT_EQ(moved, kCaptures / 4);
}

TEST(RandomCapture, IntegratedBasesAgreeWithRecoveredOnes) {
  SKIP_UNDER_SANITIZERS();
  Worst worst("impulses with integrated base velocities against recovered");
  for (int i = 0; i < 10; ++i) {
    SCOPED_TRACE(seed_note(i));
    CaptureProblem p = random_capture(i);
    p.post_impact.reset();
    const CaptureResult a = simulate_capture(p);
    p.integration.root_velocity = IntegrationSetup::RootVelocity::integrated;
    const CaptureResult b = simulate_capture(p);
    ASSERT_TRUE(a.impact() && b.impact());
    for (std::size_t g = 0; g < p.grasps.size(); ++g) {
      const double size = norm(a.impact()->grasps[g].impulse);
      EXPECT_LT(worst.note(norm(a.impact()->grasps[g].impulse - b.impact()->grasps[g].impulse) / size, i), 1e-8);
    }
  }
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}
void expect_same(const CaptureResult& a, const CaptureResult& b) {
  ASSERT_EQ(a.series.series.size(), b.series.series.size());
  EXPECT_TRUE(same_bits(a.series.time, b.series.time));
  for (std::size_t s = 0; s < a.series.series.size(); ++s) {
    EXPECT_TRUE(same_bits(a.series.series[s].data, b.series.series[s].data)) << a.series.series[s].path;
  }
  ASSERT_EQ(a.ledger.entries.size(), b.ledger.entries.size());
  for (std::size_t e = 0; e < a.ledger.entries.size(); ++e) {
    EXPECT_TRUE(same_bits({a.ledger.entries[e].value}, {b.ledger.entries[e].value})) << a.ledger.entries[e].name;
  }
}

TEST(RandomCapture, BitIdenticalOnRepeatAndInThreads) {
  SKIP_UNDER_SANITIZERS();
  std::vector<CaptureResult> first(4), threaded(8);
  for (int i = 0; i < 4; ++i) first[i] = simulate_capture(random_capture(i));
  expect_same(first[1], simulate_capture(random_capture(1)));
  // Two threads run simultaneously; the second uses another order of cases.
  const auto work = [&](std::size_t offset, std::vector<int> order) {
    for (int i : order) threaded[offset + static_cast<std::size_t>(i)] = simulate_capture(random_capture(i));
  };
  std::thread one(work, 0, std::vector<int>{0, 1, 2, 3}), two(work, 4, std::vector<int>{3, 1, 0, 2});
  one.join(), two.join();
  for (std::size_t i = 0; i < 4; ++i) {
    SCOPED_TRACE(seed_note(static_cast<int>(i)));
    EXPECT_GT(first[i].series.time.size(), 20u);
    expect_same(first[i], threaded[i]);
    expect_same(first[i], threaded[i + 4]);
  }
}

// In a displaced, rotated frame that drifts at constant velocity, the capture has the same impulses, rotated.
TEST(RandomCapture, IndependentOfInertialFrame) {
  SKIP_UNDER_SANITIZERS();
  Worst worst("impulses in another inertial frame");
  const Posed X_VW{rotation_about({0.48, 0.6, 0.64}, 1.1), {3, -7, 11}};
  const Vector3d drift{0.4, -0.3, 0.2};  // of W seen from V
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    CaptureProblem p = random_capture(i);
    p.post_impact.reset();
    if (p.momentum) p.momentum.reset(), p.V_WB = Twistd{{0.1, -0.1, 0.2}, {0.2, 0.1, -0.1}};
    CaptureProblem q = p;
    const double T = p.approach->duration;
    const auto seen = [&](const Twistd& V) { return Twistd{X_VW.R * V.angular, X_VW.R * V.linear + drift}; };
    q.X_WB = X_VW * p.X_WB;
    q.V_WB = seen(*p.V_WB);
    for (TargetSetup& t : q.targets) {
      const double time = t.given_at == TargetSetup::Instant::start ? 0 : T;
      t.X_WT = X_VW * t.X_WT;
      t.X_WT.p = t.X_WT.p + time * drift;
      t.V_WT = seen(t.V_WT);
    }
    const CaptureResult a = simulate_capture(p), b = simulate_capture(q);
    ASSERT_TRUE(a.impact() && b.impact());
    for (std::size_t g = 0; g < p.grasps.size(); ++g) {
      const GraspImpulse &x = a.impact()->grasps[g], &y = b.impact()->grasps[g];
      EXPECT_LT(worst.note(norm(X_VW.R * x.impulse - y.impulse) / norm(x.impulse), i), 1e-8);
    }
  }
}

}  // namespace random_capture_test
}  // namespace grapnel::testing
