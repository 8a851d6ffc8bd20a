#include "grapnel/capture/conservation_advice.hpp"

#include <fmt/format.h>

#include <string_view>

namespace grapnel {
namespace {

// The tightest tolerances that a scenario may ask for leave rounding alone.
constexpr double kRounding = 1e-13;

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
  for (std::string_view one : names) {
    if (name == one) return true;
  }
  return false;
}

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

// Of what is integrated: there the size of the steps decides.
std::string smaller_steps(const IntegrationSetup& integration) {
  if (integration.method == IntegrationSetup::Method::rk4) {
    return fmt::format(
        "integration.method: rk4 takes steps of {} s whatever the error: choose a smaller integration.step, "
        "or adaptive_8",
        integration.step);
  }
  if (integration.relative_tolerance > kRounding || integration.absolute_tolerance > kRounding) {
    return fmt::format(
        "smaller integration.relative_tolerance and absolute_tolerance may mend it; they are {:.3g} and {:.3g}",
        integration.relative_tolerance, integration.absolute_tolerance);
  }
  return "the tolerances are at rounding already: look for masses, stiffnesses or rates that differ by many orders of "
         "magnitude";
}

constexpr const char* kImpactEquations =
    "the equations of the impact are not solved to rounding, and no tolerance mends that: look for masses or inertias "
    "that differ by many orders of magnitude, or a nearly singular configuration (impact.rank)";

std::string advice_for(const CaptureProblem& problem, const DriftCause& drift, std::string_view row) {
  const IntegrationSetup& integration = problem.integration;
  const bool momentum = is_one_of(row, {"linear_momentum_drift", "angular_momentum_drift"});
  const bool impact =
      is_one_of(row, {"generalized_momentum_residual", "energy_identity_residual", "impact_constraint_residual",
                      "brake_energy_identity_residual", "friction_cone_residual"});
  if (problem.impact && problem.impact->law == ImpactSetup::Law::as_published &&
      (impact || (momentum && drift.in_impact)))
    return "impact.law: as_published is there to be compared with: it does not conserve momentum; impact.law: plastic "
           "does";
  if (impact) return kImpactEquations;
  if (momentum && drift.in_impact)
    return "momentum jumps at an impact, and no tolerance mends that: see the rows of the impact";
  if (const char* loops = comparison_loops(integration); loops && !momentum)
    return fmt::format("integration.loops: {} is there to be compared with; projection keeps loops closed", loops);
  if (row == "compliant_energy_residual")
    return "look for stiffness or damping that differs by many orders of magnitude between grips and contacts, and for "
           "an impact that is longer than impact.longest; integration tolerances do not act during it";
  if (momentum && !drift.integrated && integration.root_velocity == IntegrationSetup::RootVelocity::recovered)
    return "momentum is recovered, not integrated, so that no tolerance mends it: look for positions, speeds or masses "
           "that differ by many orders of magnitude within one group of bodies";
  return smaller_steps(integration);
}

}  // namespace

void advise(const CaptureProblem& problem, const DriftCause& drift, Ledger& ledger) {
  for (LedgerEntry& entry : ledger.entries) {
    if (entry.kind == LedgerEntry::Kind::conservation && !entry.pass())
      entry.advice = advice_for(problem, drift, entry.name);
  }
}

}  // namespace grapnel
