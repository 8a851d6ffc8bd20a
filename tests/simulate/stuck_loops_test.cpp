/// Joints at rest with sticking friction in closed loops: slipping joints against convex programs from the dense mass
/// matrix; equal results for rotated, permuted, rescaled and perturbed scenes; events; structures without mobility.

#include <gtest/gtest.h>

#include "grapnel/spatial/decompositions.hpp"
#include "simulate/stuck_loop_scene.hpp"

namespace grapnel::testing {
namespace stuck_loops_test {

// Random options for scenes of all kinds.
ArmsOptions options_of(int i, Random& random) {
  ArmsOptions o;
  o.planar = i % 2 == 0;
  o.arms = 1 + i % 3 + (i % 5 == 0 ? 1 : 0);
  o.arms = std::min(o.arms, 3);
  o.joints = o.arms == 1 ? random.integer(3, 7) : o.planar ? random.integer(2, 3) : random.integer(3, 6);
  o.ground = random.chance(0.2);
  if (!o.planar && random.chance(0.3)) o.grasp = GraspModel::point;
  return o;
}

// Scales the load to this share of the breakaway load; false if no load moves any joint.
bool load_at(Scene& s, double share) {
  const double least = DenseRest(s).least_share();
  if (least < 1e-6) return false;
  s.load.amplitude = (share / least) * s.load.amplitude;
  return true;
}

struct Worst {
  double acceleration = 0, share = 0, balance = 0;
};

// Conditions of every solution: friction within breakaway at held joints, Coulomb friction against the acceleration at
// slipping joints, and consistent accelerations.
void expect_consistent(const Scene& s, const RestAnswer& a, Worst& worst) {
  const DenseRest dense(s);
  for (Eigen::Index i = 0; i < a.friction.size(); ++i) {
    if (a.sense[i] == 0) {
      EXPECT_EQ(a.acceleration[i], 0);
      worst.share = std::max(worst.share, std::abs(a.friction[i]) / dense.breakaway[i]);
    } else {
      EXPECT_EQ(a.friction[i], -a.sense[i] * dense.coulomb[i]);
      EXPECT_GT(a.sense[i] * a.acceleration[i], 0);
    }
  }
  const double scale = dense.b.norm() + (dense.A * dense.breakaway.asDiagonal()).norm();
  worst.balance = std::max(worst.balance, (dense.A * a.friction + dense.b - a.acceleration).norm() / scale);
}

TEST(StuckLoops, AtRestIfFrictionSuffices) {
  Worst worst;
  int stay = 0, move = 0, rigid = 0;
  for (int i = 0; i < 600; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    Scene s = scene_of(random_arms(options_of(i, random), random),
                       random.chance(0.5) ? random.rotation() : Rotationd::identity());
    const double shares[] = {0.9, 0.99, 1 - 1e-6, 1 + 1e-6, 1.01, 1.3, 2};
    const double share = shares[i % 7];
    const bool mobile = load_at(s, share);
    const RestAnswer a = answer_of(s);
    if (!mobile) {
      // Mobility and accelerations are of the order of rounding here: the balance has no scale.
      Worst without_balance = worst;
      expect_consistent(s, a, without_balance);
      worst.share = without_balance.share;
      ++rigid;
      EXPECT_TRUE(a.held);
      continue;
    }
    expect_consistent(s, a, worst);
    EXPECT_EQ(a.held, share < 1);
    ++(share < 1 ? stay : move);
    if (share < 1) continue;
    const Eigen::VectorXd wanted = DenseRest(s).accelerations();
    const double scale = DenseRest(s).b.norm();
    worst.acceleration = std::max(worst.acceleration, (a.acceleration - wanted).norm() / scale);
    EXPECT_LT((a.acceleration - wanted).norm(), 1e-8 * scale);
  }
  std::printf("%d stay, %d move, %d without mobility; errors: acceleration %.2g, share %.2g, balance %.2g\n", stay,
              move, rigid, worst.acceleration, worst.share - 1, worst.balance);
  EXPECT_LT(worst.share, 1 + 1e-10);
  EXPECT_LT(worst.balance, 1e-10);
  EXPECT_GT(stay, 200);
  EXPECT_GT(move, 250);
  EXPECT_GT(rigid, 10);
}

// Breakaway above Coulomb friction: at rest up to breakaway, otherwise consistent with both.
TEST(StuckLoops, BreakAwayAtStaticAndSlipUnderCoulombFriction) {
  Worst worst;
  int move = 0;
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(1000 + i);
    ArmsOptions o = options_of(i, random);
    o.static_share = random.uniform(1.05, 2);
    Scene s = scene_of(random_arms(o, random));
    const double share = random.uniform(0.9, 2);
    if (!load_at(s, share)) continue;
    const RestAnswer a = answer_of(s);
    expect_consistent(s, a, worst);
    EXPECT_EQ(a.held, share < 1);
    move += !a.held;
  }
  EXPECT_LT(worst.share, 1 + 1e-10);
  EXPECT_LT(worst.balance, 1e-10);
  EXPECT_GT(move, 100);
}

// Enumeration of all modes of up to five joints: exactly the consistent modes have the computed accelerations.
TEST(StuckLoops, ConsistentWithAnyValidMode) {
  int fitting = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(2000 + i);
    ArmsOptions o;
    o.arms = 2, o.joints = 2 + i % 2, o.planar = i % 3 != 0;
    if (!o.planar) o.grasp = GraspModel::point, o.joints = 3;
    Scene s = scene_of(random_arms(o, random));
    if (!load_at(s, random.uniform(1.001, 2))) continue;
    const RestAnswer a = answer_of(s);
    const DenseRest dense(s);
    const Eigen::Index n = dense.b.size();
    const double scale = dense.b.norm();
    int modes = 1;
    for (Eigen::Index k = 0; k < n; ++k) modes *= 3;
    for (int mode = 0; mode < modes; ++mode) {
      Eigen::VectorXd f(n), sense(n);
      std::vector<Eigen::Index> held;
      int rest = mode;
      for (Eigen::Index k = 0; k < n; ++k, rest /= 3) {
        sense[k] = rest % 3 - 1;
        f[k] = -sense[k] * dense.coulomb[k];
        if (sense[k] == 0) held.push_back(k);
      }
      const Eigen::VectorXd pull = dense.A * f + dense.b;
      if (!held.empty()) {
        const Eigen::VectorXd wanted = -pull(held);
        f(held) = least_norm_solution(Eigen::MatrixXd(dense.A(held, held)), wanted, 1e-11);
      }
      const Eigen::VectorXd acceleration = dense.A * f + dense.b;
      bool fits = true;
      for (Eigen::Index k = 0; k < n && fits; ++k) {
        fits = sense[k] == 0 ? std::abs(acceleration[k]) < 1e-11 * scale && std::abs(f[k]) <= dense.coulomb[k]
                             : sense[k] * acceleration[k] > 1e-9 * scale;
      }
      if (!fits) continue;
      ++fitting;
      EXPECT_LT((acceleration - a.acceleration).norm(), 1e-9 * scale);
    }
  }
  EXPECT_GT(fitting, 40);
}

// Scenes rotated, held by another arm with another joint order, in other units, or perturbed by rounding: equal modes.
TEST(StuckLoops, IndependentOfFramesOrderUnitsAndRounding) {
  for (int i = 0; i < 150; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(3000 + i);
    ArmsOptions o = options_of(i, random);
    o.arms = std::max(o.arms, 2);
    o.grasp = GraspModel::rigid;  // like the connection to the carrying arm
    if (i % 4 == 0) o.static_share = 1.3;
    Arms arms = random_arms(o, random);
    Scene s = scene_of(arms);
    const double share = random.chance(0.4) ? random.uniform(0.9, 0.999) : random.uniform(1.001, 2);
    const Wrenchd before = s.load.amplitude;
    if (load_at(s, share)) arms.load = (norm(s.load.amplitude.linear) / norm(before.linear)) * arms.load;
    s = scene_of(arms);
    const RestAnswer a = answer_of(s);
    const double size = a.acceleration.norm() + DenseRest(s).b.norm();
    const auto expect_same = [&](const Scene& other, double length, double mass, const char* what) {
      SCOPED_TRACE(what);
      const RestAnswer b = answer_of(other);
      EXPECT_EQ(a.sense, b.sense);
      for (Eigen::Index k = 0; k < a.sense.size(); ++k) {
        const int body = s.model.body_index(s.joints[static_cast<std::size_t>(k)]);
        const bool slides = s.model.bodies()[body].description.joint.type == JointType::prismatic;
        const double unit = slides ? length : 1, effort = mass * length * (slides ? 1 : length);
        EXPECT_NEAR(a.acceleration[k], b.acceleration[k] / unit, 1e-8 * size);
        EXPECT_NEAR(a.friction[k], b.friction[k] / effort, 1e-6 * DenseRest(s).breakaway.maxCoeff());
      }
    };
    expect_same(scene_of(arms, random.rotation()), 1, 1, "turned");
    expect_same(scene_of(arms, Rotationd::identity(), 1), 1, 1, "held by another arm");
    expect_same(scene_of(arms, Rotationd::identity(), 0, 1e-2, 1e-3), 1e-2, 1e-3, "small units");
    expect_same(scene_of(arms, Rotationd::identity(), 0, 30, 1e3), 30, 1e3, "large units");
    Scene off = scene_of(arms);
    for (double& q : off.state.q) q += 1e-16 * random.uniform(-4, 4);
    expect_same(off, 1, 1, "off by rounding");
  }
}

// A linearly growing effort breaks a loop away at the reported time.
TEST(StuckLoops, BreakAwayTime) {
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(4000 + i);
    ArmsOptions o;
    o.planar = i % 2 == 0, o.arms = 2 + i % 3 / 2, o.joints = o.planar ? 3 : o.arms == 2 ? 4 : 5;
    o.ground = true;  // no motion before breakaway
    Scene s = scene_of(random_arms(o, random));
    if (!load_at(s, 1)) continue;
    s.load.profile.shape = LoadProfile::Shape::table;
    s.load.profile.times = {0, 2}, s.load.profile.values = {Wrenchd::zero(), 2.0 * s.load.amplitude};
    int breakaways = 0;
    for (const double end : {1 - 1e-7, 1 + 1e-4}) {
      PhaseDynamics dynamics(s.model, s.setup());
      const PhaseOutcome out =
          simulate_phase(dynamics, {s.state, 0, end, 0.05}, {}, {.observe = [&](const PhaseSample& x) {
                           for (const JointModes::Joint& j : dynamics.joint_modes().joints()) {
                             if (j.mode == JointModes::Mode::held) {
                               EXPECT_LT(std::abs(x.friction[j.joint]), j.breakaway * (1 + 1e-10));
                             }
                           }
                         }});
      ASSERT_TRUE(out.finished) << out.failure;
      breakaways = 0;
      for (const JointModes::Joint& j : dynamics.joint_modes().joints()) breakaways += j.breakaways;
      EXPECT_EQ(breakaways > 0, end > 1);
    }
  }
}

// Arms of one joint each hold a target as a structure without mobility. The friction is undetermined, and its
// minimum-norm choice is negligible for any load.
TEST(StuckLoops, ImmobileStructuresMinimumNorm) {
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(5000 + i);
    ArmsOptions o;
    o.planar = false, o.arms = 2 + i % 2, o.joints = 1;
    Scene s = scene_of(random_arms(o, random));
    s.load.amplitude = 1000.0 * s.load.amplitude;
    PhaseDynamics dynamics(s.model, s.setup());
    std::vector<double> y = dynamics.initial(s.state, 0);
    dynamics.begin_control(0, 1);
    dynamics.choose_modes(0, y);
    std::vector<double> motor(s.model.joints().size()), friction(motor);
    dynamics.efforts(0, y, motor, friction);
    for (const JointModes::Joint& j : dynamics.joint_modes().joints()) {
      EXPECT_EQ(j.mode, JointModes::Mode::held);
      EXPECT_TRUE(j.undetermined);
      EXPECT_LT(j.largest_share, 1e-9);
      EXPECT_LT(std::abs(friction[j.joint]), 1e-9 * j.breakaway);
    }
  }
}

}  // namespace stuck_loops_test
}  // namespace grapnel::testing
