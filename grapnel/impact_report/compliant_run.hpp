#pragma once

/// @file
/// A compliant impact (ImpactSetup::Law::compliant): from a contact to the loads of its grasps and contacts, instant by
/// instant.

#include <functional>

#include "grapnel/impact_report/impact_report.hpp"

namespace grapnel {

/// The system at one instant of the impact.
struct CompliantSample {
  double time = 0;                      // from its beginning [s]
  State state;                          // of the system given
  Kinematics kinematics;                // at that state
  std::vector<Wrenchd> grasp_wrenches;  // per grasp of the problem, on the robot at the contact, in W
  std::vector<Wrenchd> held_wrenches;   // per CaptureSystem::grasps, which already hold: likewise
  /// Impulse of a fixed base's mount since the previous sample, about the world's origin, in W: the only external one.
  Momentumd from_ground = Momentumd::zero();
};

/// Times of a joint's maximum loads, from the impact's beginning [s].
struct JointPeakTimes {
  double force = 0, moment = 0, driving = 0;
};

struct CompliantRun {
  ImpactReport report;
  std::vector<JointPeakTimes> joint_peaks;  // per entry of report.joints
  State after;                              // of the system given
  double duration = 0;                      // [s]
  /// Of the balance, over the kinetic energy before; what springs still held when impact.longest ended it is missing.
  double energy_residual = 0;
  /// Per grasp of the problem: empty, or how it still was under way when impact.longest ended it, in words.
  std::vector<std::string> unfinished;
  Momentumd from_ground = Momentumd::zero();  // as in ImpactOutcome, since the last sample
  std::vector<std::string> warnings;
  std::string failure;  // not empty: the integration failed
};

/// A contact of the problem, at its beginning, in the bodies of `system`.
struct YieldingContact {
  std::size_t grasp;  // of the problem
  CompliantContact contact;
};
std::vector<YieldingContact> yielding_contacts(const CaptureProblem& problem, const CaptureSystem& free,
                                               const Contact& contact, const CaptureSystem& system);

struct CompliantTask {
  const CaptureProblem& problem;                 // with the closing grasps
  const CaptureSystem& free;                     // all targets free
  const Contact& contact;                        // of these grasps, in `free`; its state is the same as `met`
  const CaptureSystem& system;                   // with held targets already hanging on their arms; no closed loops
  const State& met;                              // of `system`, before brakes
  double time = 0;                               // [s]
  std::span<const HeldRate> held = {};           // velocities of `system` kept by drives and brakes
  std::span<const double> stopping = {};         // their initial impulses, likewise
  std::function<void(double t)> each_step = {};  // with the time since the beginning; may throw to end it
  ImpactDrive* drive = nullptr;                  // of joints driven by a law during the impact
  std::function<void(const CompliantSample&)> look = {};  // receives all samples in order, after the end
};
/// Integrates from the state `met`, with the initial effect of brakes, to the end of the impact.
CompliantRun run_compliant(const CompliantTask& task, const State& braked);

}  // namespace grapnel
