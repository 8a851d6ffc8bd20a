#include "grapnel/capture/impact_book.hpp"

namespace grapnel {
namespace {

// The largest so far; a NaN stays.
void raise(double& largest, double value) {
  if (!(value <= largest)) largest = value;
}
void raise(std::optional<double>& largest, const std::optional<double>& value) {
  if (!value) return;
  if (!largest) largest = 0;
  raise(*largest, *value);
}

}  // namespace

void ImpactBook::note(const ImpactResiduals& residuals) {
  if (!residuals_) residuals_.emplace();
  raise(residuals_->momentum, residuals.momentum);
  raise(residuals_->energy, residuals.energy);
  raise(residuals_->velocity, residuals.velocity);
  raise(residuals_->cone, residuals.cone);
}

void ImpactBook::note_compliant(double energy_residual) { raise(compliant_, energy_residual); }

void ImpactBook::note_brake(double energy_identity_residual) { raise(brake_, energy_identity_residual); }

void ImpactBook::write(Ledger& ledger) const {
  const auto add = [&](const char* name, std::optional<double> value, const char* note, double bound = 1e-10) {
    if (value) ledger.entries.push_back({name, *value, bound, "1", note});
  };
  if (residuals_) {
    add("generalized_momentum_residual", residuals_->momentum,
        "(3.6): |M dv - J^T P| over |M v| of what takes part in the impact, energy norm");
    add("energy_identity_residual", residuals_->energy,
        "|dT - P^T (u- + u+) / 2| over the kinetic energy of what takes part in the impact");
    add("impact_constraint_residual", residuals_->velocity,
        "relative velocity left in the constrained directions over the largest velocity of what takes part");
    add("friction_cone_residual", residuals_->cone,
        "largest excess of a tangential impulse over friction times the normal one, over the largest normal one");
  }
  add("compliant_energy_residual", compliant_,
      "kinetic and elastic energy after an impact in time, and what was lost, over the kinetic energy of what takes "
      "part; what springs still held when impact.longest ended it counts as missing",
      1e-8);
  add("brake_energy_identity_residual", brake_, "the same for the impulse that locks the joints");
}

}  // namespace grapnel
