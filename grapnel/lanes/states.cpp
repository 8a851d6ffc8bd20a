#include "grapnel/lanes/states.hpp"

#include <stdexcept>

namespace grapnel::lanes {
namespace {

using RunStates = void (*)(const StatesTables&, const StateCases&);

// Instruction set => kernel compiled for it; one lane for sets that this build lacks.
RunStates states_of(InstructionSet set) {
  return of_set(set, []<class Set>(std::type_identity<Set>) -> RunStates { return run_lane_states_of<Set>; });
}

}  // namespace

States::States(const Model& model, InstructionSet set)
    : tables_{model.tree().links.data(), static_cast<int>(model.tree().links.size()), model.coordinates(),
              model.velocities()},
      run_(states_of(set)),
      run_few_(set == InstructionSet::sse2 ? run_ : run_lane_states_of<OneLane>),
      has_chains_(!model.tree().chains.empty()) {}

void States::run(const StateCases& cases) const {
  // A full pack costs the same for idle lanes and needs more memory, so few cases use a narrower one.
  if (has_chains_ && (cases.accelerations || cases.mass_matrix))
    throw std::invalid_argument("lanes: the model has modal joints, which lanes do not support");
  constexpr std::int64_t kFew = 2;
  (cases.count <= kFew ? run_few_ : run_)(tables_, cases);
}

}  // namespace grapnel::lanes
