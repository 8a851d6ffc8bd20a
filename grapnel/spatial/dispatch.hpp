#pragma once

/// @file
/// Instruction sets available to the lanes on this machine.
///
/// Every set has its own translation units, compiled with its flags (cmake/GrapnelLanes.cmake); portable code reaches
/// them only through pointers to functions. GRAPNEL_LANES in the environment overrides the choice.

#include <optional>
#include <string_view>
#include <type_traits>
#include <vector>

namespace grapnel::lanes {

/// In order of increasing number of lanes. one_lane runs on every machine and is slow; its bits equal those of avx2 and
/// avx512.
enum class InstructionSet { one_lane, sse2, avx2, avx512 };

/// "one_lane", "sse2", "avx2", "avx512".
std::string_view name(InstructionSet set);
/// Number of doubles in a pack: 1, 2, 4, 8.
int lane_count(InstructionSet set);
/// Whether this program was built with the set's kernels and this processor and operating system can run them.
bool is_supported(InstructionSet set);
/// All supported sets, in order of increasing number of lanes.
std::vector<InstructionSet> supported_instruction_sets();

/// The set used by campaigns, impacts and plans: the widest supported one, or the one that GRAPNEL_LANES names (sse2,
/// avx2, avx512, one_lane). Empty if GRAPNEL_LANES is "off" or only one_lane is available. Throws std::runtime_error if
/// it names a set that does not exist or that this processor lacks.
std::optional<InstructionSet> best_instruction_set();

// Tags of the sets, defined in pack.hpp.
struct OneLane;
struct Sse2;
struct Avx2;
struct Avx512;

/// Returns f(std::type_identity<Set>{}) with the tag of `set`, or with OneLane if this build lacks the set. f returns a
/// pointer to a function that is compiled for Set.
template <class F>
auto of_set([[maybe_unused]] InstructionSet set, F&& f) {
#ifdef GRAPNEL_LANES_X86
  switch (set) {
    case InstructionSet::sse2:
      return f(std::type_identity<Sse2>{});
    case InstructionSet::avx2:
      return f(std::type_identity<Avx2>{});
    case InstructionSet::avx512:
      return f(std::type_identity<Avx512>{});
    case InstructionSet::one_lane:
      break;
  }
#endif
  return f(std::type_identity<OneLane>{});
}

}  // namespace grapnel::lanes
