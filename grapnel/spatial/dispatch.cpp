#include "grapnel/spatial/dispatch.hpp"

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace grapnel::lanes {
namespace {

constexpr InstructionSet kAll[] = {InstructionSet::one_lane, InstructionSet::sse2, InstructionSet::avx2,
                                   InstructionSet::avx512};

}  // namespace

std::string_view name(InstructionSet set) {
  constexpr std::string_view kNames[] = {"one_lane", "sse2", "avx2", "avx512"};
  return kNames[static_cast<int>(set)];
}

int lane_count(InstructionSet set) { return 1 << static_cast<int>(set); }

bool is_supported(InstructionSet set) {
#ifdef GRAPNEL_LANES_X86
  // The instruction-set features that the compiler may use under each set's flags, see CMakeLists.txt. The checks
  // include the operating system's support for saving the wide registers.
  switch (set) {
    case InstructionSet::avx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
             __builtin_cpu_supports("avx512vl") && is_supported(InstructionSet::avx2);
    case InstructionSet::avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    default:
      return true;
  }
#else
  return set == InstructionSet::one_lane;
#endif
}

std::vector<InstructionSet> supported_instruction_sets() {
  std::vector<InstructionSet> sets;
  for (const InstructionSet set : kAll) {
    if (is_supported(set)) sets.push_back(set);
  }
  return sets;
}

std::optional<InstructionSet> best_instruction_set() {
  const char* wanted = std::getenv("GRAPNEL_LANES");
  if (wanted == nullptr || *wanted == '\0') {
    const InstructionSet widest = supported_instruction_sets().back();
    if (widest == InstructionSet::one_lane) return std::nullopt;
    return widest;
  }
  const std::string text = wanted;
  if (text == "off") return std::nullopt;
  std::string here = "off";
  for (const InstructionSet set : supported_instruction_sets()) {
    if (text == name(set)) return set;
    here += ", " + std::string(name(set));
  }
  throw std::runtime_error("GRAPNEL_LANES is '" + text + "'; expected one of those supported on this machine: " + here);
}

}  // namespace grapnel::lanes
