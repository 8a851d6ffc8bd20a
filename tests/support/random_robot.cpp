#include "support/random_robot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace grapnel::testing {
namespace {

// A quarter turn with exact zeros, or with rounding errors of products of sines and cosines (DH parameters).
Rotationd quarter_turn(Random& random) {
  const int axis = random.integer(0, 2);
  const double sign = random.chance(0.5) ? 1 : -1;
  if (random.chance(0.5)) return rotation_about(sign * Vector3d::unit(axis), M_PI / 2);
  const int i = (axis + 1) % 3, j = (axis + 2) % 3;
  Rotationd R{};
  R(axis, axis) = 1, R(j, i) = sign, R(i, j) = -sign;
  return R;
}

Rotationd mount_rotation(Random& random) {
  const double kind = random.uniform(0, 1);
  if (kind < 0.3) return Rotationd::identity();
  if (kind < 0.5) return quarter_turn(random);
  if (kind < 0.6) return quarter_turn(random) * quarter_turn(random);
  return random.rotation();
}

Vector3d joint_axis(Random& random) {
  if (random.chance(0.4)) return random.direction();
  return (random.chance(0.5) ? 1.0 : -1.0) * Vector3d::unit(random.integer(0, 2));
}

JointType joint_type(const RobotOptions& options, Random& random) {
  const double kind = random.uniform(0, 1);
  if (kind < 0.15 && options.fixed_joints) return JointType::fixed;
  if (kind < 0.35 && options.prismatic_joints) return JointType::prismatic;
  if (kind < 0.50 && options.spherical_joints) return JointType::spherical;
  return kind < 0.8 ? JointType::revolute : JointType::continuous;
}

void fill_inertia(BodyDescription& body, double mass, double size, Random& random) {
  body.mass = mass;
  body.com = random.vector(size / 2);
  body.inertia = random_inertia(mass, size, random);
}

std::vector<BodyDescription> random_bodies(const RobotOptions& options, Random& random) {
  std::vector<BodyDescription> bodies;
  const int count = random.integer(options.min_bodies, options.max_bodies);
  for (int i = 0; i < count; ++i) {
    BodyDescription b;
    b.name = "b" + std::to_string(i);
    b.joint.name = "j" + std::to_string(i);
    if (i == 0) {
      b.joint.type = options.free_root ? JointType::free : JointType::fixed;
      if (!options.free_root) b.X_PF = {random.rotation(), random.vector(3)};
      fill_inertia(b, random.log_uniform(5, 500), 1.0, random);
    } else {
      // Mostly a long branch, sometimes a fork at any body.
      const int parent = random.chance(0.7) ? i - 1 : random.integer(0, i - 1);
      b.parent = "b" + std::to_string(parent);
      b.X_PF = {mount_rotation(random), random.chance(0.1) ? Vector3d::zero() : random.vector(0.7)};
      b.joint.type = joint_type(options, random);
      b.joint.axis = joint_axis(random);
      if (options.rotors && random.chance(0.25)) {
        b.joint.rotor_inertia = random.log_uniform(1e-5, 1e-3), b.joint.gear_ratio = random.uniform(-100, 100);
      }
      fill_inertia(b, random.log_uniform(0.5, 20), 0.6, random);
    }
    bodies.push_back(b);
  }
  for (int i = 0; i < options.targets; ++i) {
    BodyDescription b;
    b.name = "t" + std::to_string(i);
    b.joint.name = "target" + std::to_string(i);
    b.joint.type = JointType::free;
    fill_inertia(b, random.log_uniform(1, 200), 1.0, random);
    bodies.push_back(b);
  }
  return bodies;
}

// About `size` in each component, on every coordinate that a joint has.
void random_quaternion(double* q, Random& random) {
  const Quaterniond value = quaternion_from(random.rotation());
  const double sign = random.chance(0.5) ? 1 : -1;  // both quaternions of a rotation are valid
  q[0] = sign * value.w, q[1] = sign * value.x, q[2] = sign * value.y, q[3] = sign * value.z;
}

}  // namespace

std::uint64_t test_seed() {
  const char* text = std::getenv("GRAPNEL_TEST_SEED");
  return text == nullptr ? 20231 : std::strtoull(text, nullptr, 10);
}

std::string seed_note(int index) {
  return "GRAPNEL_TEST_SEED=" + std::to_string(test_seed()) + " robot " + std::to_string(index);
}

Random::Random(int index) {
  const std::uint64_t seed = test_seed();
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                         static_cast<std::uint32_t>(index)};
  generator_.seed(sequence);
}

double Random::uniform(double lower, double upper) {
  return lower + (upper - lower) * (static_cast<double>(generator_() >> 11) * 0x1p-53);
}
double Random::log_uniform(double lower, double upper) { return std::exp(uniform(std::log(lower), std::log(upper))); }
int Random::integer(int lower, int upper) {
  return std::min(upper, lower + static_cast<int>(std::floor(uniform(0, upper - lower + 1))));
}
Vector3d Random::vector(double size) {
  const double x = uniform(-size, size), y = uniform(-size, size);
  return {x, y, uniform(-size, size)};
}
Vector3d Random::direction() {
  const double z = uniform(-1, 1), angle = uniform(-M_PI, M_PI), r = std::sqrt(1 - z * z);
  const Vector3d d{r * std::cos(angle), r * std::sin(angle), z};
  return (1 / norm(d)) * d;
}
Rotationd Random::rotation() {
  // Shoemake's uniform quaternion.
  const double u = uniform(0, 1), a = uniform(0, 2 * M_PI), b = uniform(0, 2 * M_PI);
  const double s = std::sqrt(1 - u), t = std::sqrt(u);
  return rotation_matrix(Quaterniond{t * std::cos(b), s * std::sin(a), s * std::cos(a), t * std::sin(b)});
}
std::vector<double> Random::values(int count, double size) {
  std::vector<double> result(count);
  for (double& x : result) x = uniform(-size, size);
  return result;
}

Symmetric3d random_inertia(double mass, double size, Random& random) {
  // The second moments a, b, c about a body's principal planes are positive; its principal moments are their pairwise
  // sums.
  const double scale = mass * size * size / 12;
  const double a = scale * random.uniform(0.05, 1), b = scale * random.uniform(0.05, 1),
               c = scale * random.uniform(0.05, 1);
  return rotate(random.rotation(), Symmetric3d::diagonal(b + c, a + c, a + b));
}

Model random_model(const RobotOptions& options, Random& random) {
  std::vector<BodyDescription> bodies = random_bodies(options, random);
  ModelBuilder builder;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (i + 1 == bodies.size() || random.chance(0.33)) {
      builder.add(FrameDescription{"e" + std::to_string(i), bodies[i].name, {random.rotation(), random.vector(0.5)}});
    }
  }
  for (std::size_t i = bodies.size(); i-- > 1;) std::swap(bodies[i], bodies[random.integer(0, static_cast<int>(i))]);
  for (const BodyDescription& b : bodies) builder.add(b);
  return builder.build();
}

State random_state(const Model& model, Random& random, double rate) {
  State state = zero_state(model);
  for (const Body& b : model.bodies()) {
    switch (b.description.joint.type) {
      case JointType::fixed:
        break;
      case JointType::free: {
        const Vector3d p = random.vector(10);
        for (int k = 0; k < 3; ++k) state.q[b.q + k] = p[k];
        random_quaternion(&state.q[b.q + 3], random);
        break;
      }
      case JointType::spherical:
        random_quaternion(&state.q[b.q], random);
        break;
      default:
        state.q[b.q] = random.uniform(-M_PI, M_PI);
        break;
    }
  }
  state.v = random.values(model.velocities(), rate);
  return state;
}

Forces random_forces(const Model& model, const State& state, Random& random) {
  Forces forces;
  forces.generalized = random.values(model.velocities(), 30);
  const Kinematics kinematics = forward_kinematics(model, state);
  const int count = random.integer(1, 3);
  for (int i = 0; i < count; ++i) {
    const int body = random.integer(0, static_cast<int>(model.bodies().size()) - 1);
    const Vector3d p_WP = kinematics.X_WB[body].p + random.vector(1);
    const Vector3d moment = random.vector(20);
    forces.external.push_back({body, p_WP, {moment, random.vector(20)}});
  }
  forces.gravity = random.vector(9.81);
  return forces;
}

}  // namespace grapnel::testing
