#pragma once

/// @file
/// Solves the impact of a contact and writes its report.

#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/impact/published_impact.hpp"
#include "grapnel/impact_report/contact.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Residuals of the equations that define an impact's solution.
struct ImpactResiduals {
  double momentum = 0;             // ImpactSolution::generalized_momentum_residual
  double energy = 0;               // energy_identity_residual
  std::optional<double> velocity;  // constraint_residual, of laws that prescribe the relative velocity afterwards
  std::optional<double> cone;      // ContactImpactSolution::cone_residual
};

struct ImpactOutcome {
  ImpactReport report;
  ImpactResiduals residuals;
  State after;                                // configuration of the contact, velocities after the impact
  Momentumd from_ground = Momentumd::zero();  // impulse of a fixed base's mount, about the world's origin, in W
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
  ImpactSetup::Law law = ImpactSetup::Law::plastic;  // any but compliant
  CaptureDetail detail = CaptureDetail::full;
};
/// @throws std::invalid_argument if the system is numerically singular; std::runtime_error if a contact law's solution
/// does not converge.
ImpactOutcome run_impact(const ImpactTask& task);

/// Changes by an impact between two states, link by link: bodies, base, joints, targets, energies, and impulses
/// transmitted by joints for the given external impulses. Fills these parts of the report. Returns the momentum from
/// the ground.
Momentumd describe_change(const CaptureProblem& problem, const CaptureSystem& system, const State& before,
                          const State& after, std::span<const ExternalImpulse> external, ImpactReport& report);

/// One grasp before its impulse is known.
GraspImpulse describe_meeting(const CaptureProblem& problem, const Contact& contact, const Kinematics& before,
                              std::size_t grasp);

/// The joint of a held rate.
const JointDescription& held_joint(const Model& model, const HeldRate& held);

/// Overpowered drives of an impact, with deviations, as text; empty if none.
std::string describe_giving_way(const Model& model, const ImpactReport& report);

struct BrakeOutcome {
  BrakeReport report;
  std::vector<JointImpulse> joints;  // transmitted by joints due to it
  State after;
  double energy_identity_residual = 0;
  Momentumd from_ground = Momentumd::zero();  // as in ImpactOutcome
};
/// Brakes stop joints (indices in system.robot_joints) instantaneously. `problem` has the grasps that hold, `grasps`
/// are these; `driven`: rates that ideal drives of other joints keep.
BrakeOutcome run_brake(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                       std::span<const Grasp> grasps, std::span<const std::size_t> joints,
                       std::span<const HeldRate> driven);

/// Relative momentum errors of the published formulas, once the ledger's scales are known.
void scale_published(const LedgerScale& scale, ImpactReport& report);

}  // namespace grapnel
