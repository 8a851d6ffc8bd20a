#pragma once

/// @file
/// Loads transmitted by joints and grasps at an instant of a motion: d'Alembert's principle body by body, and the
/// multipliers of (2.11) as internal wrenches.

#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Per body: the wrench that its joint transmits from the parent to it, in W, about the body frame's origin (the
/// joint), driving and constraint components alike. `vdot`: accelerations of the velocities; `external`: external
/// wrenches on the bodies of the tree.
std::vector<Wrenchd> joint_wrenches(const Model& model, const Kinematics& kinematics, std::span<const double> vdot,
                                    std::span<const ExternalWrench> external);
/// The same into `through`, resized to one per body.
void joint_wrenches(const Model& model, const Kinematics& kinematics, std::span<const double> vdot,
                    std::span<const ExternalWrench> external, std::vector<Wrenchd>& through);

/// The same at a sample of a phase (`kinematics` of its state), with gravity, loads, slipping grasps, and the wrenches
/// of grasps that close loops of the tree. `grasps`: the wrenches on the robot at the grasps, in W, per entry of
/// system.grasps.
std::vector<Wrenchd> joint_wrenches(const CaptureSystem& system, const Kinematics& kinematics,
                                    const PhaseSample& sample, std::span<const Wrenchd> grasps);

/// Impulses at joints and grasps in an impact of hard contacts, in W [N m s; N s].
struct InternalImpulses {
  std::vector<Wrenchd> joints;  // per body: transmitted by its joint to it, about the body frame's origin
  std::vector<Wrenchd> grasps;  // per entry of CaptureSystem::grasps: on the robot, at the grasp
};
/// From the changes of the velocities and the impulses of contacts and closures, body by body. Of redundant closures
/// the impulses are those of the loop solver; the grasps that its closures leave out (HeldGrasp::kRedundant) have none.
InternalImpulses internal_impulses(const CaptureSystem& system, const HardImpact& impact);

/// Bodies of the robot carried by joints, including fixed ones: all but the base. Their order is the robot's in every
/// model of one capture.
std::vector<int> carried_bodies(const CaptureSystem& system);
/// Those of them on joints of the robot, without the pieces of flexible links.
std::vector<int> loaded_bodies(const CaptureSystem& system);

/// Wrench of one grasp, on the robot at the grasp, in W, [moment; force].
struct GraspWrench {
  Wrenchd F_WC = Wrenchd::zero();
  std::vector<bool> determined;             // per component: independent of the self-stress of the loops
  Wrenchd beyond_solver = Wrenchd::zero();  // F_WC less the solution of the loop solver
};

/// Per entry of system.grasps, at a sample of a phase (`kinematics` of its state). All grasps of a target together
/// cause its motion; if loops are redundant or joints held, self-stresses leave single grasps undetermined. The
/// solution then minimizes the sum of F^T (J_t M_t^-1 J_t^T) F, as in the impact (7.8). `with_determined`: also fill
/// that member.
std::vector<GraspWrench> wrenches_of_grasps(const CaptureSystem& system, const Kinematics& kinematics,
                                            const PhaseSample& sample, bool with_determined = false);

/// Per entry of system.slips: the wrench on the robot at the grasp, in W: friction, and the closure of the part that
/// does not slip.
std::vector<Wrenchd> wrenches_of_slips(const CaptureSystem& system, const Kinematics& kinematics,
                                       const PhaseSample& sample);

/// Efforts of held joints that match these wrenches: for prescribed joints in a loop, their efforts include its
/// self-stress, and those in the sample match the solver's wrenches. Adds to `motor`, per Model::joints().
void add_self_stress(const CaptureSystem& system, const Kinematics& kinematics, std::span<const GraspWrench> wrenches,
                     std::span<double> motor);

}  // namespace grapnel
