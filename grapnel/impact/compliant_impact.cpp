#include "grapnel/impact/compliant_impact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "grapnel/impact/compliant_scales.hpp"
#include "grapnel/impact/compliant_stepper.hpp"

namespace grapnel {

namespace {

// Relative speeds below this fraction of the largest are rounding errors.
constexpr double kNoSpeed = 1e-12;
// Fraction of the springs' shortest time scale: a pushed contact at rest is detected at the end of the first step.
constexpr double kFirstStep = 1e-4;
// As for motion phases.
constexpr long kMaxShapeChanges = 100'000;

// The error estimate is that of a method of order 5, far above the error of the method of order 9. With this tolerance
// the interpolating polynomial, of order 6, is about as accurate as the requested tolerance, and the ends are more
// accurate.
double step_tolerance(double relative) { return std::pow(relative, 0.75); }

void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument("compliant_impact: " + what);
}

bool positive(double x) { return x > 0 && std::isfinite(x); }
bool not_negative(double x) { return x >= 0 && std::isfinite(x); }
bool unit(const Vector3d& x) { return std::abs(norm(x) - 1) < 1e-9; }
bool finite(const Vector3d& x) { return std::isfinite(x[0]) && std::isfinite(x[1]) && std::isfinite(x[2]); }

void check_bodies(const Model& model, int robot, int target, const Vector3d& p_WC, const std::string& who) {
  const int count = static_cast<int>(model.bodies().size());
  require(robot >= 0 && robot < count && target >= 0 && target < count, who + ": a body is not in the model");
  require(robot != target, who + ": both sides are the same body");
  require(finite(p_WC), who + ": the point is not finite");
}

void check_contact(const Model& model, const CompliantContact& c, std::size_t index) {
  const std::string who = fmt::format("contact {}", index + 1);
  check_bodies(model, c.robot_body, c.target_body, c.p_WC, who);
  require(unit(c.n_W), who + ": the normal must be a unit vector");
  require(positive(c.stiffness), who + ": stiffness must be positive");
  require(c.model == ContactForceModel::hertz || not_negative(c.damping), who + ": damping must not be negative");
  require(c.model != ContactForceModel::hunt_crossley || (c.exponent >= 1 && c.exponent <= 10),
          who + ": exponent must lie in 1 to 10");
  require(not_negative(c.friction), who + ": friction must not be negative");
  require(c.friction == 0 || positive(c.slip_speed), who + ": slip_speed must be positive");
}

void check_grasp(const Model& model, const CompliantGrasp& g, std::size_t index) {
  const std::string who = fmt::format("grasp {}", index + 1);
  check_bodies(model, g.grasp.robot_body, g.grasp.target_body, g.grasp.p_WC, who);
  require(positive(g.linear_stiffness), who + ": linear_stiffness must be positive");
  require(not_negative(g.linear_damping), who + ": linear_damping must not be negative");
  if (g.grasp.model == GraspModel::point) return;
  require(positive(g.angular_stiffness), who + ": angular_stiffness must be positive");
  require(not_negative(g.angular_damping), who + ": angular_damping must not be negative");
  require(g.grasp.model != GraspModel::hinge || unit(g.grasp.hinge_W), who + ": the hinge must be a unit vector");
}

// Held velocities => nothing; throws std::invalid_argument for unknown or repeated ones and for a partly held free root
// or spherical joint.
void check_held(const Model& model, std::span<const int> held) {
  std::vector<int> marks(model.velocities());
  for (int v : held) {
    require(v >= 0 && v < model.velocities(), "a held velocity is not in the model");
    require(++marks[v] == 1, "a velocity is held twice");
  }
  for (const Body& b : model.bodies()) {
    const int count = velocity_count(b.description.joint.type);
    for (int k = 1; k < count; ++k) {
      require(marks[b.v] == marks[b.v + k],
              "either all velocities of a free root or a spherical joint or none can be held");
    }
  }
}

// Model, state, setup => nothing; throws std::invalid_argument for wrong sizes, numbers that are not finite and
// settings out of range.
void check(const Model& model, const State& state, const CompliantSetup& setup) {
  require(
      static_cast<int>(state.q.size()) == model.coordinates() && static_cast<int>(state.v.size()) == model.velocities(),
      "the state's size differs from the model's");
  for (double x : state.q) require(std::isfinite(x), "the state is not finite");
  for (double x : state.v) require(std::isfinite(x), "the state is not finite");
  require(positive(setup.longest), "longest must be positive");
  require(setup.settled > 0 && setup.settled < 1, "settled must lie between 0 and 1");
  require(setup.relative_tolerance >= 1e-14 && setup.relative_tolerance <= 1e-2,
          "relative_tolerance must lie in 1e-14 to 1e-2");
  require(setup.samples >= 2, "samples must be at least 2");
  require(setup.max_steps > 0, "max_steps must be positive");
}

// One impact in progress.
class Run {
 public:
  Run(const Model& model, const State& state, std::span<const CompliantContact> contacts,
      std::span<const CompliantGrasp> grasps, const CompliantSetup& setup, std::span<const int> held,
      const std::function<void(double t)>& each_step, ImpactDrive* drive, ImpactShapes* shapes,
      std::span<const LoopClosure> loops)
      : model_(model),
        state_(state),
        contacts_(contacts),
        grasps_(grasps),
        setup_(setup),
        held_(held),
        each_step_(each_step),
        drive_(drive),
        system_(model, state, contacts, grasps, held, drive, lanes::best_instruction_set(), loops) {
    if (shapes) system_.attach(*shapes);
  }

  ImpactSolution outcome();

 private:
  void choose_first_phases(std::span<const double> y);
  void integrate(StiffIntegrator& integrator, CompliantRecorder& recorder);
  bool follow_events(StiffIntegrator& integrator, CompliantRecorder& recorder, bool event);
  void enter(std::size_t contact, ContactPhase next);
  std::vector<double> begin_shapes(double t, std::span<const double> y);
  void change_shapes(StiffIntegrator& integrator);
  void observe_shapes(StiffIntegrator& integrator);
  std::vector<double> sizes() const;
  std::vector<double> tolerances() const;
  void observe(StiffIntegrator& integrator, CompliantRecorder& recorder);
  double settling(StiffIntegrator& integrator, double moving, double at_rest);
  bool moves(std::span<const InterfaceLoad> loads) const {
    return grasp_motion(loads) > setup_.settled * grasp_motion_before_;
  }
  double next_stop(double t) const;
  double grasp_motion(std::span<const InterfaceLoad> loads) const;
  bool is_over(double t, std::span<const InterfaceLoad> loads) const;
  void limit_step(StiffIntegrator& integrator) const;
  void begin_segment(StiffIntegrator& integrator);
  void check_balances(double t, std::span<const double> y);

  const Model& model_;
  const State& state_;
  std::span<const CompliantContact> contacts_;
  std::span<const CompliantGrasp> grasps_;
  const CompliantSetup& setup_;
  std::span<const int> held_;
  const std::function<void(double t)>& each_step_;
  ImpactDrive* drive_;
  CompliantSystem system_;
  CompliantScales scales_;
  ImpactSolution result_;
  double grasp_motion_before_ = 0;                               // [J]
  double last_motion_ = 0;                                       // time of the last motion of grasps [s]
  double rest_period_ = 0;                                       // required duration of rest [s]
  double next_break_ = std::numeric_limits<double>::infinity();  // of the drive [s]
  double largest_angle_ = 0;
  double slip_ = 1, tolerance_ = 0;  // of differences and steps, relative to the scales
  long shape_changes_ = 0;
};

void Run::enter(std::size_t contact, ContactPhase next) {
  if (next == ContactPhase::pressing) ++result_.forces[contact].touches;
  system_.phase[contact] = next;
}

// Approaching contacts press from the beginning; follow_events() handles those at rest.
void Run::choose_first_phases(std::span<const double> y) {
  system_.load(0, y);
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (system_.loads()[i].rate > kNoSpeed * scales_.speed) enter(i, ContactPhase::pressing);
  }
}

// Limits the step so that it cannot skip the pulse of a pressing contact.
void Run::limit_step(StiffIntegrator& integrator) const {
  const bool pressing =
      std::any_of(system_.phase.begin(), system_.phase.end(), [](auto p) { return p == ContactPhase::pressing; });
  integrator.limit_step(pressing ? scales_.longest_contact_time : 0);
}

// A drive's efforts may jump here and at the next stop of the integrator.
void Run::begin_segment(StiffIntegrator& integrator) {
  if (!drive_) return;
  system_.load(integrator.time(), integrator.y());
  drive_->begin_segment(integrator.time(), system_.now(), system_.wrenches_now());
  next_break_ = drive_->next_break(integrator.time());
}

// The next instant at which the integrator must stop.
double Run::next_stop(double t) const {
  const double at_rest = grasps_.empty() ? 0 : last_motion_ + rest_period_;
  const double stop = std::min(setup_.longest, next_break_);
  return at_rest > t ? std::min(stop, at_rest) : stop;
}

// Changes phases at events; returns whether one changed. The recorder receives the instant before and after.
bool Run::follow_events(StiffIntegrator& integrator, CompliantRecorder& recorder, bool event) {
  const double t = integrator.time();
  const bool of_shapes = event && integrator.shapes_changed();
  std::vector<ContactPhase> next = system_.phase;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const InterfaceLoad& load = integrator.loads_at_end()[i];
    for (int which = 1; event && which >= 0; --which) {
      if (integrator.crossed()[2 * i + which] != 0) next[i] = system_.phase_after(static_cast<int>(i), which, load);
    }
    // A pushed contact that was at rest at the start has no sign change: it presses from the first (tiny) step on.
    if (!event && system_.phase[i] == ContactPhase::apart && load.deformation > 0 && load.signed_force > 0 &&
        load.rate > kNoSpeed * scales_.speed) {
      next[i] = ContactPhase::pressing;
    }
  }
  if (next == system_.phase && !of_shapes) return false;
  recorder.mark(t, integrator.y());
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (next[i] != system_.phase[i]) enter(i, next[i]);
  }
  if (of_shapes) change_shapes(integrator);
  recorder.mark(t, integrator.y());
  return true;
}

// Kinetic energy of the grasps' relative motion, with the initial inertia, in the targets' axes.
double Run::grasp_motion(std::span<const InterfaceLoad> loads) const {
  const Eigen::Index count = static_cast<Eigen::Index>(grasps_.size());
  Eigen::VectorXd u(6 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Twistd& u_T = loads[contacts_.size() + static_cast<std::size_t>(i)].u_T;
    for (int k = 0; k < 3; ++k) u[6 * i + k] = u_T.angular[k], u[6 * i + 3 + k] = u_T.linear[k];
  }
  return 0.5 * u.dot(scales_.grasp_inertia * u);
}

// The time at which the grasps' motion falls below the rest threshold, between two instants of the last step.
double Run::settling(StiffIntegrator& integrator, double moving, double at_rest) {
  while (true) {
    const double middle = 0.5 * (moving + at_rest);
    if (!(middle > moving && middle < at_rest)) return at_rest;
    system_.load(middle, integrator.at(middle));
    (moves(system_.loads()) ? moving : at_rest) = middle;
  }
}

// Searches peaks and the grasps' motion in the last step, at its stages.
void Run::observe(StiffIntegrator& integrator, CompliantRecorder& recorder) {
  double before = integrator.step_begin();
  if (!(integrator.time() > before)) return;
  bool moved = last_motion_ >= before;
  double moving = 0, at_rest = -1;  // interval in which the motion ended
  for (int stage = 0; stage < integrator.stages(); ++stage) {
    const double t = integrator.time_of_stage(stage);
    const std::span<const InterfaceLoad> loads = integrator.loads_at_stage(stage);
    if (grasps_.empty()) continue;
    const bool moves_now = moves(loads);
    if (moves_now) {
      last_motion_ = t;
    } else if (moved) {
      moving = before, at_rest = t;
    }
    moved = moves_now, before = t;
    for (std::size_t g = 0; g < grasps_.size(); ++g) {
      largest_angle_ = std::max(largest_angle_, loads[contacts_.size() + g].angle);
    }
  }
  if (system_.shapes_act()) observe_shapes(integrator);
  recorder.step(integrator);
  if (at_rest > last_motion_) last_motion_ = settling(integrator, moving, at_rest);
}

bool Run::is_over(double t, std::span<const InterfaceLoad> loads) const {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (system_.phase[i] == ContactPhase::pressing || loads[i].rate > kNoSpeed * scales_.speed) return false;
  }
  return grasps_.empty() || t >= last_motion_ + rest_period_;
}

// Integrator at t = 0 => integrator at the end of the impact; sets status or message in the result. Each step: stop
// times, step, peaks and rest, phase changes, breaks of the drive (docs/theory, section 12, End of the impact). Ends
// without status at a failed step, a grasp turned by more than 3 rad, or the maximum number of steps.
void Run::integrate(StiffIntegrator& integrator, CompliantRecorder& recorder) {
  using Status = ImpactSolution::Status;
  begin_segment(integrator);
  recorder.mark(0, integrator.y());
  limit_step(integrator);
  std::vector<InterfaceLoad> loads(system_.loads().begin(), system_.loads().end());
  while (true) {
    const double from = integrator.time();
    if (is_over(from, loads)) {
      result_.status = grasps_.empty() ? Status::separated : Status::settled;
      return;
    }
    integrator.stop_at(next_stop(from));
    const StiffIntegrator::Result result = integrator.step();
    ++result_.steps;
    if (each_step_) each_step_(integrator.time());
    if (result == StiffIntegrator::Result::failed) {
      result_.message = integrator.message();
      return;
    }
    if (const std::string row = system_.contradiction(); !row.empty()) {
      result_.message = fmt::format("at {:.6g} s: held rates contradict closed loops ({})", integrator.time(), row);
      return;
    }
    observe(integrator, recorder);
    // An event may coincide with an end.
    if (follow_events(integrator, recorder, result == StiffIntegrator::Result::event)) {
      integrator.restart();
      limit_step(integrator);
    }
    if (integrator.time() >= setup_.longest) {
      result_.status = Status::time_over;
      return;
    }
    if (integrator.time() >= next_break_) {
      recorder.mark(integrator.time(), integrator.y());
      begin_segment(integrator);
      integrator.jump();
      recorder.mark(integrator.time(), integrator.y());
    }
    loads.assign(integrator.loads_at_end().begin(), integrator.loads_at_end().end());
    if (largest_angle_ > 3) {
      result_.message = fmt::format(
          "at {:.6g} s: a grasp has turned by {:.3g} rad, but its springs are defined only up to half a turn",
          integrator.time(), largest_angle_);
      return;
    }
    if (shape_changes_ > kMaxShapeChanges) {
      result_.message = fmt::format("at {:.6g} s: contacts between shapes have begun and ended more than {} times",
                                    integrator.time(), kMaxShapeChanges);
      return;
    }
    if (result_.steps >= setup_.max_steps) {
      result_.message =
          fmt::format("at {:.6g} s: the maximum number of steps, {}, is reached", integrator.time(), result_.steps);
      return;
    }
  }
}

// Time and integrated quantities at the end => final state, impulses, losses, held impulses and work in the result, and
// the energy residual (12.12). The elastic energy of a relaxing contact counts as lost (12.11).
void Run::check_balances(double t, std::span<const double> y) {
  system_.load(t, y);
  result_.duration = t;
  result_.after = system_.now();
  result_.velocity = result_.after.v;
  result_.kinetic_energy_after = system_.kinetic_energy_now();
  double lost = 0;
  for (int i = 0; i < system_.interfaces(); ++i) {
    const bool is_contact = i < system_.contact_count();
    ForceHistory& h = result_.forces[i];
    const double* P = &y[system_.impulse_offset(i)];
    h.impulse = {{P[0], P[1], P[2]}, {P[3], P[4], P[5]}};
    h.energy_lost = y[system_.loss_offset(i)];
    const double energy = system_.loads()[i].energy;
    if (is_contact && system_.phase[i] == ContactPhase::relaxing) {
      h.energy_lost += energy;  // the energy is dissipated
    } else {
      result_.elastic_energy_after += energy;
    }
    if (!is_contact) h.duration = last_motion_, h.touches = 1;
    lost += h.energy_lost;
  }
  for (std::size_t i = 0; i < held_.size(); ++i) {
    result_.held_impulses.push_back(y[system_.held_offset(static_cast<int>(i))]);
  }
  for (std::size_t l = 0; l < system_.loops().size(); ++l) {
    const double* P = &y[system_.loop_offset(static_cast<int>(l))];
    result_.loop_impulses.push_back({{P[0], P[1], P[2]}, {P[3], P[4], P[5]}});
  }
  result_.loop_point = system_.channel_point();
  result_.held_work = y[system_.work_offset()];
  if (drive_) result_.drive_work = y[system_.drive_offset()];
  const double before = result_.kinetic_energy_taking_part, after = system_.kinetic_energy_taking_part_now();
  result_.spring_energy_after = system_.spring_energy_now();
  if (system_.has_springs()) result_.spring_energy_lost = y[system_.spring_offset()];
  const double in_springs = result_.spring_energy_after - result_.spring_energy_before + result_.spring_energy_lost;
  double work = result_.held_work + result_.drive_work;
  if (system_.shapes_act()) {
    system_.shapes().note_integrals(system_.now(), y.subspan(system_.shape_offset()));
    for (const ContactIntegrals& sum : system_.shapes().results().integrals) work += sum.work;
    work += system_.shapes().results().strike_work;
  }
  const double missing = std::abs((after - before) + result_.elastic_energy_after + lost + in_springs - work);
  if (missing > 0) result_.energy_residual = missing / std::max(before, after);
}

// Instant, y => shapes act from now on. Trees that only they push enter the energy balance with their energy now, which
// has been constant.
std::vector<double> Run::begin_shapes(double t, std::span<const double> y) {
  system_.load(t, y);
  const double kinetic = system_.kinetic_energy_taking_part_now(), in_springs = system_.spring_energy_now();
  system_.begin_shapes();
  result_.kinetic_energy_taking_part += system_.kinetic_energy_taking_part_now() - kinetic;
  result_.spring_energy_before += system_.spring_energy_now() - in_springs;
  std::vector<double> now = system_.with_shape_numbers(y);
  system_.strike(t, now);
  now = system_.choose_shape_modes(t, now);
  scales_.add_shapes(model_, system_, system_.shapes().contacts());
  system_.shapes().note_integrals(system_.now(), std::span(now).subspan(system_.shape_offset()));
  return now;
}

// Step to the instant of a change => modes of the pairs, and the integrator with their numbers.
void Run::change_shapes(StiffIntegrator& integrator) {
  const double t = integrator.time();
  ++shape_changes_;
  std::vector<double> y;
  if (!system_.shapes_act()) {
    y = begin_shapes(t, integrator.y());
  } else {
    system_.load(t, integrator.y());
    y.assign(integrator.y().begin(), integrator.y().end());
    system_.strike(t, y);
    y = system_.choose_shape_modes(t, y);
    scales_.add_shapes(model_, system_, system_.shapes().contacts());
  }
  integrator.replace(y, sizes(), tolerances());
}

// Last step => peaks in it, and the energy balance of shapes at its end.
void Run::observe_shapes(StiffIntegrator& integrator) {
  const double end = integrator.time();
  system_.shapes().note_peaks(integrator.step_begin(), end,
                              [&](double t) { system_.load(t, t < end ? integrator.at(t) : integrator.y()); });
  system_.load(end, integrator.y());
  system_.shapes().note_integrals(system_.now(), integrator.y().subspan(system_.shape_offset()));
}

// Increments of differences and tolerances of steps, per number of y.
std::vector<double> Run::sizes() const {
  const std::vector<double> numbers = absolute_tolerances(model_, scales_, std::sqrt(slip_));
  if (!system_.shapes_act()) return numbers;
  const double part = std::sqrt(slip_);
  return system_.arranged(numbers, {part * scales_.shape_moment, part * scales_.shape_impulse, part, 1});
}
std::vector<double> Run::tolerances() const {
  const std::vector<double> numbers = absolute_tolerances(model_, scales_, tolerance_);
  if (!system_.shapes_act()) return numbers;
  return system_.arranged(numbers,
                          {tolerance_ * scales_.shape_moment, tolerance_ * scales_.shape_impulse, tolerance_, 1});
}

// Prepared run => complete outcome: energies before, scales, integration, balances (12.12), histories. Without relative
// motion the outcome has one sample and no integration. Contacts with friction use the requested tolerance, others its
// power 3/4 (docs/theory, section 12, Integration).
ImpactSolution Run::outcome() {
  result_.forces.resize(contacts_.size() + grasps_.size());
  const std::vector<double> start(system_.size(), 0.0);
  system_.load(0, start);
  result_.kinetic_energy_before = system_.kinetic_energy_now();
  result_.kinetic_energy_taking_part = system_.kinetic_energy_taking_part_now();
  result_.spring_energy_before = system_.spring_energy_now();
  scales_ = compliant_scales(model_, state_, system_, contacts_, grasps_);
  CompliantRecorder recorder(system_, setup_.samples,
                             scales_.speed > 0 ? scales_.shortest_time / setup_.samples : setup_.longest);
  if (!(scales_.speed > 0)) {
    // There is no relative motion.
    recorder.mark(0, start);
    result_.status = grasps_.empty() ? ImpactSolution::Status::separated : ImpactSolution::Status::settled;
    check_balances(0, start);
    recorder.finish(result_);
    return std::move(result_);
  }
  choose_first_phases(start);
  system_.load(0, start);
  grasp_motion_before_ = grasps_.empty() ? 0 : grasp_motion(system_.loads());
  rest_period_ = 2 * std::numbers::pi * scales_.longest_grasp_time;
  // Friction at small slip is stiff, and errors of the velocity appear in its energy loss in full. Its contacts
  // therefore use the requested tolerance, and differences that are small relative to the slip speed. The differences
  // must exceed the rounding errors of velocities, which friction amplifies by the speed over the slip speed.
  tolerance_ = step_tolerance(setup_.relative_tolerance);
  for (const CompliantContact& c : contacts_) {
    if (c.friction > 0) tolerance_ = setup_.relative_tolerance, slip_ = std::min(slip_, c.slip_speed / scales_.speed);
  }
  StiffIntegrator integrator(system_, sizes(), tolerances(), kFirstStep * scales_.shortest_time, setup_.longest);
  if (system_.has_shapes() && system_.shapes().contacts().touches()) {
    const std::vector<double> y = begin_shapes(0, start);  // before the others, which depend on the layout
    integrator.replace(y, sizes(), tolerances());
    integrator.restart();
  }
  integrate(integrator, recorder);
  result_.rhs_evaluations = integrator.evaluations();
  recorder.mark(integrator.time(), integrator.y());
  check_balances(integrator.time(), integrator.y());
  recorder.finish(result_);
  return std::move(result_);
}

}  // namespace

ImpactSolution compliant_impact(const Model& model, const State& state, std::span<const CompliantContact> contacts,
                                std::span<const CompliantGrasp> grasps, const CompliantSetup& setup,
                                std::span<const int> held, const std::function<void(double t)>& each_step,
                                ImpactDrive* drive, ImpactShapes* shapes, std::span<const LoopClosure> loops) {
  check(model, state, setup);
  for (std::size_t i = 0; i < contacts.size(); ++i) check_contact(model, contacts[i], i);
  for (std::size_t i = 0; i < grasps.size(); ++i) check_grasp(model, grasps[i], i);
  check_held(model, held);
  return Run(model, state, contacts, grasps, setup, held, each_step, drive, shapes, loops).outcome();
}

}  // namespace grapnel
