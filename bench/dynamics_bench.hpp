#pragma once

/// @file
/// Registration of the benchmarks. Names are `<function>/<workload>`. Another engine's benchmark has the engine's name
/// in front, `mujoco:<function>/<workload>`, and computes the same result for the same states.
/// `<function>@<set>/<workload>` is the function in lanes of an instruction set, per state.

namespace grapnel::bench {

void register_dynamics();
void register_peak();
void register_lanes();
void register_loops();
void register_impacts();
void register_contact();
void register_plan();
void register_capture();
void register_campaign();
void register_rollouts();
void register_mujoco();             // if MuJoCo is installed
void register_mujoco_loops();       // same condition
void register_mujoco_capture();     // same condition
void register_mujoco_rollouts();    // same condition
void register_contact_precision();  // same condition
void register_contact_watch();      // same condition

}  // namespace grapnel::bench
