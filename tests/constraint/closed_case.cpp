#include "constraint/closed_case.hpp"

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "oracle/partitioned_dynamics.hpp"
#include "support/eigen_values.hpp"

namespace grapnel::testing {
namespace {

constexpr double kDependent = 1e-10, kIndependent = 1e-3;  // singular values of rows of length one

BodyDescription random_body(const std::string& name, const std::string& parent, double mass, double size,
                            Random& random) {
  BodyDescription b;
  b.name = name, b.parent = parent, b.joint.name = name + "_joint";
  b.mass = mass, b.com = random.vector(size / 3), b.inertia = random_inertia(mass, size, random);
  return b;
}

// A mount in a plane of constant z, turned about z, or anywhere.
Posed mount(bool planar, double reach, Random& random) {
  if (planar) {
    const double angle = random.uniform(-M_PI, M_PI);
    return {rotation_about({0, 0, 1}, angle), {random.uniform(-reach, reach), random.uniform(-reach, reach), 0}};
  }
  return {random.chance(0.3) ? Rotationd::identity() : random.rotation(), random.vector(reach)};
}

// Arm of `joints` moving joints; returns the name of its last body.
std::string add_arm(ModelBuilder& builder, int arm, int joints, bool planar, Random& random) {
  std::string last = "base";
  for (int j = 0; j < joints; ++j) {
    const std::string name = "a" + std::to_string(arm) + "_" + std::to_string(j);
    BodyDescription b = random_body(name, last, random.log_uniform(1, 20), 0.6, random);
    b.X_PF = mount(planar, 0.8, random);
    b.joint.type = random.chance(0.15) ? JointType::prismatic : JointType::revolute;
    b.joint.axis = random.chance(0.5) ? random.direction() : Vector3d::unit(random.integer(0, 2));
    if (planar) {
      const double angle = random.uniform(-M_PI, M_PI);
      b.joint.axis = b.joint.type == JointType::prismatic ? Vector3d{std::cos(angle), std::sin(angle), 0}
                                                          : Vector3d{0, 0, random.chance(0.5) ? 1.0 : -1.0};
    }
    if (random.chance(0.25)) {
      b.joint.rotor_inertia = random.log_uniform(1e-5, 1e-3), b.joint.gear_ratio = random.uniform(-100, 100);
    }
    builder.add(b);
    last = name;
  }
  if (random.chance(0.4)) {
    BodyDescription hand = random_body("hand" + std::to_string(arm), last, 0.8, 0.2, random);
    hand.X_PF = mount(planar, 0.3, random), hand.joint.type = JointType::fixed;
    builder.add(hand);
    last = hand.name;
  }
  return last;
}

std::string add_target(ModelBuilder& builder, int number, const std::string& parent, bool planar, Random& random) {
  BodyDescription t = random_body("target" + std::to_string(number), parent, random.log_uniform(5, 200), 1.0, random);
  t.X_PF = mount(planar, 0.5, random);
  const JointType planar_types[] = {JointType::fixed, JointType::revolute};
  const JointType types[] = {JointType::fixed, JointType::revolute, JointType::spherical};
  t.joint.type = planar ? planar_types[random.integer(0, 1)] : types[random.integer(0, 2)];
  t.joint.axis = planar ? Vector3d{0, 0, 1} : random.direction();
  builder.add(t);
  return t.name;
}

// Frames C and D at the present poses, so that the loop is closed.
LoopClosure close_here(const Model& model, const State& state, const std::string& hand, const std::string& target,
                       bool planar, Random& random) {
  LoopClosure c;
  c.name = hand + " on " + target;
  c.body_a = model.body_index(hand), c.body_b = model.body_index(target);
  c.X_AC = {planar ? Rotationd::identity() : random.rotation(), planar ? Vector3d{0.3, 0.1, 0} : random.vector(0.4)};
  const GraspModel models[] = {GraspModel::rigid, GraspModel::hinge, GraspModel::point};
  c.model = models[random.integer(0, 2)];
  c.hinge_C = planar ? Vector3d{0, 0, 1} : random.direction();
  const Kinematics k = forward_kinematics(model, state);
  c.X_BD = inverse(k.X_WB[c.body_b]) * (k.X_WB[c.body_a] * c.X_AC);
  return c;
}

ClosedCase draw(int index, int stream) {
  Random random(stream);
  const bool planar = index % 3 == 2;
  const int arms = 2 + index % 3 + (index % 7 == 6);
  ModelBuilder builder;
  BodyDescription base = random_body("base", "", random.log_uniform(20, 500), 1.2, random);
  const bool fixed = index % 5 == 4;
  base.joint.type = fixed ? JointType::fixed : JointType::free;
  if (fixed) base.X_PF = {random.rotation(), random.vector(2)};
  builder.add(base);
  std::vector<std::string> hands;
  for (int arm = 0; arm < arms; ++arm) {
    const int joints = planar ? random.integer(3, 4) : random.integer(3, 7);
    hands.push_back(add_arm(builder, arm, joints, planar, random));
  }
  // The second target is carried by arm 1; otherwise arm 1 holds the first target.
  const bool two_targets = arms > 2 && index % 2 == 1;
  std::vector<std::string> targets = {add_target(builder, 0, hands[0], planar, random)};
  if (two_targets) targets.push_back(add_target(builder, 1, hands[1], planar, random));
  ClosedCase c{builder.build(), {}, {}, {}};
  c.state = random_state(c.model, random, 1.5);
  for (int arm = two_targets ? 2 : 1; arm < arms; ++arm) {
    // Of three arms with two targets, two share one target.
    const std::string& target = targets[arm % 2 == 1 ? targets.size() - 1 : 0];
    c.closures.push_back(close_here(c.model, c.state, hands[arm], target, planar, random));
  }
  const oracle::MaximalSystem system(c.model, c.closures);
  c.state.v = system.close_velocities(oracle::maximal_state(c.model, c.state)).joints;
  Forces forces = random_forces(c.model, c.state, random);
  c.loads = {forces.generalized, forces.external, forces.gravity, {}, {}};
  return c;
}

int clear_rank(const Eigen::MatrixXd& M, const Eigen::MatrixXd& J, double& least, bool& clear) {
  if (J.rows() == 0 || J.cols() == 0) return 0;
  Eigen::MatrixXd Y = Eigen::LLT<Eigen::MatrixXd>(M).matrixL().solve(J.transpose());
  for (Eigen::Index i = 0; i < Y.cols(); ++i) {
    if (Y.col(i).norm() > 1e-9) Y.col(i).normalize();
  }
  int rank = 0;
  const Eigen::VectorXd sigma = Eigen::JacobiSVD<Eigen::MatrixXd>(Y).singularValues();
  for (double s : sigma) {
    rank += s >= kIndependent;
    if (s >= kIndependent) least = std::min(least, s);
    clear = clear && (s >= kIndependent || s <= kDependent);
  }
  return rank;
}

}  // namespace

ClosedCase random_closed(int index) {
  // Excludes near-singular loops, for which the references lose accuracy, and immobile systems.
  for (int draw_number = 0;; ++draw_number) {
    ClosedCase c = draw(index, index + 1'000'000 * draw_number);
    const DenseLoops dense(c.model, c.state, c.closures);
    if (dense.clear && dense.rank < c.model.velocities() && eigen(c.state.v).norm() > 0.1) return c;
  }
}

ClosedCase coupled_case(int index) {
  ClosedCase c = random_closed(index);
  Random random(700'000 + index);
  std::vector<int> joints = c.model.joints();
  ModelBuilder builder(c.model);
  for (int k = 0; k < 1 + index % 2; ++k) {
    const auto take = [&] {
      const auto at = joints.begin() + random.integer(0, static_cast<int>(joints.size()) - 1);
      const int body = *at;
      joints.erase(at);
      return body;
    };
    const BodyDescription& dependent = c.model.bodies()[take()].description;
    JointDescription joint = dependent.joint;
    for (int term = 0; term < 1 + index % 3 / 2; ++term)
      joint.mimic.push_back({c.model.bodies()[take()].description.joint.name, random.uniform(-2, 2), 0.1});
    builder.attach(dependent.name, dependent.parent, dependent.X_PF, joint);
  }
  c.model = std::move(builder).build();
  return c;
}

ClosedCase random_trees(int index) {
  for (int draw = 0;; ++draw) {
    Random random(index + 1'000'000 * (draw + 1));
    RobotOptions options;
    options.min_bodies = 8, options.max_bodies = 16;
    options.free_root = index % 3 != 2;
    options.spherical_joints = index % 4 == 1;
    options.targets = 1 + index % 3;
    ClosedCase c{random_model(options, random), {}, {}, {}};
    c.state = random_state(c.model, random);
    const Kinematics k = forward_kinematics(c.model, c.state);
    std::vector<int> links, targets;
    for (int i = 0; i < static_cast<int>(c.model.bodies().size()); ++i) {
      (c.model.bodies()[i].description.name[0] == 't' ? targets : links).push_back(i);
    }
    for (int t : targets) {
      for (int g = random.integer(1, 2); g > 0; --g) {
        const GraspModel models[] = {GraspModel::rigid, GraspModel::hinge, GraspModel::point};
        LoopClosure l;
        l.name = "hold";
        l.body_a = links[random.integer(0, static_cast<int>(links.size()) - 1)], l.body_b = t;
        if (index % 5 == 0) std::swap(l.body_a, l.body_b);
        l.model = models[random.integer(0, 2)];
        l.hinge_C = random.direction();
        const Posed X_WC{random.rotation(), k.X_WB[l.body_a].p + random.vector(0.5)};
        l.X_AC = inverse(k.X_WB[l.body_a]) * X_WC;
        l.X_BD = inverse(k.X_WB[l.body_b]) * X_WC;
        c.closures.push_back(l);
      }
    }
    c.loads.tau = random.values(c.model.velocities(), 5);
    c.loads.gravity = random.vector(5);
    const DenseLoops dense(c.model, c.state, c.closures);
    if (dense.clear && dense.least > 1e-2 && dense.rank > 0) return c;
  }
}

oracle::MaximalLoads with_prescribed(const ClosedCase& c, int index) {
  const DenseLoops all(c.model, c.state, c.closures);
  for (int draw_number = 0; draw_number < 40; ++draw_number) {
    Random random(500'000 + index + 1'000'000 * draw_number);
    oracle::MaximalLoads loads = c.loads;
    loads.prescribed.assign(c.model.velocities(), 0);
    loads.acceleration = random.values(c.model.velocities(), 2);
    bool any = false;
    for (const Body& b : c.model.bodies()) {
      const bool root = b.parent < 0;
      const bool chosen = random.chance(root ? 0.4 : draw_number < 20 ? 0.25 : 0.1);
      for (int k = 0; k < velocity_count(b.description.joint.type); ++k) {
        loads.prescribed[b.v + k] = chosen;
        any = any || chosen;
        if (chosen && root && index % 2 == 0) loads.acceleration[b.v + k] = 0;  // held
      }
    }
    const DenseLoops rest(c.model, c.state, c.closures, loads.prescribed);
    const bool moves = rest.rank < static_cast<int>(rest.free.size());
    if (any && moves && rest.clear && rest.rank == all.rank) return loads;
  }
  return c.loads;
}

DenseLoops::DenseLoops(const Model& model, const State& state, std::span<const LoopClosure> closures,
                       const std::vector<std::uint8_t>& prescribed)
    : M(mass_matrix(model, state)), J(closure_jacobian(model, forward_kinematics(model, state), closures)) {
  for (Eigen::Index k = 0; k < M.rows(); ++k) {
    if (prescribed.empty() || prescribed[static_cast<std::size_t>(k)] == 0) free.push_back(k);
  }
  M_free = M(free, free), J_free = J(Eigen::all, free);
  rank = clear_rank(M_free, J_free, least, clear);
}

Eigen::VectorXd DenseLoops::closed(const Eigen::VectorXd& v) const {
  const Eigen::LLT<Eigen::MatrixXd> mass(M_free);
  Eigen::MatrixXd A = mass.matrixL().solve(J_free.transpose()).transpose();
  Eigen::VectorXd slip = J * v;
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    const double length = A.row(i).norm();
    if (length > 1e-9) A.row(i) /= length, slip[i] /= length;
  }
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  svd.setThreshold(1e-7);
  Eigen::VectorXd result = v;
  result(free) -= mass.matrixU().solve(svd.solve(slip));
  return result;
}

Eigen::MatrixXd DenseLoops::contact_inertia() const {
  return J_free * Eigen::LLT<Eigen::MatrixXd>(M_free).solve(J_free.transpose());
}

DynamicsInput<double> dynamics_input(const Model& model, const State& state, const oracle::MaximalLoads& loads,
                                     Workspace& workspace) {
  forward_kinematics(model, state, workspace.kinematics);
  gather_external(model, loads.external, workspace);
  DynamicsInput<double> in;
  in.q = state.q, in.v = state.v, in.force = loads.tau, in.gravity = loads.gravity;
  in.prescribed = loads.prescribed, in.acceleration = loads.acceleration, in.link_wrench = workspace.link_wrench;
  return in;
}

State moved(const Model& model, const State& state, const Eigen::VectorXd& v, double step) {
  State result = state;
  for (const Body& b : model.bodies()) {
    const auto turn = [&](int q, Eigen::Index at) {
      const Eigen::Vector3d w = step * v.segment<3>(at);
      const Eigen::Quaterniond old(state.q[q], state.q[q + 1], state.q[q + 2], state.q[q + 3]);
      const Eigen::Quaterniond next =
          old * Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.norm() > 0 ? w.normalized() : w));
      result.q[q] = next.w(), result.q[q + 1] = next.x(), result.q[q + 2] = next.y(), result.q[q + 3] = next.z();
    };
    switch (b.description.joint.type) {
      case JointType::fixed:
        break;
      case JointType::free: {
        const Eigen::Vector3d p =
            eigen(root_pose(model, state, model.body_index(b.description.name)).R) * (step * v.segment<3>(b.v + 3));
        for (int k = 0; k < 3; ++k) result.q[b.q + k] += p[k];
        turn(b.q + 3, b.v);
        break;
      }
      case JointType::spherical:
        turn(b.q, b.v);
        break;
      default:
        result.q[b.q] += step * v[b.v];
    }
  }
  return result;
}

Eigen::VectorXd displacement(const Model& model, const State& from, const State& to) {
  Eigen::VectorXd d(model.velocities());
  for (const Body& b : model.bodies()) {
    const auto turn = [&](int q, Eigen::Index at) {
      const Eigen::Quaterniond first(from.q[q], from.q[q + 1], from.q[q + 2], from.q[q + 3]);
      const Eigen::Quaterniond second(to.q[q], to.q[q + 1], to.q[q + 2], to.q[q + 3]);
      const Eigen::Quaterniond relative = first.conjugate() * second;
      d.segment<3>(at) = (relative.w() < 0 ? -2.0 : 2.0) * relative.vec();
    };
    switch (b.description.joint.type) {
      case JointType::fixed:
        break;
      case JointType::free: {
        const Eigen::Matrix3d R = eigen(root_pose(model, from, model.body_index(b.description.name)).R);
        Eigen::Vector3d p;
        for (int k = 0; k < 3; ++k) p[k] = to.q[b.q + k] - from.q[b.q + k];
        d.segment<3>(b.v + 3) = R.transpose() * p;
        turn(b.q + 3, b.v);
        break;
      }
      case JointType::spherical:
        turn(b.q, b.v);
        break;
      default:
        d[b.v] = to.q[b.q] - from.q[b.q];
    }
  }
  return d;
}

}  // namespace grapnel::testing
