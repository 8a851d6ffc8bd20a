#include "grapnel/simulate/base_effector.hpp"

#include <cmath>

namespace grapnel {

Rotationd BaseMoment::R_WB() const {
  const auto [w, x, y, z] = attitude();
  const double size = std::sqrt(w * w + x * x + y * y + z * z);
  return rotation_matrix(Quaterniond{w / size, x / size, y / size, z / size});
}

// An effector without these contributions.
void BaseEffector::check(const Model&, int, std::span<const std::uint8_t>) const {}
void BaseEffector::prescribe(const PrescribedRates&) const {}
void BaseEffector::push(double, int, const Posed&, std::span<ExternalWrench>) {}
void BaseEffector::turn(const BaseMoment&, const Vector3d&, const ActuatorCommands&, const PrescribedRates&) {}
bool BaseEffector::cut(std::span<const double>, std::span<std::uint8_t>, std::span<double>) { return false; }
void BaseEffector::conclude(std::span<const double>, std::span<const double>, std::span<double>) {}
void BaseEffector::add_beside(const BaseMoment&, const Vector3d&, std::span<double>, std::span<double>) {}
void BaseEffector::begin(double, double) {}
void BaseEffector::reach(double) {}
double BaseEffector::next_edge(double, double end) const { return end; }
double BaseEffector::margin(std::span<const double>, const Evaluation&) { return 1; }
void BaseEffector::choose_modes(double, std::span<const double>, const Evaluation&) {}

}  // namespace grapnel
