#pragma once

/// @file
/// Registration of the benchmarks. Names are `<function>/<workload>`; a peer's has the peer's name in front,
/// `mujoco:<function>/<workload>`, and answers the same question for the same states. `<function>@<set>/<workload>` is
/// the function in lanes of an instruction set, per state.

namespace grapnel::bench {

void register_dynamics();
void register_peak();
void register_lanes();
void register_loops();
void register_impacts();
void register_plan();
void register_capture();
void register_campaign();
void register_rollouts();
void register_mujoco();           // where MuJoCo was found
void register_mujoco_loops();     // likewise
void register_mujoco_capture();   // likewise
void register_mujoco_rollouts();  // likewise

}  // namespace grapnel::bench
