#pragma once

/// @file
/// Solves the impact of a contact and writes its report.

#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/impact/published_impact.hpp"
#include "grapnel/impact_report/contact.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// How far an impact's solution is from what defines it.
struct ImpactResiduals {
  double momentum = 0;             // ImpactSolution::generalized_momentum_residual
  double energy = 0;               // energy_identity_residual
  std::optional<double> velocity;  // constraint_residual, of laws that say what the relative velocity is afterwards
  std::optional<double> cone;      // ContactImpactSolution::cone_residual
};

struct ImpactOutcome {
  ImpactReport report;
  ImpactResiduals residuals;
  State after;                                // configuration of the contact, velocities after the impact
  Momentumd from_ground = Momentumd::zero();  // what a fixed base's mount put in, about the world's origin, in W
};

/// Which grasps take part in an impact, where, and by which law.
struct ImpactTask {
  const CaptureProblem&
      problem;  // with the grasps that take part, as `contact` lists them: first those that hold already
  const CaptureSystem& system;
  const Contact& contact;
  double time = 0;                                   // [s]
  std::size_t already_closed = 0;                    // grasps that hold already
  std::span<const HeldRate> held = {};               // rates that ideal drives, and brakes, keep or enforce
  ImpactSetup::Law law = ImpactSetup::Law::plastic;  // any but compliant
  CaptureDetail detail = CaptureDetail::full;
};
/// @throws std::invalid_argument where the system is numerically singular; std::runtime_error where a contact law's
/// solution does not converge.
ImpactOutcome run_impact(const ImpactTask& task);

/// What an impact between two states changed, link by link: bodies, base, joints, targets, energies, and what joints
/// passed on given the impulses from outside. Fills these parts of the report. The momentum that the ground put in.
Momentumd describe_change(const CaptureProblem& problem, const CaptureSystem& system, const State& before,
                          const State& after, std::span<const ExternalImpulse> external, ImpactReport& report);

/// One grasp before anything is known about its impulse.
GraspImpulse describe_meeting(const CaptureProblem& problem, const Contact& contact, const Kinematics& before,
                              std::size_t grasp);

/// The joint that a held rate is of.
const JointDescription& held_joint(const Model& model, const HeldRate& held);

/// Which drives gave way in an impact and by how much, in words; empty if none did.
std::string describe_giving_way(const Model& model, const ImpactReport& report);

struct BrakeOutcome {
  BrakeReport report;
  std::vector<JointImpulse> joints;  // what joints pass on because of it
  State after;
  double energy_identity_residual = 0;
  Momentumd from_ground = Momentumd::zero();  // as in ImpactOutcome
};
/// Brakes stop joints (positions in system.robot_joints) at once. `problem` has the grasps that hold, `grasps` are
/// they; `driven`: rates that ideal drives of other joints keep.
BrakeOutcome run_brake(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                       std::span<const Grasp> grasps, std::span<const std::size_t> joints,
                       std::span<const HeldRate> driven);

/// Relative momentum errors of the published formulas, once the ledger's scales are known.
void scale_published(const LedgerScale& scale, ImpactReport& report);

}  // namespace grapnel
