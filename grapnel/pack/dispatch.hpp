#pragma once

/// @file
/// Which instruction sets the lanes can use here.
///
/// Every set has its own translation units, compiled with its flags; portable code reaches them only through tables of
/// function pointers. GRAPNEL_LANES in the environment overrides the choice.

#include <optional>
#include <string_view>
#include <vector>

namespace grapnel::lanes {

/// From the fewest lanes to the most. one_lane runs everywhere and is slow; it gives avx2's and avx512's bits.
enum class InstructionSet { one_lane, sse2, avx2, avx512 };

/// "one_lane", "sse2", "avx2", "avx512".
std::string_view name(InstructionSet set);
/// Doubles in a pack: 1, 2, 4, 8.
int lane_count(InstructionSet set);
/// Whether this program was built with the set's kernels and this processor and operating system can run them.
bool is_supported(InstructionSet set);
/// All that are, from the fewest lanes to the most.
std::vector<InstructionSet> supported_instruction_sets();

/// The set that campaigns, impacts and plans use: the widest supported one, or what GRAPNEL_LANES names (sse2, avx2,
/// avx512, one_lane); nothing when it is "off", or where only one_lane is left. Throws std::runtime_error when it names
/// a set that does not exist or does not run here.
std::optional<InstructionSet> best_instruction_set();

}  // namespace grapnel::lanes
