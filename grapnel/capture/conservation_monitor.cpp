#include "grapnel/capture/conservation_monitor.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string_view>

#include "grapnel/impact/impact_law.hpp"

namespace grapnel {

// --- Groups of bodies ---

namespace {

enum Row : std::size_t { kLinear, kAngular, kWorkEnergy, kEnergy, kRows };

// Deviation over scale. The scale is zero only if nothing moves and no time passes.
double relative(double deviation, double scale) { return deviation == 0 || scale == 0 ? deviation : deviation / scale; }

// Running maximum; a NaN is kept.
void raise(double& largest, double value) {
  if (!(value <= largest)) largest = value;
}

void raise(GroupScale<double>& largest, const GroupScale<double>& scale) {
  largest.linear = std::max(largest.linear, scale.linear);
  largest.angular = std::max(largest.angular, scale.angular);
  largest.energy = std::max(largest.energy, scale.energy);
}

bool is_zero(const Momentumd& h) { return dot(h.linear, h.linear) == 0 && dot(h.angular, h.angular) == 0; }

// The parts in each tree of a model.
std::vector<std::vector<int>> parts_of_trees(const CaptureSystem& system) {
  const std::vector<int> tree_of = trees_of_bodies(system.model);
  std::vector<std::vector<int>> parts(tree_of.empty() ? 0 : *std::max_element(tree_of.begin(), tree_of.end()) + 1);
  parts[tree_of[system.base]].push_back(0);
  for (std::size_t t = 0; t < system.target_frames.size(); ++t)
    parts[tree_of[system.model.frames()[system.target_frames[t]].body]].push_back(static_cast<int>(t) + 1);
  return parts;
}

}  // namespace

ConservationMonitor::ConservationMonitor(const CaptureProblem& problem, const CaptureSystem& system)
    : bends_(!system.elastic_joints.empty()),
      rows_(kRows),
      slowest_(slowest_motion(problem)),
      mass_(system.model.mass()) {
  names_.push_back("servicer");
  for (const TargetSetup& target : problem.targets) names_.push_back(target.name);
  tree_parts_ = parts_of_trees(system);
  for (const std::vector<int>& parts : tree_parts_) groups_.emplace_back().parts = parts;
  find_trees();
}

void ConservationMonitor::find_trees() {
  for (Group& group : groups_) {
    group.trees.clear();
    for (std::size_t tree = 0; tree < tree_parts_.size(); ++tree) {
      if (std::includes(group.parts.begin(), group.parts.end(), tree_parts_[tree].begin(), tree_parts_[tree].end()))
        group.trees.push_back(tree);
    }
  }
}

void ConservationMonitor::set_system(const CaptureSystem& system) {
  tree_parts_ = parts_of_trees(system);
  find_trees();
}

// --- Phases ---

// Whether motors work, whether root motion is integrated => groups equal to the current trees. Unchanged groups
// continue; others inherit the energy scale of their bodies, and ended ones enter the rows (docs/theory, section 9).
void ConservationMonitor::begin_phase(bool controlled, bool integrated) {
  controlled_ = controlled;
  (controlled ? any_controlled_ : any_uncontrolled_) = true;
  any_integrated_ = any_integrated_ || integrated;
  std::vector<Group> next;
  for (const std::vector<int>& parts : tree_parts_) {
    const auto same = std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) { return g.parts == parts; });
    Group& group = next.emplace_back();
    if (same != groups_.end()) {
      group = std::move(*same);
      groups_.erase(same);
    }
    group.parts = parts;
    group.in_phase = false;
  }
  for (const Group& old : groups_) {
    for (Group& group : next) inherit(group, old);
    retire(old);
  }
  groups_ = std::move(next);
  find_trees();
}

// Updates a group and compares it with the expected momentum. `impulse`: what was added since the last sample, [moment
// about the centre of mass; force] over time. Returns the drift.
ConservationMonitor::Drift ConservationMonitor::update_group(Group& group, const GroupQuantities& now,
                                                             const Momentumd& impulse) {
  // What entered before the first sample, as by brakes at the start of a motion, is part of that sample.
  if (!group.known) group.expected = now.h, group.entered = Momentumd::zero();
  if (group.known && !is_zero(group.entered)) {
    // Shift from the origin to the centre of mass, which has moved: l_c = l_c0 + H - c0 x H - (c - c0) x (p0 + H).
    const Vector3d p = group.expected.linear + group.entered.linear;
    group.expected.angular +=
        group.entered.angular - cross(group.now.com, group.entered.linear) - cross(now.com - group.now.com, p);
    group.expected.linear = p;
    group.entered = Momentumd::zero();
  }
  group.known = true;
  group.now = now;
  const Momentumd difference = now.h - (group.expected + impulse);
  raise(group.scale, {group_scale(now.size).linear, group_scale(now.size).angular, 0});
  group.reach.raise(reach_of(now.size, now.com));
  return {norm(difference.linear), norm(difference.angular)};
}

// Quantities and integrals since the phase's start => updated maxima of momentum drift, energy deviation and scale per
// group, the numerators of (9.4); energy is relative to the phase's first sample.
void ConservationMonitor::sample(const ConservedQuantities& quantities, const PhaseIntegrals& integrals) {
  started_ = true;
  add_scale({quantities.linear_scale, quantities.angular_scale, quantities.kinetic_energy});
  const double dampers = std::accumulate(integrals.damper_work.begin(), integrals.damper_work.end(), 0.0);
  for (Group& group : groups_) {
    const TreeIntegrals outside = integrals.trees.empty() ? TreeIntegrals{} : integrals.trees[group.trees.front()];
    const GroupQuantities& now = quantities.trees[group.trees.front()];
    const Drift drift = update_group(group, now, outside.impulse);
    const double energy = now.size.inner_energy;
    double work = outside.work;
    if (holds_servicer(group)) work += integrals.motor_work + integrals.friction_work - dampers;
    if (!integrals.damper_work.empty()) work += integrals.damper_work[group.trees.front()];
    // Stops reached at the phase's first instant have removed energy before its first sample.
    if (!group.in_phase) group.phase_energy = energy - work, group.at_phase_start = drift;
    group.in_phase = true;
    group.exchanged = group.before;
    if (!integrals.exchanged.empty()) group.exchanged += integrals.exchanged[group.trees.front()];
    raise(group.largest.linear, drift.linear);
    raise(group.largest.angular, drift.angular);
    raise(group.growth.linear, drift.linear - group.at_phase_start.linear);
    raise(group.growth.angular, drift.angular - group.at_phase_start.angular);
    raise(controlled_ ? group.work_energy : group.energy, std::abs(energy - group.phase_energy - work));
    group.scale.energy = std::max(group.scale.energy, group_scale(now.size).energy);
  }
}

// Measures of a phase that was observed elsewhere (batches) => the same maxima as sample(); nothing without measures.
void ConservationMonitor::take(const PhaseMeasures& measures) {
  if (measures.trees.empty()) return;  // no measures were taken
  started_ = true;
  for (Group& group : groups_) {
    const TreeMeasures& tree = measures.trees.at(group.trees.front());
    const Drift before = update_group(group, tree.start, Momentumd::zero());
    raise(group.largest.linear, before.linear + tree.linear_deviation);
    raise(group.largest.angular, before.angular + tree.angular_deviation);
    raise(group.growth.linear, tree.linear_deviation);
    raise(group.growth.angular, tree.angular_deviation);
    raise(controlled_ ? group.work_energy : group.energy, tree.energy_deviation);
    raise(group.scale, tree.scale);
    group.reach.raise(tree.reach);
    group.before += tree.exchanged;
    group.exchanged = group.before;
    // If the phase continues with samples, they are also relative to its start.
    group.phase_energy = tree.start.size.inner_energy, group.at_phase_start = before;
    group.in_phase = true;
  }
  add_scale(measures.scale);
}

void ConservationMonitor::end_phase(const PhaseIntegrals& integrals) {
  for (Group& group : groups_) group.before = group.exchanged;
  if (integrals.trees.empty()) return;
  for (Group& group : groups_) group.expected += integrals.trees[group.trees.front()].impulse;
}

void ConservationMonitor::add_scale(const LedgerScale& scale) {
  scale_.linear_momentum = std::max(scale_.linear_momentum, scale.linear_momentum);
  scale_.angular_momentum = std::max(scale_.angular_momentum, scale.angular_momentum);
  scale_.energy = std::max(scale_.energy, scale.energy);
  slowest_.speed = std::sqrt(2 * scale_.energy / mass_);
}

// --- Between phases ---

// Quantities between phases => drift of each group after an impact; its excess over the previous maximum counts as a
// jump, which identifies the impact as the cause.
void ConservationMonitor::instant(const ConservedQuantities& quantities) {
  started_ = true;
  add_scale({quantities.linear_scale, quantities.angular_scale, quantities.kinetic_energy});
  std::vector<GroupQuantities> trees;
  for (Group& group : groups_) {
    trees.clear();
    for (std::size_t tree : group.trees) trees.push_back(quantities.trees[tree]);
    const Drift drift = update_group(group, together(trees), Momentumd::zero());
    raise(group.jump.linear, drift.linear - group.largest.linear);
    raise(group.jump.angular, drift.angular - group.largest.angular);
    raise(group.largest.linear, drift.linear);
    raise(group.largest.angular, drift.angular);
  }
}

void ConservationMonitor::touch(std::span<const std::size_t> targets) {
  std::vector<bool> which(names_.size(), false);
  which[0] = true;
  for (std::size_t t : targets) which[t + 1] = true;
  merge(which);
}

// A group at rest is judged relative to the energy of its bodies before they met or parted.
void ConservationMonitor::inherit(Group& group, const Group& before) {
  const auto is_in = [&](int part) { return std::binary_search(before.parts.begin(), before.parts.end(), part); };
  if (std::any_of(group.parts.begin(), group.parts.end(), is_in))
    group.earlier_energy = std::max({group.earlier_energy, before.earlier_energy, before.scale.energy});
}

// Groups with any of these parts become one group: momenta add up, about the common centre of mass.
void ConservationMonitor::merge(const std::vector<bool>& which) {
  const auto is_affected = [&](const Group& g) {
    return std::any_of(g.parts.begin(), g.parts.end(), [&](int part) { return which[part]; });
  };
  if (std::count_if(groups_.begin(), groups_.end(), is_affected) < 2) return;
  Group all;
  std::vector<GroupQuantities> actual, expected;
  for (const Group& group : groups_) {
    if (!is_affected(group)) continue;
    all.parts.insert(all.parts.end(), group.parts.begin(), group.parts.end());
    actual.push_back(group.now);
    expected.push_back(group.now);
    expected.back().h = group.expected;
    all.known = group.known;
    inherit(all, group);
    retire(group);
    all.before += group.exchanged;
    all.reach.distance = std::max(all.reach.distance, group.reach.distance);
  }
  all.exchanged = all.before;
  std::erase_if(groups_, is_affected);
  std::sort(all.parts.begin(), all.parts.end());
  all.now = together(actual);
  all.expected = together(expected).h;
  const GroupScale<double> scale = group_scale(all.now.size);
  raise(all.scale, {scale.linear, scale.angular, 0});
  all.reach.raise(reach_of(all.now.size, all.now.com));
  groups_.push_back(std::move(all));
  find_trees();
}

void ConservationMonitor::enter(const Momentumd& momentum) {
  for (Group& group : groups_) {
    if (!holds_servicer(group)) continue;
    group.entered += momentum;
    const Vector3d about_com = momentum.angular - cross(group.now.com, momentum.linear);
    group.before += {norm(momentum.linear), norm(about_com), 0};
    group.exchanged = group.before;
  }
}

// --- The rows ---

GroupScale<double> ConservationMonitor::scale_of(const Group& group) const {
  return ledger_scale(group.scale, group.exchanged, group.reach, slowest_);
}

// Group, worst rows so far => rows with this group's deviations over its scale (9.4) where these are larger; a NaN
// stays. The energy scale has the floor from earlier groups of the same bodies.
void ConservationMonitor::judge(const Group& group, std::vector<Worst>& rows) const {
  const GroupScale<double> scale = scale_of(group);
  const auto note = [&](Row row, double deviation, double relative_to) {
    const double value = relative(deviation, relative_to);
    if (value <= rows[row].value || std::isnan(rows[row].value)) return;
    rows[row] = {value, relative_to, group.parts};
  };
  note(kLinear, group.largest.linear, scale.linear);
  note(kAngular, group.largest.angular, scale.angular);
  // If all bodies are at rest, the remaining energy is at the level of the tolerances of the energy before.
  const double inherited = bends_ ? kScaleFloor : kScaleFloor * kScaleFloor;
  const double energy = std::max(scale.energy, inherited * group.earlier_energy);
  note(kWorkEnergy, group.work_energy, energy);
  note(kEnergy, group.energy, energy);
}

void ConservationMonitor::retire(const Group& group) {
  judge(group, rows_);
  const GroupScale<double> scale = scale_of(group);
  const auto worse = [&](const Drift& drift) {
    return std::max(relative(drift.linear, scale.linear), relative(drift.angular, scale.angular));
  };
  raise(jump_, worse(group.jump));
  raise(growth_, worse(group.growth));
  raise(farthest_, group.reach.distance);
}

DriftCause ConservationMonitor::cause() const {
  ConservationMonitor all = *this;
  for (const Group& group : groups_) all.retire(group);
  return {all.jump_ > all.growth_, any_integrated_, all.farthest_};
}

// Groups => four rows of (9.4) with bounds 1e-11 (momentum), 1e-9 (work) and 1e-10 (energy; 1e-9 with springs), each
// with the worst group and its scale in the note; also the scale of the whole system.
void ConservationMonitor::write(Ledger& ledger) const {
  std::vector<Worst> rows = rows_;
  for (const Group& group : groups_) judge(group, rows);
  ledger.scale = scale_;
  const auto add = [&](const char* name, Row row, double bound, const char* unit, std::string note, bool applies) {
    const Worst& worst = rows[row];
    for (std::size_t i = 0; applies && i < worst.parts.size(); ++i)
      note += (i == 0 ? "; largest: " : " + ") + names_[worst.parts[i]];
    if (applies && !worst.parts.empty()) note += fmt::format(", scale {:.4g} {}", worst.scale, unit);
    ledger.entries.push_back({name, applies ? worst.value : 0, bound, "1", std::move(note), applies});
  };
  add("linear_momentum_drift", kLinear, 1e-11, "N s",
      "largest |p(t) - p(0) - external impulse| of any group of bodies that touch, over its scale, all phases",
      started_);
  add("angular_momentum_drift", kAngular, 1e-11, "N m s",
      "the same for angular momentum about the group's centre of mass", started_);
  add("work_energy_residual", kWorkEnergy, 1e-9, "J",
      "largest |U(t) - U(0) - work of motors, friction and external forces| of any group, over its scale, controlled "
      "phases; U: kinetic energy relative to its centre of mass",
      any_controlled_);
  add("energy_drift", kEnergy, bends_ ? 1e-9 : 1e-10, "J", "the same in uncontrolled phases, where no motor works",
      any_uncontrolled_);
}

// --- Advice ---

namespace {

// Tolerances below this have no effect beyond rounding.
constexpr double kRounding = 1e-13;

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
  for (std::string_view one : names) {
    if (name == one) return true;
  }
  return false;
}

// Integration setup => name of the loop method if it is for comparison only; null for projection.
const char* comparison_loops(const IntegrationSetup& integration) {
  switch (integration.loops) {
    case IntegrationSetup::Loops::baumgarte:
      return "baumgarte";
    case IntegrationSetup::Loops::acceleration:
      return "acceleration";
    case IntegrationSetup::Loops::open:
      return "open";
    case IntegrationSetup::Loops::projection:
      break;
  }
  return nullptr;
}

// Advice for integrated quantities, whose error depends on the step size.
std::string smaller_steps(const IntegrationSetup& integration) {
  if (integration.method == IntegrationSetup::Method::rk4) {
    return fmt::format(
        "integration.method: rk4 takes steps of {} s whatever the error: choose a smaller integration.step, "
        "or automatic",
        integration.step);
  }
  if (integration.relative_tolerance > kRounding || integration.absolute_tolerance > kRounding) {
    return fmt::format("reduce integration.relative_tolerance and absolute_tolerance; they are {:.3g} and {:.3g}",
                       integration.relative_tolerance, integration.absolute_tolerance);
  }
  return "the tolerances are already at rounding level: check for masses, stiffnesses or rates that differ by many "
         "orders of "
         "magnitude";
}

bool is_at_rounding(const IntegrationSetup& integration) {
  return integration.method != IntegrationSetup::Method::rk4 && integration.relative_tolerance <= kRounding &&
         integration.absolute_tolerance <= kRounding;
}

// Advice for momentum that smaller tolerances cannot improve.
std::string rounded_places(double distance) {
  constexpr double kFar = 10;  // [m]
  const char* others = "check for masses, forces or rates that differ by many orders of magnitude within one group";
  if (distance < kFar) return fmt::format("the tolerances are already at rounding level: {}", others);
  return fmt::format(
      "the tolerances are already at rounding level, but a group of bodies moves {:.3g} m away from the base's initial "
      "uniform motion, where positions are rounded to {:.1g} m: use shorter phases, or an initial velocity of the "
      "base closer to the mean motion; otherwise {}",
      distance, distance * std::numeric_limits<double>::epsilon(), others);
}

constexpr const char* kImpactEquations =
    "the equations of the impact are not solved to rounding, and tolerances have no effect: check for masses or "
    "inertias "
    "that differ by many orders of magnitude, or a nearly singular configuration (impact.rank)";

// Problem, cause of the drift, name of a failed row => remedy for the user: setting for comparison, equations of an
// impact, rounding of positions, or smaller steps.
std::string advice_for(const CaptureProblem& problem, const DriftCause& drift, std::string_view row) {
  const IntegrationSetup& integration = problem.integration;
  const bool momentum = is_one_of(row, {"linear_momentum_drift", "angular_momentum_drift"});
  const bool impact =
      is_one_of(row, {"generalized_momentum_residual", "energy_identity_residual", "impact_constraint_residual",
                      "brake_energy_identity_residual", "friction_cone_residual"});
  if (problem.impact && impact_law(*problem.impact).published && (impact || (momentum && drift.in_impact)))
    return "impact.law: as_published is for comparison only: it does not conserve momentum; impact.law: plastic "
           "does";
  if (impact) return kImpactEquations;
  if (momentum && drift.in_impact)
    return "momentum jumps at an impact, and tolerances have no effect: see the rows of the impact";
  if (const char* loops = comparison_loops(integration); loops && !momentum)
    return fmt::format("integration.loops: {} is for comparison only; use projection, which keeps loops closed", loops);
  if (row == "compliant_energy_residual")
    return "check for stiffness or damping that differs by many orders of magnitude between grasps and contacts, and "
           "for "
           "an impact longer than impact.longest; integration tolerances do not apply to the impact";
  if (momentum && !drift.integrated && integration.root_velocity == IntegrationSetup::RootVelocity::recovered)
    return "momentum is recovered, not integrated, so tolerances have no effect: check for positions, speeds or masses "
           "that differ by many orders of magnitude within one group of bodies";
  if (momentum && is_at_rounding(integration)) return rounded_places(drift.distance);
  return smaller_steps(integration);
}

}  // namespace

void advise(const CaptureProblem& problem, const DriftCause& drift, Ledger& ledger) {
  for (LedgerEntry& entry : ledger.entries) {
    if (entry.kind == LedgerEntry::Kind::conservation && !entry.pass())
      entry.advice = advice_for(problem, drift, entry.name);
  }
}

// --- Impacts ---

namespace {

void raise(std::optional<double>& largest, const std::optional<double>& value) {
  if (!value) return;
  if (!largest) largest = 0;
  raise(*largest, *value);
}

}  // namespace

// Residuals of one impact => maxima over the impacts; a NaN stays.
void ImpactMonitor::note(const ImpactResiduals& residuals) {
  for (const auto residual : {&ImpactResiduals::momentum, &ImpactResiduals::energy, &ImpactResiduals::velocity,
                              &ImpactResiduals::cone, &ImpactResiduals::in_time, &ImpactResiduals::brake})
    raise(largest_.*residual, residuals.*residual);
}

// Largest residuals of all impacts => rows (9.5) to (9.7), friction cone, compliant energy (12.12) and brakes; rows
// without an impact of that kind are omitted.
void ImpactMonitor::write(Ledger& ledger) const {
  const auto add = [&](const char* name, std::optional<double> value, const char* note, double bound = 1e-10) {
    if (value) ledger.entries.push_back({name, *value, bound, "1", note});
  };
  add("generalized_momentum_residual", largest_.momentum,
      "(3.6): |M dv - J^T P| over |M v| of the bodies in the impact, energy norm");
  add("energy_identity_residual", largest_.energy,
      "|dT - P^T (u- + u+) / 2| over the kinetic energy of the bodies in the impact");
  add("impact_constraint_residual", largest_.velocity,
      "remaining relative velocity in the constrained directions over the largest velocity of the bodies");
  add("friction_cone_residual", largest_.cone,
      "largest excess of a tangential impulse over friction times the normal one, over the largest normal one");
  add("compliant_energy_residual", largest_.in_time,
      "error of the energy balance of a compliant impact (kinetic, elastic, dissipated), over the kinetic energy of "
      "the "
      "bodies; elastic energy that remained when impact.longest ended it counts as error",
      1e-8);
  add("brake_energy_identity_residual", largest_.brake, "the same for the impulse that locks the joints");
}

namespace {

// Group => velocity of its centre of mass.
Vector3d velocity(const GroupQuantities& group) { return (1 / group.size.mass) * group.h.linear; }

// Quantities of a body at its centre of mass.
struct BodyQuantities {
  BodyMomentum momentum;
  double twice_spin_energy = 0;  // w . I w, plus the terms of its joint's rotor and of the spin of carried rotors
};

// Body i, state => momentum about its centre of mass in W, that point, and twice its energy of rotation; includes
// reflected rotors (19.6) and the spins of rotors that it carries.
BodyQuantities body_quantities(const Model& model, const Kinematics& k, const State& state, std::size_t i) {
  const Body& body = model.bodies()[i];
  const BodyDescription& d = body.description;
  const Posed& X_WB = k.X_WB[i];
  const Vector3d arm = X_WB.R * d.com;
  const Twistd V_WC = shift(k.V_WB[i], arm);
  const Vector3d w_B = transposed_times(X_WB.R, V_WC.angular);
  const Vector3d h_B = d.inertia * w_B;
  BodyQuantities b{{{X_WB.R * h_B, d.mass * V_WC.linear}, X_WB.p + arm}, dot(w_B, h_B)};
  if (has_one_axis(d.joint.type)) {
    const double rate = state.v[body.v];
    b.twice_spin_energy += d.joint.reflected_inertia() * rate * rate;
  }
  for (int carried : model.rotors()) {
    const Body& child = model.bodies()[carried];
    if (child.parent != static_cast<int>(i)) continue;
    const Vector3d spin = state.v[child.v] * rotor_momentum(model, k, carried);
    b.momentum.h.angular += spin;
    b.twice_spin_energy += 2 * dot(spin, V_WC.angular);
  }
  return b;
}

}  // namespace

std::vector<int> trees_of_bodies(const Model& model) {
  std::vector<int> trees;
  int count = 0;
  for (const Body& body : model.bodies()) trees.push_back(body.parent < 0 ? count++ : trees[body.root]);
  return trees;
}

// Groups => one group about the common centre of mass: mass, momentum, energies and the sums P, A, M R^2 of (9.1) to
// (9.3), with the motions of the parts relative to it.
GroupQuantities together(std::span<const GroupQuantities> groups) {
  if (groups.size() == 1) return groups.front();
  GroupQuantities all;
  for (const GroupQuantities& g : groups) {
    all.size.mass += g.size.mass;
    all.com += g.size.mass * g.com;
    all.h.linear += g.h.linear;
    all.size.energy += g.size.energy;
  }
  all.com = (1 / all.size.mass) * all.com;
  const Vector3d V = velocity(all);
  for (const GroupQuantities& g : groups) {
    const Vector3d r = g.com - all.com, own = velocity(g) - V;
    const Vector3d moment = cross(r, g.size.mass * own);
    all.h.angular += g.h.angular + moment;
    all.size.linear += g.size.linear;
    all.size.angular += g.size.angular + norm(moment);
    all.size.second_moment += g.size.second_moment + g.size.mass * dot(r, r);
    all.size.inner_energy += g.size.inner_energy + 0.5 * g.size.mass * dot(own, own);
  }
  return all;
}

// Model, poses and twists, state => momenta, energies and scale sums of the system and of each tree, (9.1) to (9.3),
// summed body by body; independent of the mass matrix. The angular momentum of a tree is about its own centre of mass,
// that of the system about the common one; inner energy includes springs (22.6).
ConservedQuantities conserved_quantities(const Model& model, const Kinematics& kinematics, const State& state) {
  ConservedQuantities quantities;
  const std::size_t count = model.bodies().size();
  const std::vector<int> tree_of = trees_of_bodies(model);
  std::vector<BodyQuantities> bodies;
  bodies.reserve(count);
  quantities.about_com = Momentumd::zero();
  quantities.com = Vector3d::zero();
  double mass = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bodies.push_back(body_quantities(model, kinematics, state, i));
    const BodyMomentum& m = bodies.back().momentum;
    if (model.bodies()[i].parent < 0) quantities.trees.emplace_back();
    GroupQuantities& tree = quantities.trees[tree_of[i]];
    const double m_i = model.bodies()[i].description.mass;
    tree.size.mass += m_i;
    tree.com += m_i * m.p_WC;
    tree.h.linear += m.h.linear;
    mass += m_i;
  }
  for (GroupQuantities& tree : quantities.trees) {
    quantities.com += tree.com;
    tree.com = (1 / tree.size.mass) * tree.com;
  }
  quantities.com = (1 / mass) * quantities.com;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [m, twice_spin_energy] = bodies[i];
    const BodyDescription& d = model.bodies()[i].description;
    GroupQuantities& tree = quantities.trees[tree_of[i]];
    const Vector3d from_com = m.p_WC - quantities.com, r = m.p_WC - tree.com;
    const Vector3d own = m.h.linear - d.mass * velocity(tree);
    const Vector3d moment = cross(r, own);
    const double linear = norm(m.h.linear), spin = norm(m.h.angular);
    quantities.about_com += shift(m.h, -from_com);
    quantities.linear_scale += linear;
    quantities.angular_scale += spin + norm(cross(from_com, m.h.linear));
    tree.h.angular += m.h.angular + moment;
    tree.size.linear += linear;
    tree.size.angular += spin + norm(moment);
    tree.size.second_moment += d.mass * dot(r, r) + 0.5 * (d.inertia.xx + d.inertia.yy + d.inertia.zz);
    tree.size.inner_energy += 0.5 * twice_spin_energy;
    quantities.kinetic_energy += 0.5 * twice_spin_energy;
    if (d.mass == 0) continue;  // a part of a flexible body (BodyDescription::part_of)
    tree.size.inner_energy += 0.5 * dot(own, own) / d.mass;
    quantities.kinetic_energy += 0.5 * dot(m.h.linear, m.h.linear) / d.mass;
  }
  for (const int body : model.springs()) {
    const double energy = spring_energy(model, state, body);
    quantities.elastic_energy += energy;
    quantities.trees[tree_of[body]].size.inner_energy += energy;
  }
  for (GroupQuantities& tree : quantities.trees)
    tree.size.energy = tree.size.inner_energy + 0.5 * dot(tree.h.linear, velocity(tree));
  return quantities;
}

Momentumd group_momentum(const Model& model, const Kinematics& kinematics, std::span<const int> bodies,
                         const Vector3d& p_W) {
  Momentumd total = Momentumd::zero();
  for (int body : bodies) {
    const BodyMomentum m = body_momentum(model, kinematics, body);
    total += shift(m.h, p_W - m.p_WC);
  }
  return total;
}

}  // namespace grapnel
