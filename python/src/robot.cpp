#include "robot.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "derivative_arrays.hpp"
#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/problem/target_motion.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::python {
namespace {

namespace fs = std::filesystem;

std::shared_ptr<const CaptureProblem> problem_of_file(const fs::path& file) {
  auto problem = std::make_shared<CaptureProblem>();
  problem->robot = load_robot(file);
  return problem;
}

CaptureSystem system_of(const CaptureProblem& problem, bool targets, const std::string& source) {
  try {
    return targets ? make_capture_system(problem) : make_servicer(problem);
  } catch (const CaptureProblemError& error) {
    throw input_error(source, error.what());
  } catch (const ModelError& error) {
    throw input_error(source, error.what());
  }
}

std::vector<std::string> joint_names(const Robot& robot) {
  std::vector<std::string> names;
  for (const int body : robot.model().joints()) names.push_back(robot.model().bodies()[body].description.joint.name);
  return names;
}
std::vector<std::string> joint_units(const Robot& robot) {
  std::vector<std::string> units;
  for (const int body : robot.model().joints())
    units.push_back(axis_units(robot.model().bodies()[body].description.joint.type).position);
  return units;
}
std::vector<std::string> body_names(const Robot& robot) {
  std::vector<std::string> names;
  for (const Body& body : robot.model().bodies()) names.push_back(body.description.name);
  return names;
}
std::vector<std::string> frame_names(const Robot& robot) {
  std::vector<std::string> names;
  for (const Frame& frame : robot.model().frames()) names.push_back(frame.name);
  return names;
}

// Names of coordinates or velocities, in their order.
void name_free(const std::string& body, bool velocities, std::vector<std::string>& names) {
  if (velocities) {
    for (const char* part : {"wx", "wy", "wz", "vx", "vy", "vz"}) names.push_back(body + "/" + part);
  } else {
    for (const char* part : {"x", "y", "z", "qw", "qx", "qy", "qz"}) names.push_back(body + "/" + part);
  }
}
std::vector<std::string> component_names(const Robot& robot, bool velocities) {
  // Parents come before children, for bodies as well as for the coordinates of their joints.
  std::vector<std::string> names;
  for (const Body& body : robot.model().bodies()) {
    const BodyDescription& description = body.description;
    if (has_one_axis(description.joint.type)) names.push_back(description.joint.name);
    if (description.joint.type == JointType::free) name_free(description.name, velocities, names);
  }
  return names;
}

py::array_t<double> limits(const Robot& robot, double JointLimits::*limit) {
  py::array_t<double> array(static_cast<py::ssize_t>(robot.model().joints().size()));
  double* out = array.mutable_data();
  for (const int body : robot.model().joints()) *out++ = robot.model().bodies()[body].description.joint.limits.*limit;
  return array;
}

// ---- Writing results ----

void put(double*& out, const Vector3d& v) {
  for (int i = 0; i < 3; ++i) *out++ = v[i];
}
template <SpatialKind kKind>
void put(double*& out, const SpatialVector<kKind, double>& v) {
  put(out, v.angular);
  put(out, v.linear);
}
void put(double*& out, const Eigen::MatrixXd& matrix) {
  for (Eigen::Index r = 0; r < matrix.rows(); ++r)
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) *out++ = matrix(r, c);
}

}  // namespace

// ---- Robot ----

Robot::Robot(const fs::path& file)
    : problem_(problem_of_file(file)), system_(system_of(*problem_, false, file.string())), states_(system_.model) {}

Robot::Robot(const Scenario& scenario, bool targets)
    : problem_(scenario.shared_problem()),
      has_problem_(true),
      system_(system_of(*problem_, targets, scenario.file().string())),
      states_(system_.model) {}

Robot::Robot(const Robot& free, CaptureSystem joined)
    : problem_(free.problem_), has_problem_(free.has_problem_), system_(std::move(joined)), states_(system_.model) {}

std::shared_ptr<Robot> Robot::holding(const py::object& q_given) const {
  if (!has_problem_ || system_.target_frames.size() != problem_->targets.size() || !system_.grasps.empty())
    throw py::value_error("this robot has no free targets to hold; expected Robot(problem, targets=True)");
  const Rows q = coordinates(q_given);
  if (q.is_batch()) throw py::value_error("q has shape " + q.shape() + ", expected q of one state");
  State state = zero_state(model());
  put_coordinates(q, 0, state.q.data());
  const Kinematics kinematics = forward_kinematics(model(), state);
  std::vector<HeldGrasp> grasps;
  for (std::size_t i = 0; i < problem_->grasps.size(); ++i) {
    if (!problem_->grasps[i].contact) grasps.push_back(hold_grasp(*problem_, system_, kinematics, i));
  }
  if (grasps.empty()) throw py::value_error("the problem has no grasps that hold");
  return std::shared_ptr<Robot>(new Robot(*this, join_targets(system_, state, grasps).system));
}

Robot::Place Robot::place(const std::string& name) const {
  for (const Frame& frame : model().frames())
    if (frame.name == name) return {frame.body, frame.X_BE};
  for (std::size_t i = 0; i < model().bodies().size(); ++i)
    if (model().bodies()[i].description.name == name) return {static_cast<int>(i), Posed::identity()};
  std::vector<std::string> names = frame_names(*this);
  for (std::string& body : body_names(*this)) names.push_back(std::move(body));
  throw py::value_error("no frame or body is named " + in_quotes(name) + suggestion(name, names, "frames and bodies"));
}

int Robot::body(const std::string& name) const {
  const std::vector<std::string> names = body_names(*this);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw py::value_error("no body is named " + in_quotes(name) + suggestion(name, names, "bodies"));
  return static_cast<int>(found - names.begin());
}

Rows Robot::coordinates(const py::handle& q) const {
  Rows rows(q, "q", model().coordinates(),
            "position and quaternion_wxyz per free body, angle or travel per joint (see Robot.q_names)");
  check_quaternions(rows);
  return rows;
}
Rows Robot::velocities(const py::handle& v, const char* name) const {
  return Rows(v, name, model().velocities(),
              "[angular; linear] in its own axes per free body, rate per joint (see Robot.v_names)");
}

Rows Robot::forces(const py::object& tau) const {
  if (tau.is_none()) return Rows("tau", model().velocities());
  const auto joints = static_cast<py::ssize_t>(model().joints().size());
  const py::array any = doubles(tau, "tau");
  const bool is_of_joints = any.ndim() > 0 && any.shape(any.ndim() - 1) == joints;
  return Rows(tau, "tau", is_of_joints ? joints : model().velocities(),
              "an effort per joint has " + std::to_string(joints) + " numbers, a generalized force per velocity " +
                  std::to_string(model().velocities()));
}

void Robot::spread(const Rows& forces, std::int64_t i, double* generalized) const {
  const double* row = forces.row(i);
  if (forces.width() == model().velocities()) {
    std::copy_n(row, forces.width(), generalized);
    return;
  }
  std::fill_n(generalized, model().velocities(), 0.0);
  for (const int body : model().joints()) generalized[model().bodies()[body].v] = *row++;
}

void Robot::check_quaternions(const Rows& q) const {
  constexpr double kSlack = 1e-6;
  for (std::int64_t i = 0; i < q.count(); ++i) {
    for (const int at : model().quaternions()) {
      const double* x = q.row(i) + at;
      const double size = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
      if (std::abs(size - 1) <= kSlack) continue;
      const std::string row = q.is_batch() ? std::to_string(i) + ", " : "";
      throw py::value_error(q.name() + "[" + row + std::to_string(at) + ":" + std::to_string(at + 4) +
                            "] is a quaternion of norm " + std::string(py::str(py::float_(size))) + "; expected 1");
    }
  }
}

void Robot::put_coordinates(const Rows& q, std::int64_t i, double* to) const {
  std::copy_n(q.row(i), q.width(), to);
  for (const int at : model().quaternions()) {
    double* x = to + at;
    const double size = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
    if (std::abs(size - 1) <= 1e-12) continue;  // unit norm within rounding error: keep the bits
    for (int k = 0; k < 4; ++k) x[k] /= size;
  }
}

// ---- Cases ----

void for_blocks(const Robot& robot, const Cases& cases,
                const std::function<void(Scratch&, std::int64_t, std::int64_t)>& block) {
  constexpr std::int64_t kMinForThreads = 64;
  // Multiples of the lane width. Larger blocks amortize the conversion of the model to lanes.
  constexpr std::int64_t kMinBlock = 16, kMaxBlock = 256, kPacks = 8;
  if (cases.count < kMinForThreads) {
    const Unlocked unlocked;
    Scratch scratch(robot.model());
    if (cases.count > 0) block(scratch, 0, cases.count);
    return;
  }
  const int workers = worker_count(0);
  const std::int64_t at_once = std::clamp(cases.count / (4 * workers) / kPacks * kPacks, kMinBlock, kMaxBlock);
  std::vector<std::unique_ptr<Scratch>> scratch(static_cast<std::size_t>(workers));
  run_interruptibly([&](const std::stop_token& stop) {
    for_each(cases.count, workers, at_once, stop, [&](int worker, std::int64_t begin, std::int64_t end) {
      auto& mine = scratch[static_cast<std::size_t>(worker)];
      if (!mine) mine = std::make_unique<Scratch>(robot.model());
      block(*mine, begin, end);
    });
  });
}

void for_cases(const Robot& robot, const Cases& cases, const std::function<void(Scratch&, std::int64_t)>& one) {
  for_blocks(robot, cases, [&](Scratch& scratch, std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) one(scratch, i);
  });
}

namespace {

std::size_t product(const std::vector<py::ssize_t>& shape) {
  std::size_t size = 1;
  for (const py::ssize_t n : shape) size *= static_cast<std::size_t>(n);
  return size;
}

// An argument's rows from case `begin` on, in the form of lanes; absent: zeros.
lanes::StateRows rows_from(const Rows* rows, std::int64_t begin) {
  if (rows == nullptr) return {};
  return {rows->row(begin), rows->is_batch() ? rows->width() : 0};
}

// States of the cases from `begin` to `end`, without requested outputs.
lanes::StateCases state_cases(const Robot& robot, const Rows& q, const Rows* v, std::int64_t begin, std::int64_t end,
                              Scratch& scratch) {
  const std::size_t width = static_cast<std::size_t>(robot.model().coordinates());
  scratch.block_q.resize(width * static_cast<std::size_t>(end - begin));
  for (std::int64_t i = begin; i < end; ++i)
    robot.put_coordinates(q, i, scratch.block_q.data() + width * static_cast<std::size_t>(i - begin));
  lanes::StateCases cases;
  cases.count = end - begin;
  cases.q = {scratch.block_q.data(), static_cast<std::int64_t>(width)};
  cases.v = rows_from(v, begin);
  return cases;
}

// An array that lanes compute: request(cases, scratch, begin, end, out) requests the outputs to `out`. `third`: a
// further argument with rows.
template <class Request>
py::array_t<double> by_lanes(const Robot& robot, const Rows& q, const Rows* v, const Rows* third,
                             std::vector<py::ssize_t> shape, const Vector3d& gravity, Request request) {
  const Rows nothing("nothing", 0);
  const Cases cases = cases_of({&q, v ? v : &nothing, third ? third : &nothing});
  const std::size_t size = product(shape);
  py::array_t<double> array = results(cases, std::move(shape));
  double* const data = array.mutable_data();
  for_blocks(robot, cases, [&](Scratch& scratch, std::int64_t begin, std::int64_t end) {
    lanes::StateCases of = state_cases(robot, q, v, begin, end, scratch);
    for (int k = 0; k < 3; ++k) of.gravity[k] = gravity[k];
    request(of, scratch, begin, end, data + static_cast<std::size_t>(begin) * size);
    robot.states().run(of);
  });
  return array;
}

// Kinematics, and with `masses` the mass matrix, of the cases of the block.
void compute_block(const Robot& robot, lanes::StateCases& of, bool masses, Scratch& scratch) {
  const std::size_t count = static_cast<std::size_t>(of.count);
  const std::size_t n = static_cast<std::size_t>(robot.model().velocities());
  scratch.block_motion.resize(count * scratch.kinematics.links.size() * lanes::kMotionNumbers);
  of.motion = scratch.block_motion.data();
  if (masses) {
    scratch.block_masses.resize(count * n * n);
    of.mass_matrix = scratch.block_masses.data();
  }
  robot.states().run(of);
}

Vector3d next_vector(const double*& in) {
  const Vector3d v{in[0], in[1], in[2]};
  in += 3;
  return v;
}

// Copies the k-th case of the block to `scratch`.
void take_case(const Robot& robot, const lanes::StateCases& of, std::int64_t k, Scratch& scratch) {
  const Model& model = robot.model();
  std::copy_n(of.q.data + k * of.q.stride, scratch.state.q.size(), scratch.state.q.begin());
  if (of.v.data) {
    std::copy_n(of.v.data + k * of.v.stride, scratch.state.v.size(), scratch.state.v.begin());
  } else {
    std::fill(scratch.state.v.begin(), scratch.state.v.end(), 0.0);
  }
  const double* in = of.motion + static_cast<std::size_t>(k) * scratch.kinematics.links.size() * lanes::kMotionNumbers;
  for (LinkMotion<double>& link : scratch.kinematics.links) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) link.X_WL.R(r, c) = *in++;
    link.X_WL.p = next_vector(in);
    link.V_WL.angular = next_vector(in);
    link.V_WL.linear = next_vector(in);
  }
  place_bodies(model, scratch.kinematics);
  if (!of.mass_matrix) return;
  const Eigen::Index n = model.velocities();
  scratch.mass_matrix = Eigen::Map<const Eigen::MatrixXd>(of.mass_matrix + k * n * n, n, n);  // symmetric
}

// Calls one(scratch, i, out) for every case with its part of the results. `scratch` has state and kinematics, and with
// `masses` the mass matrix. `others`: further arguments with rows.
template <class One>
py::array_t<double> by_kinematics(const Robot& robot, const Rows& q, const Rows* v, std::vector<py::ssize_t> shape,
                                  One one, bool masses = false, std::vector<const Rows*> others = {}) {
  others.push_back(&q);
  if (v) others.push_back(v);
  const Cases cases = cases_of(others);
  const std::size_t size = product(shape);
  py::array_t<double> array = results(cases, std::move(shape));
  double* const data = array.mutable_data();
  for_blocks(robot, cases, [&](Scratch& scratch, std::int64_t begin, std::int64_t end) {
    lanes::StateCases of = state_cases(robot, q, v, begin, end, scratch);
    compute_block(robot, of, masses, scratch);
    for (std::int64_t i = begin; i < end; ++i) {
      take_case(robot, of, i - begin, scratch);
      double* out = data + static_cast<std::size_t>(i) * size;
      one(scratch, i, out);
    }
  });
  return array;
}

}  // namespace

// ---- Kinematics ----

namespace {

py::array_t<double> frame_poses(const Robot& robot, const std::string& frame, const py::object& q_given) {
  const Robot::Place at = robot.place(frame);
  const Rows q = robot.coordinates(q_given);
  return by_kinematics(robot, q, nullptr, {4, 4}, [&](Scratch& scratch, std::int64_t, double* out) {
    const Posed X = scratch.kinematics.X_WB[static_cast<std::size_t>(at.body)] * at.X_BE;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) *out++ = X.R(r, c);
      *out++ = X.p[r];
    }
    for (int c = 0; c < 4; ++c) *out++ = c == 3 ? 1 : 0;
  });
}

py::array_t<double> frame_twists(const Robot& robot, const std::string& frame, const py::object& q_given,
                                 const py::object& v_given) {
  const Robot::Place at = robot.place(frame);
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given);
  return by_kinematics(robot, q, &v, {6}, [&](Scratch& scratch, std::int64_t, double* out) {
    const std::size_t body = static_cast<std::size_t>(at.body);
    put(out, shift(scratch.kinematics.V_WB[body], scratch.kinematics.X_WB[body].R * at.X_BE.p));
  });
}

py::array_t<double> jacobians(const Robot& robot, const std::string& frame, const py::object& q_given) {
  const Robot::Place at = robot.place(frame);
  const Rows q = robot.coordinates(q_given);
  const int n = robot.model().velocities();
  return by_kinematics(robot, q, nullptr, {6, n}, [&](Scratch& scratch, std::int64_t, double* out) {
    const Posed& X_WB = scratch.kinematics.X_WB[static_cast<std::size_t>(at.body)];
    Eigen::MatrixXd J(6, n);
    point_jacobian(robot.model(), scratch.kinematics, at.body, X_WB.p + X_WB.R * at.X_BE.p, J);
    put(out, J);
  });
}

// ---- Momentum and inertia ----

int joint_velocity_count(const Robot& robot) {
  return static_cast<int>(joint_velocities(robot.model(), robot.root()).size());
}
int base_velocity_count(const Robot& robot) { return robot.model().has_free_root(robot.root()) ? 6 : 0; }

py::array_t<double> generalized_jacobians(const Robot& robot, const std::string& frame, const py::object& q_given) {
  const Robot::Place at = robot.place(frame);
  const Rows q = robot.coordinates(q_given);
  if (robot.model().bodies()[static_cast<std::size_t>(at.body)].root != robot.root())
    throw py::value_error(in_quotes(frame) +
                          " is not on the robot; the generalized Jacobian requires a frame on the robot");
  const auto one = [&](Scratch& scratch, std::int64_t, double* out) {
    const Posed& X_WB = scratch.kinematics.X_WB[static_cast<std::size_t>(at.body)];
    put(out, generalized_jacobian(robot.model(), scratch.kinematics,
                                  mass_blocks(robot.model(), scratch.mass_matrix, robot.root()), robot.root(), at.body,
                                  X_WB.p + X_WB.R * at.X_BE.p));
  };
  return by_kinematics(robot, q, nullptr, {6, joint_velocity_count(robot)}, one, true);
}

py::array_t<double> mass_matrices(const Robot& robot, const py::object& q_given) {
  const Rows q = robot.coordinates(q_given);
  const int n = robot.model().velocities();
  return by_lanes(
      robot, q, nullptr, nullptr, {n, n}, Vector3d::zero(),
      [](lanes::StateCases& of, Scratch&, std::int64_t, std::int64_t, double* out) { of.mass_matrix = out; });
}

// A matrix computed from the blocks of the mass matrix.
template <class Function>
py::array_t<double> of_blocks(const Robot& robot, const py::object& q_given, int rows, int columns, Function function) {
  const Rows q = robot.coordinates(q_given);
  const auto one = [&](Scratch& scratch, std::int64_t, double* out) {
    put(out, Eigen::MatrixXd(function(mass_blocks(robot.model(), scratch.mass_matrix, robot.root()))));
  };
  return by_kinematics(robot, q, nullptr, {rows, columns}, one, true);
}

py::array_t<double> momenta(const Robot& robot, const py::object& q_given, const py::object& v_given,
                            const py::object& about) {
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given);
  const bool at_com = about.is_none();
  const Vector3d point = at_com ? Vector3d::zero() : vector_of(about, "about");
  return by_kinematics(robot, q, &v, {6}, [&](Scratch& scratch, std::int64_t, double* out) {
    put(out, momentum_about(robot.model(), scratch.kinematics,
                            at_com ? center_of_mass(robot.model(), scratch.kinematics) : point));
  });
}

py::array_t<double> base_twists(const Robot& robot, const py::object& q_given, const py::object& rates_given,
                                const py::object& momentum_given) {
  const Rows q = robot.coordinates(q_given);
  const std::vector<int> joints = joint_velocities(robot.model(), robot.root());
  const Rows rates(rates_given, "joint_rates", static_cast<py::ssize_t>(joints.size()),
                   "a rate per joint of the robot");
  const Rows momentum = momentum_given.is_none()
                            ? Rows("momentum", 6)
                            : Rows(momentum_given, "momentum", 6, "[angular about the centre of mass; linear] in W");
  if (base_velocity_count(robot) == 0) throw py::value_error("the base is fixed to the world: its twist is zero");
  const auto one = [&](Scratch& scratch, std::int64_t i, double* out) {
    for (std::size_t j = 0; j < joints.size(); ++j)
      scratch.state.v[static_cast<std::size_t>(joints[j])] = rates.row(i)[j];
    const double* h = momentum.row(i);
    put(out, base_twist_from_momentum(robot.model(), scratch.state, scratch.kinematics,
                                      mass_blocks(robot.model(), scratch.mass_matrix, robot.root()), robot.root(),
                                      Momentumd{{h[0], h[1], h[2]}, {h[3], h[4], h[5]}}));
  };
  return by_kinematics(robot, q, nullptr, {6}, one, true, {&rates, &momentum});
}

// ---- Dynamics ----

py::array_t<double> biases(const Robot& robot, const py::object& q_given, const py::object& v_given,
                           const py::object& gravity) {
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given);
  return by_lanes(robot, q, &v, nullptr, {robot.model().velocities()}, vector_of(gravity, "gravity"),
                  [](lanes::StateCases& of, Scratch&, std::int64_t, std::int64_t, double* out) { of.forces = out; });
}

py::array_t<double> forward(const Robot& robot, const py::object& q_given, const py::object& v_given,
                            const py::object& tau_given, const py::object& gravity) {
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given), tau = robot.forces(tau_given);
  const int n = robot.model().velocities();
  const auto request = [&](lanes::StateCases& of, Scratch& scratch, std::int64_t begin, std::int64_t end, double* out) {
    scratch.block_forces.resize(static_cast<std::size_t>((end - begin) * n));
    for (std::int64_t i = begin; i < end; ++i) robot.spread(tau, i, scratch.block_forces.data() + (i - begin) * n);
    of.force = {scratch.block_forces.data(), n};
    of.accelerations = out;
  };
  return by_lanes(robot, q, &v, &tau, {n}, vector_of(gravity, "gravity"), request);
}

py::array_t<double> inverse(const Robot& robot, const py::object& q_given, const py::object& v_given,
                            const py::object& vdot_given, const py::object& gravity) {
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given), vdot = robot.velocities(vdot_given, "vdot");
  const auto request = [&](lanes::StateCases& of, Scratch&, std::int64_t begin, std::int64_t, double* out) {
    of.acceleration = rows_from(&vdot, begin);
    of.forces = out;
  };
  return by_lanes(robot, q, &v, &vdot, {robot.model().velocities()}, vector_of(gravity, "gravity"), request);
}

// ---- Derivatives ----

// Arguments of derivatives; `third`: forces of forward, accelerations of inverse dynamics.
struct DerivativeCases {
  const Robot& robot;
  const Rows &q, &v, &third;
  const FrameWrenches& wrenches;
  Vector3d gravity;
  Cases cases;

  DerivativeCases(const Robot& of, const Rows& q_rows, const Rows& v_rows, const Rows& third_rows,
                  const FrameWrenches& applied, const py::object& g)
      : robot(of),
        q(q_rows),
        v(v_rows),
        third(third_rows),
        wrenches(applied),
        gravity(vector_of(g, "gravity")),
        cases(cases_of({&q, &v, &third})) {}

  // request(states, scratch, begin, end) requests the outputs of a block.
  template <class Request>
  void by_lanes(Request request) const {
    const std::vector<lanes::StateWrench> applied = wrenches.in_lanes(robot);
    for_blocks(robot, cases, [&](Scratch& scratch, std::int64_t begin, std::int64_t end) {
      lanes::StateCases of = state_cases(robot, q, &v, begin, end, scratch);
      for (int k = 0; k < 3; ++k) of.gravity[k] = gravity[k];
      of.wrenches = applied.data(), of.wrench_count = static_cast<int>(applied.size());
      request(of, scratch, begin, end);
      robot.states().run(of);
    });
  }

  // one(i, state, forces, workspace) for each case; for modal joints, which lanes do not support.
  template <class One>
  void one_by_one(One one) const {
    for_blocks(robot, cases, [&](Scratch& scratch, std::int64_t begin, std::int64_t end) {
      const auto workspace = make_derivatives_workspace(robot.model());
      Forces forces;
      forces.gravity = gravity;
      for (std::int64_t i = begin; i < end; ++i) {
        put_state(robot, q, v, i, scratch.state);
        wrenches.apply(robot, scratch.state, scratch.kinematics, forces);
        one(i, scratch.state, forces, *workspace);
      }
    });
  }
};

bool has_modal_joints(const Robot& robot) { return !robot.model().tree().chains.empty(); }

py::tuple forward_derivatives(const Robot& robot, const py::object& q_given, const py::object& v_given,
                              const py::object& tau_given, const py::object& gravity,
                              const std::vector<std::string>& frames, const py::object& wrenches_given,
                              bool base_held) {
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given), tau = robot.forces(tau_given);
  const FrameWrenches wrenches(robot, frames, wrenches_given);
  const DerivativeCases given(robot, q, v, tau, wrenches, gravity);
  const int n = robot.model().velocities();
  const PrescribedMotion held = held_base(robot, base_held);
  Vectors vdot(given.cases, n);
  Matrices dq(given.cases, n, n), dv(given.cases, n, n), dtau(given.cases, n, n);
  Matrices dwrench(given.cases, n, static_cast<py::ssize_t>(6 * frames.size()));
  if (has_modal_joints(robot)) {
    given.one_by_one([&](std::int64_t i, const State& state, Forces& forces, DerivativesWorkspace& workspace) {
      ForwardDynamicsDerivatives result;
      forces.generalized.resize(static_cast<std::size_t>(n));
      robot.spread(tau, i, forces.generalized.data());
      forward_dynamics_derivatives(robot.model(), state, forces, workspace, result, held);
      vdot.put(i, result.vdot), dq.put(i, result.dq), dv.put(i, result.dv), dtau.put(i, result.dtau);
      dwrench.put(i, result.dwrench);
    });
  } else {
    given.by_lanes([&](lanes::StateCases& of, Scratch& scratch, std::int64_t begin, std::int64_t end) {
      scratch.block_forces.resize(static_cast<std::size_t>((end - begin) * n));
      for (std::int64_t i = begin; i < end; ++i) robot.spread(tau, i, scratch.block_forces.data() + (i - begin) * n);
      of.force = {scratch.block_forces.data(), n};
      if (!held.prescribed.empty()) of.prescribed = held.prescribed.data();
      of.forward = {vdot.at(begin), dq.at(begin), dv.at(begin), dtau.at(begin), dwrench.at(begin)};
    });
  }
  return py::make_tuple(vdot.array, dq.array, dv.array, dtau.array, dwrench.array);
}

py::tuple inverse_derivatives(const Robot& robot, const py::object& q_given, const py::object& v_given,
                              const py::object& vdot_given, const py::object& gravity,
                              const std::vector<std::string>& frames, const py::object& wrenches_given) {
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given), vdot = robot.velocities(vdot_given, "vdot");
  const FrameWrenches wrenches(robot, frames, wrenches_given);
  const DerivativeCases given(robot, q, v, vdot, wrenches, gravity);
  const int n = robot.model().velocities();
  Vectors tau(given.cases, n);
  Matrices dq(given.cases, n, n), dv(given.cases, n, n), dvdot(given.cases, n, n);
  if (has_modal_joints(robot)) {
    given.one_by_one([&](std::int64_t i, const State& state, const Forces& forces, DerivativesWorkspace& workspace) {
      InverseDynamicsDerivatives result;
      const std::vector<double> accelerations(vdot.row(i), vdot.row(i) + n);
      inverse_dynamics_derivatives(robot.model(), state, accelerations, forces, workspace, result);
      tau.put(i, result.tau), dq.put(i, result.dq), dv.put(i, result.dv), dvdot.put(i, result.dvdot);
    });
  } else {
    given.by_lanes([&](lanes::StateCases& of, Scratch&, std::int64_t begin, std::int64_t) {
      of.acceleration = rows_from(&vdot, begin);
      of.inverse = {tau.at(begin), dq.at(begin), dv.at(begin), dvdot.at(begin), nullptr};
    });
  }
  return py::make_tuple(tau.array, dq.array, dv.array, dvdot.array);
}

// ---- States ----

py::tuple as_arrays(const State& state) {
  return py::make_tuple(py::array_t<double>(static_cast<py::ssize_t>(state.q.size()), state.q.data()),
                        py::array_t<double>(static_cast<py::ssize_t>(state.v.size()), state.v.data()));
}

py::tuple initial_state(const Robot& robot) {
  if (!robot.system().grasps.empty())
    throw py::value_error("the problem's run does not begin with the targets that this robot holds; specify q and v");
  if (!robot.has_problem()) return as_arrays(zero_state(robot.model()));
  State state;
  run_interruptibly([&](const std::stop_token& stop) {
    const CaptureProblem& problem = robot.problem();
    state = initial_servicer_state(problem, robot.system());
    if (robot.system().target_frames.empty()) return;
    const TargetPlan targets = plan_targets(problem, [&](double) {
      if (stop.stop_requested()) throw Stopped{};
    });
    for (std::size_t t = 0; t < targets.start.size(); ++t) {
      const int body = robot.model().frames()[static_cast<std::size_t>(robot.system().target_frames[t])].body;
      set_root_pose(robot.model(), body, targets.start[t].X_WT, state);
      set_root_twist(robot.model(), body, targets.start[t].V_WT, state);
    }
  });
  return as_arrays(state);
}

// The grasps of the problem: end-effector, target's body, pose of the grasp point on it, envelope.
py::list grasps(const Robot& robot) {
  py::list list;
  if (!robot.has_problem()) return list;
  for (const GraspSetup& grasp : robot.problem().grasps) {
    const GraspPoint& point = grasp_point_of(robot.problem(), grasp);
    py::dict one;
    one["end_effector"] = grasp.end_effector;
    one["target"] = target_body_name(grasp.target);
    one["point"] = grasp.grasp_point;
    one["position"] = py::make_tuple(point.X_TG.p[0], point.X_TG.p[1], point.X_TG.p[2]);
    const auto& envelope = end_effector_of(robot.problem(), grasp).envelope;
    one["envelope"] = py::none();
    if (envelope) {
      py::dict limits;
      limits["position"] = envelope->position, limits["angle"] = envelope->angle;
      limits["velocity"] = envelope->velocity, limits["angular_velocity"] = envelope->angular_velocity;
      one["envelope"] = limits;
    }
    list.append(one);
  }
  return list;
}

void bind_structure(py::class_<Robot, std::shared_ptr<Robot>>& robot) {
  robot.def(py::init<const fs::path&>(), py::arg("file"))
      .def(py::init<const Scenario&, bool>(), py::arg("problem"), py::arg("targets"))
      .def_property_readonly("name", &Robot::name)
      .def_property_readonly("joints", &joint_names)
      .def_property_readonly("joint_units", &joint_units)
      .def_property_readonly("bodies", &body_names)
      .def_property_readonly("frames", &frame_names)
      .def_property_readonly("base", [](const Robot& r) { return r.model().bodies()[r.root()].description.name; })
      .def_property_readonly("q_names", [](const Robot& r) { return component_names(r, false); })
      .def_property_readonly("v_names", [](const Robot& r) { return component_names(r, true); })
      .def_property_readonly("nq", [](const Robot& r) { return r.model().coordinates(); })
      .def_property_readonly("nv", [](const Robot& r) { return r.model().velocities(); })
      .def_property_readonly("nu", [](const Robot& r) { return r.model().joints().size(); })
      .def_property_readonly("mass", [](const Robot& r) { return r.model().mass(); })
      .def_property_readonly("lower", [](const Robot& r) { return limits(r, &JointLimits::lower); })
      .def_property_readonly("upper", [](const Robot& r) { return limits(r, &JointLimits::upper); })
      .def_property_readonly("rate_limit", [](const Robot& r) { return limits(r, &JointLimits::rate); })
      .def_property_readonly("effort_limit", [](const Robot& r) { return limits(r, &JointLimits::effort); })
      .def_property_readonly("joint_q",
                             [](const Robot& r) {
                               std::vector<int> at;
                               for (const int body : r.model().joints()) at.push_back(r.model().bodies()[body].q);
                               return at;
                             })
      .def_property_readonly("joint_v",
                             [](const Robot& r) {
                               std::vector<int> at;
                               for (const int body : r.model().joints()) at.push_back(r.model().bodies()[body].v);
                               return at;
                             })
      .def(
          "body_q",
          [](const Robot& r, const std::string& name) {
            const Body& body = r.model().bodies()[static_cast<std::size_t>(r.body(name))];
            return body.description.joint.type == JointType::free ? body.q : -1;
          },
          py::arg("body"))
      .def(
          "body_v",
          [](const Robot& r, const std::string& name) {
            const Body& body = r.model().bodies()[static_cast<std::size_t>(r.body(name))];
            return body.description.joint.type == JointType::free ? body.v : -1;
          },
          py::arg("body"))
      .def_property_readonly("gravity",
                             [](const Robot& r) {
                               const Vector3d& g = r.problem().gravity;
                               return py::make_tuple(g[0], g[1], g[2]);
                             })
      .def_property_readonly("is_base_held",
                             [](const Robot& r) { return r.problem().robot.base_mode == RobotSetup::Base::held; })
      .def_property_readonly("approach_duration",
                             [](const Robot& r) { return r.problem().approach ? r.problem().approach->duration : 0.0; })
      .def_property_readonly("grasps", &grasps)
      .def("zero_state", [](const Robot& r) { return as_arrays(zero_state(r.model())); })
      .def("initial_state", &initial_state);
}

}  // namespace

void bind_robot(py::module_& module) {
  py::class_<Robot, std::shared_ptr<Robot>> robot(module, "Robot");
  bind_structure(robot);
  robot.def("frame_pose", &frame_poses, py::arg("frame"), py::arg("q"))
      .def("frame_twist", &frame_twists, py::arg("frame"), py::arg("q"), py::arg("v"))
      .def("jacobian", &jacobians, py::arg("frame"), py::arg("q"))
      .def("generalized_jacobian", &generalized_jacobians, py::arg("frame"), py::arg("q"))
      .def("mass_matrix", &mass_matrices, py::arg("q"))
      .def(
          "base_inertia",
          [](const Robot& r, const py::object& q) {
            const int b = base_velocity_count(r);
            return of_blocks(r, q, b, b, [](const MassBlocks& blocks) { return blocks.I_b; });
          },
          py::arg("q"))
      .def(
          "coupling_inertia",
          [](const Robot& r, const py::object& q) {
            return of_blocks(r, q, base_velocity_count(r), joint_velocity_count(r),
                             [](const MassBlocks& blocks) { return blocks.I_bm; });
          },
          py::arg("q"))
      .def(
          "generalized_inertia",
          [](const Robot& r, const py::object& q) {
            const int n = joint_velocity_count(r);
            return of_blocks(r, q, n, n, [](const MassBlocks& blocks) { return generalized_inertia(blocks); });
          },
          py::arg("q"))
      .def(
          "center_of_mass",
          [](const Robot& r, const py::object& q_given) {
            const Rows q = r.coordinates(q_given);
            return by_kinematics(r, q, nullptr, {3}, [&](Scratch& s, std::int64_t, double* out) {
              put(out, center_of_mass(r.model(), s.kinematics));
            });
          },
          py::arg("q"))
      .def(
          "kinetic_energy",
          [](const Robot& r, const py::object& q_given, const py::object& v_given) {
            const Rows q = r.coordinates(q_given), v = r.velocities(v_given);
            return by_kinematics(r, q, &v, {}, [&](Scratch& s, std::int64_t, double* out) {
              *out = kinetic_energy(r.model(), s.kinematics, s.state);
            });
          },
          py::arg("q"), py::arg("v"))
      .def("momentum", &momenta, py::arg("q"), py::arg("v"), py::arg("about"))
      .def("base_twist", &base_twists, py::arg("q"), py::arg("joint_rates"), py::arg("momentum"))
      .def("bias", &biases, py::arg("q"), py::arg("v"), py::arg("gravity"))
      .def("forward_dynamics", &forward, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("gravity"))
      .def("inverse_dynamics", &inverse, py::arg("q"), py::arg("v"), py::arg("vdot"), py::arg("gravity"))
      .def("forward_dynamics_derivatives", &forward_derivatives, py::arg("q"), py::arg("v"), py::arg("tau"),
           py::arg("gravity"), py::arg("frames"), py::arg("wrenches"), py::arg("base_held"))
      .def("inverse_dynamics_derivatives", &inverse_derivatives, py::arg("q"), py::arg("v"), py::arg("vdot"),
           py::arg("gravity"), py::arg("frames"), py::arg("wrenches"));
  bind_constraints(robot, module);
  bind_identify(robot, module);
  bind_rollout(module);
}

}  // namespace grapnel::python
