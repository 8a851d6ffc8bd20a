/// Mass properties of a held body from rates: exact without noise, correct null spaces for insufficient motion, and
/// correct standard deviations.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/identify/identify_target.hpp"
#include "grapnel/identify/rate_noise.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace {

// A base, two links and a body held by the last link, all with asymmetric mass properties.
Model robot_with(double mass, const Vector3d& com, const Symmetric3d& inertia, bool planar = false) {
  ModelBuilder builder;
  const auto add = [&](const char* name, const char* parent, double m, const Vector3d& c, const Symmetric3d& I,
                       const Vector3d& p, JointType type, const Vector3d& axis) {
    BodyDescription b;
    b.name = name, b.parent = parent, b.mass = m, b.com = c, b.inertia = I, b.X_PF.p = p;
    b.joint.name = std::string("joint_") + name, b.joint.type = type, b.joint.axis = axis;
    builder.add(b);
  };
  const Vector3d z{0, 0, 1}, y = planar ? z : Vector3d{0, 1, 0};
  const double out = planar ? 0 : 1;  // out-of-plane components, absent for a planar robot
  add("base", "", 100, {0.1, -0.05, out * 0.02}, {20, 25, 30, 1, out * -2, out * 0.5}, {}, JointType::free, z);
  add("upper", "base", 8, {0.4, 0.01, 0}, {0.1, 0.9, 0.9, 0.01, 0, out * 0.02}, {0.6, 0.2, 0}, JointType::revolute, z);
  add("lower", "upper", 6, {0.3, 0, out * 0.02}, {0.1, 0.6, 0.6, 0, out * 0.01, 0}, {0.9, 0, 0}, JointType::revolute,
      y);
  add("target", "lower", mass, com, inertia, {0.7, 0, out * 0.1}, JointType::revolute, planar ? z : Vector3d{1, 0, 0});
  builder.add(FrameDescription{"T", "target", {rotation_about({0, 0.6, 0.8}, planar ? 0 : 0.7), {0.1, 0.2, 0}}});
  return builder.build();
}
constexpr double kMass = 40;
const Vector3d kCom{0.3, -0.2, 0.15};
const Symmetric3d kInertia{5, 7, 9, 0.4, -0.3, 0.6};
Model robot() { return robot_with(kMass, kCom, kInertia); }

// Expected result from the model.
InertialParameters truth(const Model& model, int frame) {
  const Frame& f = model.frames()[frame];
  const BodyDescription& d = model.bodies()[f.body].description;
  const Posed X_TB = inverse(f.X_BE);
  const Vector3d c = X_TB * d.com;
  const Symmetric3d I = rotate(X_TB.R, d.inertia);
  return {d.mass, c[0], c[1], c[2], I.xx, I.yy, I.zz, I.xy, I.xz, I.yz};
}

// Reference magnitudes of the errors.
InertialParameters sizes(const InertialParameters& p) {
  const double I = p[4] + p[5] + p[6], l = std::sqrt(I / p[0]);
  return {p[0], l, l, l, I, I, I, I, I, I};
}

double worst_error(const IdentifiedBody& found, const InertialParameters& expected) {
  const InertialParameters size = sizes(expected);
  double worst = 0;
  for (int i = 0; i < kInertialParameters; ++i)
    worst = std::max(worst, found.value[i] ? std::abs(*found.value[i] - expected[i]) / size[i] : INFINITY);
  return worst;
}

struct Motion {
  bool joints_move = true, planar = false;
  int samples = 30;
};

// Samples with one total momentum, [about the origin; linear] in W, whose centre of mass moves accordingly through the
// origin; attitudes and joint values are random.
std::vector<MotionSample> samples_of(const Model& model, const Momentumd& total, Random& random, const Motion& motion) {
  std::vector<MotionSample> samples;
  const std::vector<int> roots{0};
  double mass = 0;
  for (const Body& body : model.bodies()) mass += body.root == 0 ? body.description.mass : 0;
  State state = random_state(model, random, 0.5);
  for (int s = 0; s < motion.samples; ++s) {
    if (motion.joints_move) state = random_state(model, random, 0.5);
    for (int v : joint_velocities(model, 0)) state.v[v] *= motion.joints_move ? 1 : 0;
    Posed X_WB{motion.planar ? rotation_about({0, 0, 1}, random.uniform(-3, 3)) : random.rotation(), Vector3d::zero()};
    set_root_pose(model, 0, X_WB, state);
    X_WB.p = (0.1 * s / mass) * total.linear - center_of_mass(model, forward_kinematics(model, state), roots);
    set_root_pose(model, 0, X_WB, state);
    set_root_twist(model, 0, base_twist_from_momentum(model, state, 0, total), state);
    samples.push_back({state});
  }
  return samples;
}

IdentifiedBody identify(const Model& model, std::vector<MotionSample> samples, std::optional<Momentumd> momentum,
                        MeasuredBase base = MeasuredBase::twist, const RateNoise& noise = {}) {
  return identify_target(
      {model, static_cast<int>(model.frames().size()) - 1, std::move(samples), base, momentum, noise});
}

const Momentumd kTotal{{3, -5, 2}, {4, 1, -2}};

// --- All parameters determined ---

TEST(Identification, IsExactOnRandomRobots) {
  double worst = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 4, options.max_bodies = 9;
    options.rotors = options.fixed_joints = false;
    options.spherical_joints = i % 2 == 0, options.prismatic_joints = i % 3 == 0;
    const Model model = random_model(options, random);
    const int frame = static_cast<int>(model.frames().size()) - 1;
    if (model.bodies()[model.frames()[frame].body].parent < 0) continue;
    const Momentumd total{random.vector(5), random.vector(5)};
    for (const bool known : {true, false}) {
      const IdentifiedBody found =
          identify(model, samples_of(model, total, random, {}), known ? std::optional(total) : std::nullopt);
      ASSERT_TRUE(found.converged);
      if (!found.all_determined()) {  // unknown momentum with few joints
        EXPECT_EQ(found.unseen.size(), static_cast<std::size_t>(kInertialParameters - found.rank));
        continue;
      }
      EXPECT_EQ(found.impossible, "");
      worst = std::max(worst, worst_error(found, truth(model, frame)));
    }
  }
  EXPECT_LT(worst, 1e-9);  // measured 8e-13
}

TEST(Identification, IsExactForEveryKnowledgeAndMeasurement) {
  const Model model = robot();
  for (const MeasuredBase base : {MeasuredBase::twist, MeasuredBase::rotation}) {
    for (const bool known : {true, false}) {
      for (const Momentumd& total : {kTotal, Momentumd::zero()}) {
        Random random(7);
        const IdentifiedBody found =
            identify(model, samples_of(model, total, random, {}), known ? std::optional(total) : std::nullopt, base);
        EXPECT_TRUE(found.converged);
        EXPECT_EQ(found.rank, kInertialParameters);
        EXPECT_LT(worst_error(found, truth(model, 0)), 1e-10);
        EXPECT_EQ(found.mass, Identified::determined);
        EXPECT_EQ(found.com, Identified::determined);
        EXPECT_EQ(found.inertia, Identified::determined);
        EXPECT_FALSE(found.deviation[0]);
        EXPECT_EQ(found.impossible, "");
      }
    }
  }
}

// Independent check: momentum of models that differ in the target alone, through ModelBuilder and momentum_about(),
// with normal equations; shares no code with the regressor.
TEST(Identification, AgreesWithFiniteDifferences) {
  const Model model = robot();
  Random random(3);
  const std::vector<MotionSample> samples = samples_of(model, kTotal, random, {});
  const Posed X_BT = model.frames()[0].X_BE;
  // Mass, first moment and inertia about the frame's origin, in the frame.
  const auto momentum = [&](const Eigen::VectorXd& x, const State& state) {
    const RigidBodyInertiad in_T{x[0], {x[1], x[2], x[3]}, {x[4], x[5], x[6], x[7], x[8], x[9]}};
    const RigidBodyInertiad in_B = X_BT * in_T;
    const Model changed = robot_with(in_B.mass, in_B.com(), in_B.rotational_about_com());
    return eigen(momentum_about(changed, forward_kinematics(changed, state), Vector3d::zero()));
  };
  Eigen::VectorXd x0(10);
  x0 << 30, 1, 2, 1, 40, 50, 45, 1, 2, 3;
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(10, 10);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(10);
  for (const MotionSample& s : samples) {
    const Eigen::VectorXd h0 = momentum(x0, s.state);
    Eigen::MatrixXd Y(6, 10);
    for (int i = 0; i < 10; ++i) {
      Eigen::VectorXd x = x0;
      x[i] += 1;
      Y.col(i) = momentum(x, s.state) - h0;
    }
    N += Y.transpose() * Y;
    b += Y.transpose() * (eigen(kTotal) - h0);
  }
  const Eigen::VectorXd x = x0 + N.ldlt().solve(b);
  const RigidBodyInertiad in_T{x[0], {x[1], x[2], x[3]}, {x[4], x[5], x[6], x[7], x[8], x[9]}};
  const Symmetric3d I = in_T.rotational_about_com();
  const Vector3d c = in_T.com();
  const IdentifiedBody found = identify(model, samples, kTotal);
  EXPECT_LT(worst_error(found, {x[0], c[0], c[1], c[2], I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}), 1e-8);
}

// If only the base's rotation is measured, its position and velocity are not read.
TEST(Identification, FromRotationDoesNotDependOnTheBasesTranslation) {
  const Model model = robot();
  Random random(10);
  std::vector<MotionSample> samples = samples_of(model, kTotal, random, {});
  for (MotionSample& s : samples) {
    Posed X_WB = root_pose(model, s.state, 0);
    Twistd V_WB = root_twist(model, s.state, 0);
    X_WB.p += random.vector(5);
    V_WB.linear += random.vector(3);
    set_root_pose(model, 0, X_WB, s.state);
    set_root_twist(model, 0, V_WB, s.state);
  }
  EXPECT_LT(worst_error(identify(model, samples, kTotal, MeasuredBase::rotation), truth(model, 0)), 1e-10);
  EXPECT_LT(worst_error(identify(model, samples, {}, MeasuredBase::rotation), truth(model, 0)), 1e-10);
  EXPECT_GT(worst_error(identify(model, samples, kTotal), truth(model, 0)), 1e-3);
}

// A known external impulse between samples, and the effect of ignoring it.
TEST(Identification, CountsKnownImpulses) {
  const Model model = robot();
  Random random(5);
  std::vector<MotionSample> samples = samples_of(model, kTotal, random, {});
  const Impulsed impulse{{0.5, 1, -2}, {3, -1, 2}};
  std::vector<MotionSample> later = samples_of(model, kTotal + impulse, random, {});
  for (MotionSample& s : later) s.impulse = impulse, samples.push_back(s);
  for (const bool known : {true, false}) {
    const auto momentum = known ? std::optional(kTotal) : std::nullopt;
    EXPECT_LT(worst_error(identify(model, samples, momentum), truth(model, 0)), 1e-10);
    std::vector<MotionSample> unaware = samples;
    for (MotionSample& s : unaware) s.impulse = Impulsed::zero();
    EXPECT_GT(worst_error(identify(model, unaware, momentum), truth(model, 0)), 1e-3);
  }
}

// --- Parameters partly determined ---

TEST(Identification, RestDeterminesNothing) {
  const Model model = robot();
  Random random(1);
  const IdentifiedBody found =
      identify(model, samples_of(model, Momentumd::zero(), random, {.joints_move = false}), Momentumd::zero());
  EXPECT_EQ(found.rank, 0);
  EXPECT_EQ(found.mass, Identified::not_determined);
  EXPECT_EQ(found.unseen.size(), 10u);
  for (const auto& value : found.value) EXPECT_FALSE(value);
}

// Bodies locked together tumble as one. Known momentum determines all parameters; unknown momentum leaves the total
// mass and the scale of the total inertia undetermined: (16.9).
TEST(Identification, LockedJointsWithUnknownMomentumYieldRatiosOnly) {
  const Model model = robot();
  Random random(2);
  const std::vector<MotionSample> samples = samples_of(model, kTotal, random, {.joints_move = false});
  EXPECT_LT(worst_error(identify(model, samples, kTotal), truth(model, 0)), 1e-9);

  const IdentifiedBody found = identify(model, samples, std::nullopt);
  EXPECT_EQ(found.rank, 8);
  EXPECT_EQ(found.mass, Identified::ratio_only);
  EXPECT_EQ(found.com, Identified::ratio_only);
  EXPECT_EQ(found.inertia, Identified::not_determined);
  EXPECT_FALSE(found.value[0]);
  // Additional mass appears at the common centre of mass.
  const State& state = samples.front().state;
  const Kinematics k = forward_kinematics(model, state);
  const Posed X_WT = frame_pose(model, k, 0);
  const Vector3d C = inverse(X_WT) * center_of_mass(model, k);
  ASSERT_EQ(found.unseen.size(), 2u);
  int of_mass = 0;
  for (const UnseenChange& unseen : found.unseen) {
    if (std::abs(unseen.change[0]) < 1e-9) continue;
    ++of_mass;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(unseen.change[1 + i] / unseen.change[0], C[i], 1e-6);
  }
  EXPECT_GE(of_mass, 1);
}

// Planar motion: mass, two coordinates of the centre of mass, and the inertia about the plane's normal.
TEST(Identification, PlanarMotionDeterminesPlanarParameters) {
  const Model model = robot_with(kMass, {0.3, -0.2, 0}, Symmetric3d::diagonal(5, 7, 9), true);
  Random random(4);
  const Momentumd total{{0, 0, 3}, {1, 2, 0}};
  const std::vector<MotionSample> samples = samples_of(model, total, random, {.planar = true});
  EXPECT_EQ(identify(model, samples, std::nullopt).rank, 7);
  const IdentifiedBody found = identify(model, samples, total);
  const InertialParameters expected = truth(model, 0);
  EXPECT_EQ(found.rank, 7);
  EXPECT_EQ(found.mass, Identified::determined);
  EXPECT_EQ(found.com, Identified::determined);
  EXPECT_EQ(found.inertia, Identified::not_determined);
  for (const int i : {0, 1, 2, 3, 6, 8, 9}) {
    ASSERT_TRUE(found.value[i]) << i;
    EXPECT_NEAR(*found.value[i], expected[i], 1e-9);
  }
  for (const int i : {4, 5, 7}) EXPECT_FALSE(found.value[i]) << i;
  ASSERT_EQ(found.unseen.size(), 3u);
  EXPECT_EQ(unseen_text(found.unseen[0]), "inertia_xx + 1 kg m^2");
  EXPECT_EQ(unseen_text(found.unseen[1]), "inertia_yy + 1 kg m^2");
  EXPECT_EQ(unseen_text(found.unseen[2]), "inertia_xy + 1 kg m^2");
  EXPECT_EQ(found.impossible, "");
}

TEST(Identification, ReportsImpossibleParameters) {
  const Model model = robot();
  Random random(6);
  std::vector<MotionSample> samples = samples_of(model, kTotal, random, {});
  const Momentumd wrong{{-30, 40, 30}, {-100, 50, 60}};
  const IdentifiedBody found = identify(model, samples, wrong);
  EXPECT_TRUE(found.all_determined());
  EXPECT_NE(found.impossible, "");
}

// --- Noise ---

struct Statistics {
  double worst_bias = 0, min_ratio = INFINITY, largest_ratio = 0, residual = 0;
};

// Over many draws: means in standard errors, and spreads relative to the prediction.
Statistics draw(const Model& model, const std::vector<MotionSample>& samples, const RateNoise& noise,
                std::optional<Momentumd> momentum, MeasuredBase base, int draws) {
  const std::vector<double> deviations = rate_deviations(model, 0, noise);
  const InertialParameters expected = truth(model, 0);
  InertialParameters sum{}, squares{}, predicted{};
  Statistics all;
  for (int d = 0; d < draws; ++d) {
    std::vector<MotionSample> noisy = samples;
    for (std::size_t i = 0; i < noisy.size(); ++i)
      noisy[i].state =
          with_rate_noise(samples[i].state, deviations, static_cast<std::uint64_t>(d), static_cast<std::uint32_t>(i));
    const IdentifiedBody found = identify(model, noisy, momentum, base, noise);
    EXPECT_TRUE(found.converged && found.all_determined());
    all.residual += found.residual / draws;
    for (int i = 0; i < kInertialParameters; ++i) {
      const double error = found.value[i].value_or(1e9) - expected[i];
      sum[i] += error, squares[i] += error * error;
      predicted[i] += found.deviation[i].value_or(0) / draws;
    }
  }
  for (int i = 0; i < kInertialParameters; ++i) {
    const double mean = sum[i] / draws, spread = std::sqrt(squares[i] / draws - mean * mean);
    all.worst_bias = std::max(all.worst_bias, std::abs(mean) / (spread / std::sqrt(draws)));
    all.min_ratio = std::min(all.min_ratio, spread / predicted[i]);
    all.largest_ratio = std::max(all.largest_ratio, spread / predicted[i]);
  }
  return all;
}

TEST(Identification, ErrorsMatchTheDeviations) {
  SKIP_UNDER_SANITIZERS();
  const Model model = robot();
  const RateNoise noise{5e-3, 3e-3, 8e-3};  // about two per cent of the rates
  for (const MeasuredBase base : {MeasuredBase::twist, MeasuredBase::rotation}) {
    Random random(8);
    const std::vector<MotionSample> samples = samples_of(model, kTotal, random, {.samples = 100});
    const bool rotation = base == MeasuredBase::rotation;
    std::optional<Momentumd> momentum;
    if (!rotation) momentum = kTotal;
    const Statistics found = draw(model, samples, noise, momentum, base, 200);
    // 200 draws: spreads are accurate to 5 %; means of ten parameters.
    EXPECT_LT(found.worst_bias, 4);
    EXPECT_GT(found.min_ratio, 0.82);
    EXPECT_LT(found.largest_ratio, 1.18);
    EXPECT_NEAR(found.residual, 1, 0.02);
  }
}

TEST(Identification, NoiseAloneDeterminesNothing) {
  const Model model = robot();
  Random random(9);
  const RateNoise noise{1e-3, 1e-3, 1e-3};
  const std::vector<double> deviations = rate_deviations(model, 0, noise);
  std::vector<MotionSample> samples = samples_of(model, kTotal, random, {.joints_move = false, .samples = 200});
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i].state = with_rate_noise(samples[i].state, deviations, 1, static_cast<std::uint32_t>(i));
  const IdentifiedBody found = identify(model, samples, std::nullopt, MeasuredBase::twist, noise);
  EXPECT_EQ(found.rank, 8);
  EXPECT_FALSE(found.value[0]);
}

TEST(RateNoise, HasItsDeviationAndIsAFunctionOfItsSeed) {
  const Model model = robot();
  const std::vector<double> deviations = rate_deviations(model, 0, {1, 2, 3});
  EXPECT_THAT(deviations, ::testing::ElementsAre(1, 1, 1, 2, 2, 2, 3, 3, 3));
  const State still = zero_state(model);
  constexpr int kDraws = 20'000;
  double sum = 0, squares = 0, product = 0;
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const State noisy = with_rate_noise(still, deviations, 11, i);
    EXPECT_EQ(noisy.q, still.q);
    sum += noisy.v[4] / 2, squares += noisy.v[4] * noisy.v[4] / 4, product += noisy.v[4] * noisy.v[5] / 4;
  }
  EXPECT_NEAR(sum / kDraws, 0, 4 / std::sqrt(kDraws));
  EXPECT_NEAR(squares / kDraws, 1, 4 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(product / kDraws, 0, 4 / std::sqrt(kDraws));
  EXPECT_EQ(with_rate_noise(still, deviations, 11, 5).v, with_rate_noise(still, deviations, 11, 5).v);
  EXPECT_NE(with_rate_noise(still, deviations, 12, 5).v, with_rate_noise(still, deviations, 11, 5).v);
}

// --- Invalid arguments ---

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no refusal";
}

TEST(Identification, RejectsInvalidTasks) {
  const Model model = robot();
  Random random(1);
  const std::vector<MotionSample> samples = samples_of(model, kTotal, random, {});
  EXPECT_THAT(refusal([&] { identify(model, {}, kTotal); }), ::testing::HasSubstr("no samples"));
  EXPECT_THAT(refusal([&] {
                identify(model, samples, kTotal, MeasuredBase::twist, {-1, 0, 0});
              }),
              ::testing::HasSubstr("noise must be finite and not negative"));
  std::vector<MotionSample> pushed = samples;
  pushed.back().impulse.linear = {1, 0, 0};
  EXPECT_THAT(refusal([&] { identify(model, pushed, kTotal, MeasuredBase::rotation); }),
              ::testing::HasSubstr("a force acts"));
  const Model on_base = ModelBuilder(model).add(FrameDescription{"on_base", "base", Posed::identity()}).build();
  EXPECT_THAT(refusal([&] {
                identify_target({on_base, on_base.frame_index("on_base"), samples});
              }),
              ::testing::HasSubstr("root of its tree"));
}

TEST(Identification, DescribesTheNullSpace) {
  UnseenChange unseen;
  unseen.parameter = 0;
  unseen.change = {1, 0.3, 0, -0.1, 0, 0, 2, 0, 0, 0};
  EXPECT_EQ(unseen_text(unseen),
            "mass + 1 kg with first_moment_x + 0.3 kg m, first_moment_z - 0.1 kg m, inertia_zz + 2 kg m^2");
}

}  // namespace
}  // namespace grapnel::testing
