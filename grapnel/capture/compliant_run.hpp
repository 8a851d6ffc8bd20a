#pragma once

/// @file
/// A compliant impact (ImpactLaw::in_time): from a contact to the loads of its grasps and contacts, instant by instant.

#include <functional>

#include "grapnel/capture/impact_report.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "grapnel/impact/compliant_shapes.hpp"

namespace grapnel {

/// The system at one instant of the impact.
struct CompliantSample {
  double time = 0;                      // from its beginning [s]
  State state;                          // of the system given
  Kinematics kinematics;                // at that state
  std::vector<Wrenchd> grasp_wrenches;  // per grasp of the problem, on the robot at the contact, in W
  std::vector<Wrenchd> held_wrenches;   // per CaptureSystem::grasps, which already hold: likewise
  std::vector<Wrenchd> slip_wrenches;   // per CaptureSystem::slips: of the part that a closure holds
  /// Impulse of a fixed base's mount, and of obstacles, since the previous sample, about the world's origin, in W: the
  /// only external one.
  Momentumd from_ground = Momentumd::zero();
  /// Contacts between shapes, per pair of bodies; empty: none has touched in the impact.
  std::span<const GroupContact> contacts = {};
};

/// A contact that closes, in the bodies of a system.
struct ClosingContact {
  std::string end_effector, target;
  CompliantContact contact;
};
/// The contacts of the problem at their beginning, in the bodies of `system`.
std::vector<ClosingContact> closing_contacts(const CaptureProblem& problem, const CaptureSystem& free,
                                             const Contact& contact, const CaptureSystem& system);

struct CompliantTask {
  const CaptureProblem& problem;                 // with the closing grasps
  const CaptureSystem& free;                     // all targets free
  const Contact& contact;                        // of these grasps, in `free`; its state is the same as `start`
  const CaptureSystem& system;                   // with held targets already hanging on their arms
  const State& start;                            // of `system`, before brakes
  double time = 0;                               // [s]
  std::span<const HeldRate> held = {};           // velocities of `system` kept by drives and brakes
  std::span<const double> stopping = {};         // their initial impulses, likewise
  std::function<void(double t)> each_step = {};  // with the time since the beginning; may throw to end it
  ImpactDrive* drive = nullptr;                  // of joints driven by a law during the impact
  ImpactShapes* shapes = nullptr;                // contacts between shapes
  std::function<void(const CompliantSample&)> observe = {};  // receives all samples in order, after the end
};
/// Integrates from the state `start`, with the initial effect of brakes, to the end of the impact. @throws
/// std::runtime_error if the integration fails.
ImpactOutcome run_compliant(const CompliantTask& task, const State& braked);

}  // namespace grapnel
