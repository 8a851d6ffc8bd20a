#pragma once

/// @file
/// An impact that is resolved in time (ImpactSetup::Law::compliant): from a contact to what its grasps and contacts
/// bear, instant by instant.

#include <functional>

#include "grapnel/impact_report/impact_report.hpp"

namespace grapnel {

/// The system at one instant of the impact.
struct CompliantSample {
  double time = 0;                      // from its beginning [s]
  State state;                          // of the system given
  Kinematics kinematics;                // there
  std::vector<Wrenchd> grasp_wrenches;  // per grasp of the problem, on the robot at the contact, in W
  std::vector<Wrenchd> held_wrenches;   // per CaptureSystem::grasps, which hold already: likewise
  /// What a fixed base's mount put in since the sample before, about the world's origin, in W: all that there was.
  Momentumd from_ground = Momentumd::zero();
};

/// When a joint's loads are largest, from the impact's beginning on [s].
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
  std::string failure;  // not empty: it could not be integrated
};

/// A contact of the problem, where it begins, in the bodies of `system`.
struct YieldingContact {
  std::size_t grasp;  // of the problem
  CompliantContact contact;
};
std::vector<YieldingContact> yielding_contacts(const CaptureProblem& problem, const CaptureSystem& free,
                                               const Contact& contact, const CaptureSystem& system);

struct CompliantTask {
  const CaptureProblem& problem;                 // with the grasps that close now
  const CaptureSystem& free;                     // all targets free
  const Contact& contact;                        // of these grasps, in `free`; its state is the same as `met`
  const CaptureSystem& system;                   // with what is held already hanging on its arms; no closed loops
  const State& met;                              // of `system`, before brakes
  double time = 0;                               // [s]
  std::span<const HeldRate> held = {};           // velocities of `system` that drives and brakes keep
  std::span<const double> stopping = {};         // impulses with which they bring them there at once, likewise
  std::function<void(double t)> each_step = {};  // with the time since the beginning; may throw to end it
  ImpactDrive* drive = nullptr;                  // of joints that a law drives meanwhile
  std::function<void(const CompliantSample&)> look = {};  // sees all samples in turn, when it is over
};
/// From the state `met`, with what brakes make of it at once, until all is over.
CompliantRun run_compliant(const CompliantTask& task, const State& braked);

}  // namespace grapnel
