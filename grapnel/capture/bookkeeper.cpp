#include "grapnel/capture/bookkeeper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

enum Row : std::size_t { kLinear, kAngular, kWorkEnergy, kEnergy, kRows };

// Deviation over scale; nothing deviates from nothing by nothing.
double relative(double deviation, double scale) { return deviation == 0 ? 0.0 : deviation / scale; }

// The largest so far; a NaN stays.
void raise(double& largest, double value) {
  if (!(value <= largest)) largest = value;
}

void raise(GroupScale<double>& largest, const GroupScale<double>& scale) {
  largest.linear = std::max(largest.linear, scale.linear);
  largest.angular = std::max(largest.angular, scale.angular);
  largest.energy = std::max(largest.energy, scale.energy);
}

bool is_zero(const Momentumd& h) { return dot(h.linear, h.linear) == 0 && dot(h.angular, h.angular) == 0; }

// Which parts are in each tree of a model.
std::vector<std::vector<int>> parts_of_trees(const CaptureSystem& system) {
  const std::vector<int> tree_of = trees_of_bodies(system.model);
  std::vector<std::vector<int>> parts(tree_of.empty() ? 0 : *std::max_element(tree_of.begin(), tree_of.end()) + 1);
  parts[tree_of[system.base]].push_back(0);
  for (std::size_t t = 0; t < system.target_frames.size(); ++t)
    parts[tree_of[system.model.frames()[system.target_frames[t]].body]].push_back(static_cast<int>(t) + 1);
  return parts;
}

}  // namespace

Bookkeeper::Bookkeeper(const CaptureProblem& problem, const CaptureSystem& system) : rows_(kRows) {
  names_.push_back("servicer");
  for (const TargetSetup& target : problem.targets) names_.push_back(target.name);
  tree_parts_ = parts_of_trees(system);
  for (const std::vector<int>& parts : tree_parts_) groups_.emplace_back().parts = parts;
  find_trees();
}

void Bookkeeper::find_trees() {
  for (Group& group : groups_) {
    group.trees.clear();
    for (std::size_t tree = 0; tree < tree_parts_.size(); ++tree) {
      if (std::includes(group.parts.begin(), group.parts.end(), tree_parts_[tree].begin(), tree_parts_[tree].end()))
        group.trees.push_back(tree);
    }
  }
}

void Bookkeeper::set_system(const CaptureSystem& system) {
  tree_parts_ = parts_of_trees(system);
  find_trees();
}

// --- Phases ---

void Bookkeeper::begin_phase(bool controlled, bool integrated) {
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
  for (const Group& group : groups_) retire(group);
  groups_ = std::move(next);
  find_trees();
}

// Against what is expected; `impulse`: what has entered since, [moment about the centre of mass; force] over time.
Bookkeeper::Drift Bookkeeper::look(Group& group, const GroupBooks& now, const Momentumd& impulse) {
  if (!group.known) group.expected = now.h;
  if (group.known && !is_zero(group.entered)) {
    // From the origin to the centre of mass, which has moved: l_c = l_c0 + H - c0 x H - (c - c0) x (p0 + H).
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
  return {norm(difference.linear), norm(difference.angular)};
}

void Bookkeeper::sample(const SystemBooks& books, const PhaseIntegrals& integrals) {
  started_ = true;
  add_scale(books);
  for (Group& group : groups_) {
    const TreeIntegrals outside = integrals.trees.empty() ? TreeIntegrals{} : integrals.trees[group.trees.front()];
    const GroupBooks& now = books.trees[group.trees.front()];
    const Drift drift = look(group, now, outside.impulse);
    const double energy = now.size.inner_energy;
    if (!group.in_phase) group.phase_energy = energy, group.at_phase_start = drift;
    group.in_phase = true;
    raise(group.largest.linear, drift.linear);
    raise(group.largest.angular, drift.angular);
    raise(group.growth.linear, drift.linear - group.at_phase_start.linear);
    raise(group.growth.angular, drift.angular - group.at_phase_start.angular);
    double work = outside.work;
    if (holds_servicer(group)) work += integrals.motor_work + integrals.friction_work;
    raise(controlled_ ? group.work_energy : group.energy, std::abs(energy - group.phase_energy - work));
    group.scale.energy = std::max(group.scale.energy, group_scale(now.size).energy);
  }
}

void Bookkeeper::take(const PhaseMeasures& measures) {
  if (measures.trees.empty()) return;  // nobody has looked
  started_ = true;
  for (Group& group : groups_) {
    const TreeMeasures& tree = measures.trees.at(group.trees.front());
    const Drift before = look(group, tree.start, Momentumd::zero());
    raise(group.largest.linear, before.linear + tree.linear_deviation);
    raise(group.largest.angular, before.angular + tree.angular_deviation);
    raise(group.growth.linear, tree.linear_deviation);
    raise(group.growth.angular, tree.angular_deviation);
    raise(controlled_ ? group.work_energy : group.energy, tree.energy_deviation);
    raise(group.scale, tree.scale);
  }
  scale_.linear_momentum = std::max(scale_.linear_momentum, measures.scale.linear_momentum);
  scale_.angular_momentum = std::max(scale_.angular_momentum, measures.scale.angular_momentum);
  scale_.energy = std::max(scale_.energy, measures.scale.energy);
}

void Bookkeeper::end_phase(const PhaseIntegrals& integrals) {
  if (integrals.trees.empty()) return;
  for (Group& group : groups_) group.expected += integrals.trees[group.trees.front()].impulse;
}

void Bookkeeper::add_scale(const SystemBooks& books) {
  scale_.linear_momentum = std::max(scale_.linear_momentum, books.linear_scale);
  scale_.angular_momentum = std::max(scale_.angular_momentum, books.angular_scale);
  scale_.energy = std::max(scale_.energy, books.kinetic_energy);
}

// --- Between phases ---

void Bookkeeper::instant(const SystemBooks& books) {
  started_ = true;
  add_scale(books);
  std::vector<GroupBooks> trees;
  for (Group& group : groups_) {
    trees.clear();
    for (std::size_t tree : group.trees) trees.push_back(books.trees[tree]);
    const Drift drift = look(group, together(trees), Momentumd::zero());
    raise(group.jump.linear, drift.linear - group.largest.linear);
    raise(group.jump.angular, drift.angular - group.largest.angular);
    raise(group.largest.linear, drift.linear);
    raise(group.largest.angular, drift.angular);
  }
}

void Bookkeeper::touch(std::span<const std::size_t> targets) {
  std::vector<bool> which(names_.size(), false);
  which[0] = true;
  for (std::size_t t : targets) which[t + 1] = true;
  merge(which);
}

// Groups that have any of these parts are one from now on: momenta add up, about the common centre of mass.
void Bookkeeper::merge(const std::vector<bool>& which) {
  const auto meets = [&](const Group& g) {
    return std::any_of(g.parts.begin(), g.parts.end(), [&](int part) { return which[part]; });
  };
  if (std::count_if(groups_.begin(), groups_.end(), meets) < 2) return;
  Group all;
  std::vector<GroupBooks> actual, expected;
  for (const Group& group : groups_) {
    if (!meets(group)) continue;
    all.parts.insert(all.parts.end(), group.parts.begin(), group.parts.end());
    actual.push_back(group.now);
    expected.push_back(group.now);
    expected.back().h = group.expected;
    all.known = group.known;
    retire(group);
  }
  std::erase_if(groups_, meets);
  std::sort(all.parts.begin(), all.parts.end());
  all.now = together(actual);
  all.expected = together(expected).h;
  const GroupScale<double> scale = group_scale(all.now.size);
  raise(all.scale, {scale.linear, scale.angular, 0});
  groups_.push_back(std::move(all));
  find_trees();
}

void Bookkeeper::enter(const Momentumd& momentum) {
  for (Group& group : groups_) {
    if (holds_servicer(group)) group.entered += momentum;
  }
}

// --- The rows ---

void Bookkeeper::judge(const Group& group, std::vector<Worst>& rows) const {
  const auto note = [&](Row row, double deviation, double scale) {
    const double value = relative(deviation, scale);
    if (value <= rows[row].value || std::isnan(rows[row].value)) return;
    rows[row] = {value, scale, group.parts};
  };
  note(kLinear, group.largest.linear, group.scale.linear);
  note(kAngular, group.largest.angular, group.scale.angular);
  note(kWorkEnergy, group.work_energy, group.scale.energy);
  note(kEnergy, group.energy, group.scale.energy);
}

void Bookkeeper::retire(const Group& group) {
  judge(group, rows_);
  raise(jump_,
        std::max(relative(group.jump.linear, group.scale.linear), relative(group.jump.angular, group.scale.angular)));
  raise(growth_, std::max(relative(group.growth.linear, group.scale.linear),
                          relative(group.growth.angular, group.scale.angular)));
}

DriftCause Bookkeeper::cause() const {
  Bookkeeper all = *this;
  for (const Group& group : groups_) all.retire(group);
  return {all.jump_ > all.growth_, any_integrated_};
}

void Bookkeeper::write(Ledger& ledger) const {
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
  add("energy_drift", kEnergy, 1e-10, "J", "the same in uncontrolled phases, where no motor works", any_uncontrolled_);
}

}  // namespace grapnel
