// Closed loops and impacts of a robot.
#include <pybind11/stl.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <tuple>

#include "derivative_arrays.hpp"
#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/constraint/loop_derivatives.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/text/message_text.hpp"
#include "robot.hpp"

namespace grapnel::python {
namespace {

GraspModel model_named(const std::string& name) {
  if (name == "rigid") return GraspModel::rigid;
  if (name == "hinge") return GraspModel::hinge;
  if (name == "point") return GraspModel::point;
  throw py::value_error("kind is " + in_quotes(name) + suggestion(name, {"rigid", "hinge", "point"}));
}

Vector3d axis_of(const py::object& axis) {
  if (axis.is_none()) return {0, 0, 1};
  const Vector3d a = vector_of(axis, "axis");
  const double size = norm(a);
  if (!(size > 0)) throw py::value_error("axis has no direction; expected a nonzero vector");
  return (1 / size) * a;
}

// ---- Loops ----

// One closure as given in Python: frames a and b, kind, axis of a hinge.
using ClosureNames = std::tuple<std::string, std::string, std::string, py::object>;

class Loops {
 public:
  Loops(std::shared_ptr<Robot> robot, const std::vector<ClosureNames>& names, const py::object& q_closed)
      : robot_(std::move(robot)) {
    for (const auto& [a, b, kind, axis] : names) {
      const Robot::Place at_a = robot_->place(a), at_b = robot_->place(b);
      closures_.push_back(
          {a + " to " + b, at_a.body, at_a.X_BE, at_b.body, at_b.X_BE, model_named(kind), axis_of(axis)});
    }
    if (closures_.empty()) throw py::value_error("there are no closures; expected at least one pair of frames");
    if (!q_closed.is_none()) close_at(q_closed);
    LoopSolver(robot_->model(), closures_);  // throws if they are not valid
  }

  const Robot& robot() const { return *robot_; }
  const std::vector<LoopClosure>& closures() const { return closures_; }
  /// Of closures and couplings, as LoopSolver's.
  int rows() const { return closure_rows(closures_) + static_cast<int>(robot_->model().couplings().size()); }

 private:
  // Places frame D at frame C in these coordinates, so that the loop is closed there.
  void close_at(const py::object& q_closed) {
    const Rows q = robot_->coordinates(q_closed);
    if (q.is_batch()) throw py::value_error("closed_at has shape " + q.shape() + ", expected q of one state");
    State state = zero_state(robot_->model());
    robot_->put_coordinates(q, 0, state.q.data());
    const Kinematics kinematics = forward_kinematics(robot_->model(), state);
    for (LoopClosure& closure : closures_) {
      const Posed X_WC = kinematics.X_WB[static_cast<std::size_t>(closure.body_a)] * closure.X_AC;
      closure.X_BD = inverse(kinematics.X_WB[static_cast<std::size_t>(closure.body_b)]) * X_WC;
    }
  }

  std::shared_ptr<Robot> robot_;
  std::vector<LoopClosure> closures_;
};

// One solver per worker, created on first use.
class Solvers {
 public:
  explicit Solvers(const Loops& loops) : loops_(loops) {}
  LoopSolver& of(const Scratch* scratch) {
    const std::lock_guard lock(mutex_);
    for (auto& [owner, solver] : used_)
      if (owner == scratch) return *solver;
    used_.emplace_back(scratch, std::make_unique<LoopSolver>(loops_.robot().model(), loops_.closures()));
    return *used_.back().second;
  }

 private:
  const Loops& loops_;
  std::mutex mutex_;
  std::vector<std::pair<const Scratch*, std::unique_ptr<LoopSolver>>> used_;
};

struct LoopStates {
  Rows q, v;
  Cases cases;
  LoopStates(const Loops& loops, const py::object& q_given, const py::object& v_given)
      : q(loops.robot().coordinates(q_given)),
        v(v_given.is_none() ? Rows("v", loops.robot().model().velocities()) : loops.robot().velocities(v_given)),
        cases(cases_of({&q, &v})) {}
  void put(const Loops& loops, std::int64_t i, State& state) const {
    loops.robot().put_coordinates(q, i, state.q.data());
    std::copy_n(v.row(i), v.width(), state.v.begin());
  }
};

py::array_t<double> defects(const Loops& loops, const py::object& q, const py::object& v) {
  const LoopStates states(loops, q, v);
  const std::size_t count = loops.closures().size();
  py::array_t<double> array = results(states.cases, {static_cast<py::ssize_t>(count), 4});
  double* const data = array.mutable_data();
  for_cases(loops.robot(), states.cases, [&](Scratch& scratch, std::int64_t i) {
    states.put(loops, i, scratch.state);
    forward_kinematics(loops.robot().model(), scratch.state, scratch.kinematics);
    double* out = data + i * static_cast<std::int64_t>(4 * count);
    for (const LoopClosure& closure : loops.closures()) {
      const ClosureDefect defect = closure_defect(closure, scratch.kinematics);
      for (const double x : {defect.position, defect.angle, defect.velocity, defect.angular_velocity}) *out++ = x;
    }
  });
  return array;
}

py::tuple loop_dynamics(const Loops& loops, const py::object& q, const py::object& v, const py::object& tau_given,
                        const std::array<double, 3>& gravity) {
  const Rows tau = loops.robot().forces(tau_given);
  LoopStates states(loops, q, v);
  states.cases = cases_of({&states.q, &states.v, &tau});
  const py::ssize_t n = loops.robot().model().velocities(), rows = loops.rows();
  py::array_t<double> vdot = results(states.cases, {n}), multipliers = results(states.cases, {rows});
  double *const vdot_data = vdot.mutable_data(), *const multiplier_data = multipliers.mutable_data();
  Solvers solvers(loops);
  for_cases(loops.robot(), states.cases, [&](Scratch& scratch, std::int64_t i) {
    states.put(loops, i, scratch.state);
    loops.robot().spread(tau, i, scratch.generalized.data());
    scratch.rates.resize(static_cast<std::size_t>(n));
    DynamicsInput<double> in;
    in.q = scratch.state.q, in.v = scratch.state.v, in.force = scratch.generalized;
    in.gravity = {gravity[0], gravity[1], gravity[2]};
    LoopSolver& solver = solvers.of(&scratch);
    std::vector<double> force(static_cast<std::size_t>(n));
    solver.accelerations(in, 0, scratch.workspace, scratch.rates, force);
    std::copy(scratch.rates.begin(), scratch.rates.end(), vdot_data + n * i);
    const std::span<const double> found = solver.multipliers();
    std::copy(found.begin(), found.end(), multiplier_data + rows * i);
  });
  return py::make_tuple(vdot, multipliers);
}

py::tuple loop_derivatives(const Loops& loops, const py::object& q_given, const py::object& v_given,
                           const py::object& tau_given, const std::array<double, 3>& gravity,
                           const std::vector<std::string>& frames, const py::object& wrenches_given, bool base_held) {
  const Robot& robot = loops.robot();
  const Rows tau = robot.forces(tau_given);
  LoopStates states(loops, q_given, v_given);
  states.cases = cases_of({&states.q, &states.v, &tau});
  const FrameWrenches wrenches(robot, frames, wrenches_given);
  const PrescribedMotion held = held_base(robot, base_held);
  const Cases& cases = states.cases;
  const py::ssize_t n = robot.model().velocities(), rows = loops.rows();
  const auto wide = static_cast<py::ssize_t>(6 * frames.size());
  Vectors vdot(cases, n), multipliers(cases, rows), rank(cases, 1), contradiction(cases, 1);
  Matrices dq(cases, n, n), dv(cases, n, n), dtau(cases, n, n), dwrench(cases, n, wide), closing(cases, n, n);
  Matrices by_q(cases, rows, n), by_v(cases, rows, n), by_tau(cases, rows, n), by_wrench(cases, rows, wide);
  for_blocks(robot, cases, [&](Scratch& scratch, std::int64_t begin, std::int64_t end) {
    LoopDerivatives derivatives(robot.model(), loops.closures());
    LoopDynamicsDerivatives d;
    Forces forces;
    forces.gravity = {gravity[0], gravity[1], gravity[2]}, forces.generalized.resize(static_cast<std::size_t>(n));
    for (std::int64_t i = begin; i < end; ++i) {
      states.put(loops, i, scratch.state);
      robot.spread(tau, i, forces.generalized.data());
      wrenches.apply(robot, scratch.state, scratch.kinematics, forces);
      derivatives.evaluate(scratch.state, forces, held, 0, d);
      vdot.put(i, d.motion.vdot), multipliers.put(i, d.multipliers.value);
      dq.put(i, d.motion.dq), dv.put(i, d.motion.dv), dtau.put(i, d.motion.dtau), dwrench.put(i, d.motion.dwrench);
      by_q.put(i, d.multipliers.dq), by_v.put(i, d.multipliers.dv), by_tau.put(i, d.multipliers.dtau);
      by_wrench.put(i, d.multipliers.dwrench), closing.put(i, d.closing_dq);
      rank.put(i, {static_cast<double>(d.rank)});
      contradiction.put(i, {std::max(d.contradiction, d.contradiction_of_derivatives)});
    }
  });
  return py::make_tuple(vdot.array, dq.array, dv.array, dtau.array, dwrench.array, multipliers.array, by_q.array,
                        by_v.array, by_tau.array, by_wrench.array, closing.array, rank.array, contradiction.array);
}

py::array_t<double> closing_velocities(const Loops& loops, const py::object& q, const py::object& v) {
  const LoopStates states(loops, q, v);
  const py::ssize_t n = loops.robot().model().velocities();
  py::array_t<double> array = results(states.cases, {n});
  double* const data = array.mutable_data();
  Solvers solvers(loops);
  for_cases(loops.robot(), states.cases, [&](Scratch& scratch, std::int64_t i) {
    states.put(loops, i, scratch.state);
    solvers.of(&scratch).close_velocities(scratch.state.q, {}, scratch.workspace, scratch.state.v);
    std::copy(scratch.state.v.begin(), scratch.state.v.end(), data + n * i);
  });
  return array;
}

py::tuple projected(const Loops& loops, const py::object& q, const py::object& v) {
  const LoopStates states(loops, q, v);
  const py::ssize_t nq = loops.robot().model().coordinates(), nv = loops.robot().model().velocities();
  py::array_t<double> q_array = results(states.cases, {nq}), v_array = results(states.cases, {nv});
  py::array_t<double> converged = results(states.cases, {});
  double *const q_data = q_array.mutable_data(), *const v_data = v_array.mutable_data();
  double* const converged_data = converged.mutable_data();
  Solvers solvers(loops);
  for_cases(loops.robot(), states.cases, [&](Scratch& scratch, std::int64_t i) {
    states.put(loops, i, scratch.state);
    const ProjectionResult result =
        solvers.of(&scratch).project({}, scratch.workspace, scratch.state.q, scratch.state.v);
    std::copy(scratch.state.q.begin(), scratch.state.q.end(), q_data + nq * i);
    std::copy(scratch.state.v.begin(), scratch.state.v.end(), v_data + nv * i);
    converged_data[i] = result.converged ? 1 : 0;
  });
  return py::make_tuple(q_array, v_array, converged);
}

// ---- Impacts ----

struct GraspChoice {
  Robot::Place end_effector;
  int target;
  GraspModel model;
  Vector3d axis;  // of a hinge, in the end-effector's frame
};

std::vector<GraspChoice> choices(const Robot& robot, const std::vector<ClosureNames>& names) {
  std::vector<GraspChoice> grasps;
  for (const auto& [end_effector, target, kind, axis] : names) {
    const Robot::Place at = robot.place(end_effector);
    const int body = robot.body(target);
    if (at.body == body)
      throw py::value_error(in_quotes(end_effector) + " is on " + in_quotes(target) +
                            " itself; a grasp joins two bodies");
    grasps.push_back({at, body, model_named(kind), axis_of(axis)});
  }
  if (grasps.empty())
    throw py::value_error("there are no grasps; expected at least one pair of end-effector and target");
  return grasps;
}

py::dict impact(const Robot& robot, const py::object& q_given, const py::object& v_given,
                const std::vector<ClosureNames>& names, bool braked) {
  const Rows q = robot.coordinates(q_given), v = robot.velocities(v_given);
  const Cases cases = cases_of({&q, &v});
  const std::vector<GraspChoice> grasps = choices(robot, names);
  std::vector<HeldRate> held;
  if (braked)
    for (const int body : robot.model().joints()) held.push_back({robot.model().bodies()[body].v, 0});
  const py::ssize_t n = robot.model().velocities(), count = static_cast<py::ssize_t>(grasps.size());
  py::array_t<double> velocity = results(cases, {n}), impulse = results(cases, {count, 6}),
                      point = results(cases, {count, 3});
  py::array_t<double> determined = results(cases, {count, 6});
  py::array_t<double> before = results(cases, {}), after = results(cases, {}), rank = results(cases, {});
  py::array_t<double> residual = results(cases, {});
  double *const v_out = velocity.mutable_data(), *const P_out = impulse.mutable_data(),
                *const p_out = point.mutable_data();
  double *const determined_out = determined.mutable_data(), *const before_out = before.mutable_data();
  double *const after_out = after.mutable_data(), *const rank_out = rank.mutable_data();
  double* const residual_out = residual.mutable_data();
  for_cases(robot, cases, [&](Scratch& scratch, std::int64_t i) {
    robot.put_coordinates(q, i, scratch.state.q.data());
    std::copy_n(v.row(i), n, scratch.state.v.begin());
    forward_kinematics(robot.model(), scratch.state, scratch.kinematics);
    std::vector<Grasp> at;
    for (const GraspChoice& g : grasps) {
      const Posed X_WE = scratch.kinematics.X_WB[static_cast<std::size_t>(g.end_effector.body)] * g.end_effector.X_BE;
      at.push_back({g.end_effector.body, g.target, g.model, X_WE.p, X_WE.R * g.axis});
    }
    const ImpactSolution solution = plastic_impact(robot.model(), scratch.state, at, held);
    std::copy(solution.velocity.begin(), solution.velocity.end(), v_out + n * i);
    for (py::ssize_t g = 0; g < count; ++g) {
      const ContactImpulse& contact = solution.contacts[static_cast<std::size_t>(g)];
      const std::int64_t at_g = i * count + g;
      for (int k = 0; k < 3; ++k) {
        P_out[6 * at_g + k] = contact.P_WC.angular[k], P_out[6 * at_g + 3 + k] = contact.P_WC.linear[k];
        p_out[3 * at_g + k] = at[static_cast<std::size_t>(g)].p_WC[k];
      }
      for (std::size_t k = 0; k < 6; ++k)
        determined_out[6 * at_g + static_cast<std::int64_t>(k)] = contact.determined[k] ? 1 : 0;
    }
    before_out[i] = solution.kinetic_energy_before, after_out[i] = solution.kinetic_energy_after;
    rank_out[i] = solution.rank, residual_out[i] = solution.generalized_momentum_residual;
  });
  py::dict found;
  found["velocity"] = velocity, found["impulse"] = impulse, found["contact_point"] = point;
  found["determined"] = determined, found["kinetic_energy_before"] = before, found["kinetic_energy_after"] = after;
  found["rank"] = rank, found["generalized_momentum_residual"] = residual;
  return found;
}

}  // namespace

void bind_constraints(py::class_<Robot, std::shared_ptr<Robot>>& robot, py::module_& module) {
  robot.def("impact", &impact, py::arg("q"), py::arg("v"), py::arg("grasps"), py::arg("braked"));
  py::class_<Loops>(module, "Loops")
      .def(py::init<std::shared_ptr<Robot>, const std::vector<ClosureNames>&, const py::object&>(), py::arg("robot"),
           py::arg("closures"), py::arg("closed_at"))
      .def_property_readonly("rows", &Loops::rows)
      .def("defect", &defects, py::arg("q"), py::arg("v"))
      .def("forward_dynamics", &loop_dynamics, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("gravity"))
      .def("forward_dynamics_derivatives", &loop_derivatives, py::arg("q"), py::arg("v"), py::arg("tau"),
           py::arg("gravity"), py::arg("frames"), py::arg("wrenches"), py::arg("base_held"))
      .def("close_velocities", &closing_velocities, py::arg("q"), py::arg("v"))
      .def("project", &projected, py::arg("q"), py::arg("v"));
}

}  // namespace grapnel::python
