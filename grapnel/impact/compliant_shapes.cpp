#include "grapnel/impact/compliant_shapes.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/model/model.hpp"

namespace grapnel {

ShapeForces::ShapeForces(const Model& model, ImpactShapes& shapes, const Vector3d& point)
    : model_(model),
      shapes_(shapes),
      peaks_(shapes.contacts.groups()),
      kinematics_(model),
      sticks_(shapes.contacts.stick_count(), 0.0),
      stick_rates_(sticks_.size()),
      stored_(shapes.contacts.groups(), std::nan("")) {
  shapes.contacts.rebase_stick();  // zero numbers are the present deformations
  shapes.integrals.assign(shapes.contacts.groups(), {});
  shapes.peaks.assign(shapes.contacts.groups(), {});
  shapes.elastic_energy.assign(shapes.contacts.groups(), 0.0);
  shapes.point = point;
  for (std::size_t pair = 0; pair < shapes.contacts.size(); ++pair) {
    for (const auto& [a, b] : shapes.contacts.all_bodies_of(pair)) {
      if (find_impulse(a, b) == shapes.impulses.size()) shapes.impulses.push_back({a, b});
    }
  }
}

std::size_t ShapeForces::find_impulse(int body_a, int body_b) const {
  std::size_t i = 0;
  while (i < shapes_.impulses.size() && !(shapes_.impulses[i].body_a == body_a && shapes_.impulses[i].body_b == body_b))
    ++i;
  return i;
}

double ShapeForces::margin(double t, const State& state) {
  forward_kinematics(model_, state, kinematics_);
  return shapes_.contacts.margin(shapes_.begin + t, kinematics_);
}

void ShapeForces::begin_step(const State& state) {
  forward_kinematics(model_, state, kinematics_);
  shapes_.contacts.begin_step(kinematics_);
}

bool ShapeForces::end_step(const State& state, double duration) {
  constexpr double kLongestNext = 4;  // in this step
  forward_kinematics(model_, state, kinematics_);
  return shapes_.contacts.end_step(kinematics_, duration, 0, kLongestNext * duration);
}

void ShapeForces::find_rubbing() {
  std::vector<int> numbers;
  shapes_.contacts.add_active_sticks(0, numbers);
  rubbing_.clear();
  for (std::size_t i = 0; i < numbers.size(); i += ContactSet::kStickCount)
    rubbing_.push_back(static_cast<std::size_t>(numbers[i]) / ContactSet::kStickCount);
}

void ShapeForces::set_sticks(std::span<const double> numbers) {
  for (std::size_t i = 0; i < rubbing_.size(); ++i)
    std::copy_n(&numbers[ContactSet::kStickCount * i], ContactSet::kStickCount,
                &sticks_[ContactSet::kStickCount * rubbing_[i]]);
  shapes_.contacts.set_stick(sticks_);
}

void ShapeForces::get_sticks(std::span<double> numbers) const {
  for (std::size_t i = 0; i < rubbing_.size(); ++i)
    std::copy_n(&sticks_[ContactSet::kStickCount * rubbing_[i]], ContactSet::kStickCount,
                &numbers[ContactSet::kStickCount * i]);
}

// State at a change => modes, and the pairs whose deformations are integrated from now on.
void ShapeForces::choose_modes(double t, const State& state) {
  forward_kinematics(model_, state, kinematics_);
  shapes_.contacts.choose_modes(shapes_.begin + t, kinematics_);
  find_rubbing();
}

// State, deformations => forces by (23.4) to (23.13) on bodies and links.
void ShapeForces::evaluate(const State& state) {
  forward_kinematics(model_, state, kinematics_);
  wrenches_.clear(), link_forces_.clear();
  shapes_.contacts.evaluate(kinematics_, wrenches_);
  for (const ExternalWrench& w : wrenches_)
    link_forces_.push_back({model_.bodies()[w.body].placement.link, w.p_WP, w.F_W});
}

void ShapeForces::stick_rates(std::span<double> rates) {
  shapes_.contacts.stick_rates(stick_rates_);
  for (std::size_t i = 0; i < rubbing_.size(); ++i)
    std::copy_n(&stick_rates_[ContactSet::kStickCount * rubbing_[i]], ContactSet::kStickCount,
                &rates[ContactSet::kStickCount * i]);
}

void ShapeForces::integral_rates(std::span<double> rates) const {
  const std::size_t groups = shapes_.integrals.size();
  std::fill(rates.begin(), rates.end(), 0.0);
  for (std::size_t g = 0; g < groups; ++g) {
    const GroupContact& group = shapes_.contacts.group(g);
    double* const at = &rates[kOfGroup * g];
    at[0] = group.power, at[1] = group.damping_power, at[2] = group.friction_power;
    at[3] = group.normal_force, at[4] = group.slip_speed;
  }
  each_force([&](int body_a, int body_b, const Vector3d& p_WC, const Wrenchd& on_b) {
    add_impulse(body_a, body_b, p_WC, on_b, rates);
  });
}

void ShapeForces::add_impulse(int body_a, int body_b, const Vector3d& p_WC, const Wrenchd& on_b,
                              std::span<double> integrals) const {
  const Wrenchd F = shift(on_b, shapes_.point - p_WC);
  double* const at = &integrals[kOfGroup * shapes_.integrals.size() + 6 * find_impulse(body_a, body_b)];
  for (int k = 0; k < 3; ++k) at[k] += F.angular[k], at[3 + k] += F.linear[k];
}

// The modes of pairs change between steps, so each step begins with new values.
void ShapeForces::note_peaks(double begin, double end, const std::function<void(double t)>& evaluate) {
  peaks_.step(shapes_.contacts, begin, end, true, evaluate);
  shapes_.peaks.assign(peaks_.peaks().begin(), peaks_.peaks().end());
}

// Work of the forces + change of elastic energy + dissipated energy = 0 for each group (23.1). The first call is at the
// beginning of the first contact, where the integrals are zero.
void ShapeForces::note_integrals(const State& state, std::span<const double> integrals) {
  forward_kinematics(model_, state, kinematics_);
  for (std::size_t i = 0; i < shapes_.impulses.size(); ++i) {
    const double* const at = &integrals[kOfGroup * stored_.size() + 6 * i];
    shapes_.impulses[i].on_b = {{at[0], at[1], at[2]}, {at[3], at[4], at[5]}};
  }
  for (std::size_t g = 0; g < stored_.size(); ++g) {
    const double* const at = &integrals[kOfGroup * g];
    shapes_.integrals[g] = {at[0], at[1], at[2], at[3], at[4]};
    if (std::isnan(stored_[g])) stored_[g] = shapes_.contacts.elastic_energy(g, kinematics_);
    const bool acts = shapes_.contacts.history(g).since.has_value();
    if (!acts && at[0] == 0) continue;
    const double stored = acts ? shapes_.contacts.elastic_energy(g, kinematics_) : 0;
    const double error = std::abs(at[0] + stored - stored_[g] + at[1] + at[2]);
    shapes_.elastic_energy[g] = stored;
    if (peaks_.peaks()[g].beyond_model) continue;  // forces may jump (23.14)
    if (!(error <= shapes_.energy_error)) shapes_.energy_error = error;
    shapes_.energy_exchanged = std::max({shapes_.energy_exchanged, stored, std::abs(at[0]), at[1], at[2]});
  }
}

}  // namespace grapnel
