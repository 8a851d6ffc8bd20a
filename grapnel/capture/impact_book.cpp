#include "grapnel/capture/impact_book.hpp"

namespace grapnel {
namespace {

// The largest so far; a NaN stays.
void raise(double& largest, double value) {
  if (!(value <= largest)) largest = value;
}

}  // namespace

void ImpactBook::note(const ImpactSolution& solution) {
  if (!residuals_) residuals_.emplace();
  raise((*residuals_)[0], solution.generalized_momentum_residual);
  raise((*residuals_)[1], solution.energy_identity_residual);
  raise((*residuals_)[2], solution.constraint_residual);
}

void ImpactBook::note_brake(double energy_identity_residual) {
  if (!brake_) brake_ = 0;
  raise(*brake_, energy_identity_residual);
}

void ImpactBook::write(Ledger& ledger) const {
  const auto add = [&](const char* name, double value, const char* note) {
    ledger.entries.push_back({name, value, 1e-10, "1", note});
  };
  if (residuals_) {
    add("generalized_momentum_residual", (*residuals_)[0],
        "(3.6): |M dv - J^T P| over |M v| before the impact, energy norm");
    add("energy_identity_residual", (*residuals_)[1],
        "|dT - P^T (u- + u+) / 2| over the kinetic energy before the impact");
    add("impact_constraint_residual", (*residuals_)[2],
        "relative velocity left in the constrained directions over the largest velocity");
  }
  if (brake_) add("brake_energy_identity_residual", *brake_, "the same for the impulse that locks the joints");
}

}  // namespace grapnel
