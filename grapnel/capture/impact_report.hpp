#pragma once

/// @file
/// Solves the impact of a contact and writes its report.

#include "grapnel/capture/contact.hpp"
#include "grapnel/impact/impact_law.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Residuals of the equations that define an impact's solution, as far as they apply.
struct ImpactResiduals {
  std::optional<double> momentum = {};  // ImpactSolution::generalized_momentum_residual
  std::optional<double> energy = {};    // energy_identity_residual
  std::optional<double> velocity = {};  // constraint_residual, of laws that prescribe the relative velocity afterwards
  std::optional<double> cone = {};      // ImpactSolution::cone_residual
  std::optional<double> in_time = {};   // energy_residual; what springs still held at impact.longest is missing
  std::optional<double> brake = {};     // energy_identity_residual of an impulse that locks joints
};

/// Times of a joint's maximum loads in a compliant impact, from its beginning [s].
struct JointPeakTimes {
  double force = 0, moment = 0, driving = 0;
};

/// An impact of closing grasps, contacts or brakes, under any law.
struct ImpactOutcome {
  ImpactReport report;
  ImpactResiduals residuals;
  State after;  // instantaneous: configuration of the contact
  /// Impulse of a fixed base's mount, about the world's origin, in W; of a compliant impact: since the last sample.
  Momentumd from_ground = Momentumd::zero();
  // Of a compliant impact:
  std::vector<JointPeakTimes> joint_peaks;  // per entry of report.joints
  /// Per grasp of the problem: empty, or how it still was under way when impact.longest ended it, in words.
  std::vector<std::string> unfinished;
  std::vector<std::string> warnings;
  // Of hard contacts that take part:
  std::vector<ContactPointImpulse> hard;  // per entry of ImpactTask::hard; empty: none does
  /// Work that these exchange with the law's own contacts, less the losses of those [J].
  double exchanged_with_contacts = 0;
};

/// The grasps in an impact, and its law.
struct ImpactTask {
  const CaptureProblem&
      problem;  // with the grasps in the impact, in the order of `contact`: first those that already hold
  const CaptureSystem& system;
  const Contact& contact;
  double time = 0;                                   // [s]
  std::size_t already_closed = 0;                    // grasps that already hold
  std::span<const HeldRate> held = {};               // rates that ideal drives and brakes keep or enforce
  ImpactSetup::Law law = ImpactSetup::Law::plastic;  // instantaneous
  CaptureDetail detail = CaptureDetail::full;
  std::span<const HardPoint> hard = {};  // hard contacts that touch
};
/// Without new grasps it is the impact of brakes. @throws std::invalid_argument if the system is numerically singular;
/// std::runtime_error if the law finds no solution.
ImpactOutcome run_impact(const ImpactTask& task);

/// Changes by an impact between two states, link by link: bodies, base, joints, targets, energies, and impulses
/// transmitted by joints for the given external impulses. Fills these parts of the report. Returns the momentum from
/// the ground.
Momentumd describe_change(const CaptureProblem& problem, const CaptureSystem& system, const State& before,
                          const State& after, std::span<const ExternalImpulse> external, ImpactReport& report);

/// One grasp before its impulse is known.
GraspImpulse describe_grasp_before(const CaptureProblem& problem, const Contact& contact, const Kinematics& before,
                                   std::size_t grasp);

/// The same grasp, whose point is where it acts, once the impulse and the motion after it are known; `duration` of the
/// mean force [s].
void describe_grasp_after(const Grasp& grasp, const ContactImpulse& impulse, const Kinematics& after, double duration,
                          GraspImpulse& g);
/// The impulses of grasps and contacts, on both sides.
std::vector<ExternalImpulse> impulses_at(std::span<const Grasp> grasps, const ImpactSolution& solution);
/// Joints that brakes and drives held. `before`: velocities before brakes; `stopping`: in time, the initial impulses of
/// brakes per held rate, which `solution` follows.
void describe_held(const Model& model, std::span<const HeldRate> held, std::span<const double> before,
                   const ImpactSolution& solution, std::span<const double> stopping, ImpactReport& report);

/// Per grasp of the problem: the normal of a contact, from the target to the robot, in W; zero for a grasp.
std::vector<Vector3d> contact_normals(const CaptureProblem& problem, const CaptureSystem& system,
                                      const Kinematics& kinematics);

/// The joint of a held rate.
const JointDescription& held_joint(const Model& model, const HeldRate& held);

/// Overpowered drives of an impact, with deviations, as text; empty if none.
std::string describe_overpowered_drives(const Model& model, const ImpactReport& report);

/// The impact of brakes that lock `joints` (indices in CaptureSystem::robot_joints), as the report of these brakes.
BrakeReport brake_report(std::span<const std::size_t> joints, const ImpactReport& impact);

/// Relative momentum errors of the published formulas, once the ledger's scales are known.
void scale_published(const LedgerScale& scale, ImpactReport& report);

}  // namespace grapnel
