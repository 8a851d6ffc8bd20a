#include "grapnel/lanes/states.hpp"

#include <stdexcept>

namespace grapnel::lanes {
namespace {

using RunStates = void (*)(const StatesTables&, const StateCases&);

// Instruction set => kernel compiled for it; one lane for sets that this build lacks.
RunStates states_of(InstructionSet set) {
  return of_set(set, []<class Set>(std::type_identity<Set>) -> RunStates { return run_lane_states_of<Set>; });
}

bool is_requested(const StateDerivatives& d) {
  return d.value != nullptr || d.dq != nullptr || d.dv != nullptr || d.other != nullptr || d.dwrench != nullptr;
}

}  // namespace

States::States(const Model& model, InstructionSet set)
    : structure_(model.tree()),
      tables_{model.tree().links.data(), static_cast<int>(model.tree().links.size()), model.coordinates(),
              model.velocities(), structure_.tables()},
      run_(states_of(set)),
      run_few_(set == InstructionSet::sse2 ? run_ : run_lane_states_of<OneLane>),
      has_chains_(!model.tree().chains.empty()) {}

void States::run(const StateCases& cases) const {
  const bool differentiates = is_requested(cases.forward) || is_requested(cases.inverse);
  if (has_chains_ && (cases.accelerations || cases.mass_matrix || differentiates))
    throw std::invalid_argument("lanes: the model has modal joints, which lanes do not support");
  // A full pack costs the same for idle lanes and needs more memory, so few cases use a narrower one; not for
  // derivatives, of which most of the time is arithmetic.
  constexpr std::int64_t kFew = 2;
  (cases.count <= kFew && !differentiates ? run_few_ : run_)(tables_, cases);
}

}  // namespace grapnel::lanes
