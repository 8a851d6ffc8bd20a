#include "grapnel/capture/bookkeeper.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// Deviation over scale; nothing deviates from nothing by nothing.
double relative(double deviation, double scale) { return deviation == 0 ? 0.0 : deviation / scale; }

// The largest so far; a NaN stays.
void raise(double& largest, double value) {
  if (!(value <= largest)) largest = value;
}

}  // namespace

SystemBooks system_books(const Model& model, const Kinematics& kinematics, const State& state) {
  SystemBooks books;
  books.com = center_of_mass(model, kinematics);
  books.about_com = books.about_origin = Momentumd::zero();
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const BodyMomentum m = body_momentum(model, kinematics, static_cast<int>(i));
    const Vector3d r = m.p_WC - books.com;
    books.about_origin += shift(m.h, -m.p_WC);
    books.about_com += shift(m.h, -r);
    books.linear_scale += norm(m.h.linear);
    books.angular_scale += norm(m.h.angular) + norm(cross(r, m.h.linear));
  }
  books.kinetic_energy = kinetic_energy(model, kinematics, state);
  return books;
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

void Bookkeeper::begin_phase(bool controlled) {
  controlled_ = controlled;
  (controlled ? any_controlled_ : any_uncontrolled_) = true;
  phase_started_ = false;
}

Bookkeeper::Deviation Bookkeeper::check_momentum(const SystemBooks& books, const Momentumd& entered) {
  if (!started_) expected_ = books.about_origin;
  started_ = true;
  const Momentumd difference = books.about_origin - (expected_ + entered);
  // The same deviation about the system's centre of mass, where it does not depend on where the origin is.
  const Deviation deviation{norm(difference.linear), norm(shift(difference, books.com).angular)};
  raise(linear_, deviation.linear);
  raise(angular_, deviation.angular);
  scale_.linear_momentum = std::max(scale_.linear_momentum, books.linear_scale);
  scale_.angular_momentum = std::max(scale_.angular_momentum, books.angular_scale);
  scale_.energy = std::max(scale_.energy, books.kinetic_energy);
  return deviation;
}

void Bookkeeper::instant(const SystemBooks& books) { check_momentum(books, Momentumd::zero()); }

void Bookkeeper::sample(const SystemBooks& books, const PhaseIntegrals& integrals) {
  check_momentum(books, integrals.external_impulse);
  if (!phase_started_) phase_energy_ = books.kinetic_energy;
  phase_started_ = true;
  const double work = integrals.motor_work + integrals.friction_work + integrals.external_work;
  raise(controlled_ ? work_energy_ : energy_, std::abs(books.kinetic_energy - phase_energy_ - work));
}

void Bookkeeper::take(const PhaseMeasures& measures) {
  const Deviation before = check_momentum(measures.start, Momentumd::zero());
  raise(linear_, before.linear + measures.linear_deviation);
  raise(angular_, before.angular + measures.angular_deviation);
  raise(controlled_ ? work_energy_ : energy_, measures.work_energy_residual);
  scale_.linear_momentum = std::max(scale_.linear_momentum, measures.scale.linear_momentum);
  scale_.angular_momentum = std::max(scale_.angular_momentum, measures.scale.angular_momentum);
  scale_.energy = std::max(scale_.energy, measures.scale.energy);
}

void Bookkeeper::end_phase(const PhaseIntegrals& integrals) { expected_ += integrals.external_impulse; }

void Bookkeeper::enter(const Momentumd& momentum) { expected_ += momentum; }

void Bookkeeper::write(Ledger& ledger) const {
  ledger.scale = scale_;
  ledger.entries.push_back({"linear_momentum_drift", relative(linear_, scale_.linear_momentum), 1e-11, "1",
                            "largest |p(t) - p(0) - external impulse| over scale.linear_momentum, all phases",
                            started_});
  ledger.entries.push_back({"angular_momentum_drift", relative(angular_, scale_.angular_momentum), 1e-11, "1",
                            "the same for angular momentum about the system's centre of mass", started_});
  ledger.entries.push_back(
      {"work_energy_residual", relative(work_energy_, scale_.energy), 1e-9, "1",
       "largest |T(t) - T(0) - work of motors, friction and external forces| over scale.energy, controlled phases",
       any_controlled_});
  ledger.entries.push_back(
      {"energy_drift", relative(energy_, scale_.energy), 1e-10, "1",
       "largest |T(t) - T(start) - work of friction and gravity| over scale.energy, uncontrolled phases",
       any_uncontrolled_});
}

}  // namespace grapnel
