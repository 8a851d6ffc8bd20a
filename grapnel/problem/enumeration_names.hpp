#pragma once

/// @file
/// The names of enumerators of problems in files, messages and results, in the order of the values. JointControl and
/// JointType have separate tables.

#include "grapnel/describe/type.hpp"
#include "grapnel/impact/impact_law.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

template <>
struct Described<Geometry::Shape>
    : Enumeration<Geometry::Shape, "Shape", "", "box", "cylinder", "capsule", "sphere", "mesh"> {};
template <>
struct Described<RobotSetup::Base> : Enumeration<RobotSetup::Base, "Base", "free", "held", "fixed"> {};
template <>
struct Described<TargetSetup::Instant> : Enumeration<TargetSetup::Instant, "Instant", "start", "capture"> {};
template <>
struct Described<GraspModel> : Enumeration<GraspModel, "GraspModel", "rigid", "hinge", "point"> {};
template <>
struct Described<GraspSetup::Orientation>
    : Enumeration<GraspSetup::Orientation, "Orientation", "free", "axis", "pose"> {};
template <>
struct Described<GraspLimits::Combined>
    : Enumeration<GraspLimits::Combined, "CombinedLoad", "ellipsoid", "components"> {};
template <>
struct Described<GraspLimits::Beyond> : Enumeration<GraspLimits::Beyond, "BeyondLimits", "opens", "slips"> {};
template <>
struct Described<RateMatch> : Enumeration<RateMatch, "RateMatch", "velocity", "twist", "velocity_least_rates"> {};
template <>
struct Described<ThrusterModulation::Kind>
    : Enumeration<ThrusterModulation::Kind, "Modulation", "pulse_width", "schmitt"> {};
template <>
struct Described<JointProfile> : Enumeration<JointProfile, "JointProfile", "quartic", "cycloidal", "quintic"> {};
template <>
struct Described<PlanSetup::Objective>
    : Enumeration<PlanSetup::Objective, "Objective", "excursion", "nearest", "limits", "manipulability", "as_found",
                  "effort", "base_attitude", "base_motion", "clearance", "impulse", "impulse_index", "wheel_momentum"> {
};
template <>
struct Described<PlanSetup::Limits> : Enumeration<PlanSetup::Limits, "PlanLimits", "at_end", "on_the_way"> {};
template <>
struct Described<PlanSetup::Contacts> : Enumeration<PlanSetup::Contacts, "PlanContacts", "avoided", "allowed"> {};
template <>
struct Described<PlanSetup::IdleJoints> : Enumeration<PlanSetup::IdleJoints, "IdleJoints", "used", "held"> {};
template <>
struct Described<StraightIn::Roll> : Enumeration<StraightIn::Roll, "Roll", "free", "matched"> {};
template <>
struct Described<CaptureWindow::Choose>
    : Enumeration<CaptureWindow::Choose, "Choose", "objective", "soonest", "slowest"> {};
template <>
struct Described<ApproachSetup::CaptureAt> : Enumeration<ApproachSetup::CaptureAt, "CaptureAt", "end", "envelope"> {};
template <>
struct Described<ContactSetup::Gap>
    : Enumeration<ContactSetup::Gap, "Gap", "weld_as_found", "translate_target", "refuse"> {};
template <>
struct Described<PostImpactSetup::Joints>
    : Enumeration<PostImpactSetup::Joints, "Joints", "free", "pd", "computed_torque", "braked", "controller",
                  "detumble", "keep_base_attitude", "impedance", "grasp_force"> {};
template <>
struct Described<PhaseUntil::Event> : Enumeration<PhaseUntil::Event, "PhaseEvent", "law_ended", "latched"> {};
template <>
struct Described<ImpedanceSetup::Motion> : Enumeration<ImpedanceSetup::Motion, "Motion", "pose", "position", "plane"> {
};
template <>
struct Described<ImpedanceSetup::Law> : Enumeration<ImpedanceSetup::Law, "Law", "operational_space", "transpose"> {};
template <>
struct Described<ImpedanceSetup::Force> : Enumeration<ImpedanceSetup::Force, "Force", "sensed", "not_sensed"> {};
template <>
struct Described<ImpedanceSetup::Match> : Enumeration<ImpedanceSetup::Match, "Match", "none", "target"> {};
template <>
struct Described<GraspForceSetup::Motion> : Enumeration<GraspForceSetup::Motion, "Motion", "hold", "brake"> {};
template <>
struct Described<JointSensors::Rate> : Enumeration<JointSensors::Rate, "SensedRate", "difference", "sensor", "exact"> {
};
template <>
struct Described<IdentifySetup::Base> : Enumeration<IdentifySetup::Base, "SensedBase", "twist", "rotation"> {};
template <>
struct Described<LawModel> : Enumeration<LawModel, "LawModel", "truth", "assumed", "estimated"> {};
template <>
struct Described<OrbitSetup::Body> : Enumeration<OrbitSetup::Body, "CentralBody", "earth", "moon", "mars"> {};
template <>
struct Described<LoadFrame> : Enumeration<LoadFrame, "LoadFrame", "world", "body", "orbit"> {};
template <>
struct Described<LoadProfile::Shape>
    : Enumeration<LoadProfile::Shape, "Shape", "constant", "half_sine", "sine", "table"> {};
template <>
struct Described<IntegrationSetup::Method>
    : Enumeration<IntegrationSetup::Method, "Method", "automatic", "adaptive_8", "radau_9", "rk4"> {};
template <>
struct Described<IntegrationSetup::RootVelocity>
    : Enumeration<IntegrationSetup::RootVelocity, "RootVelocity", "recovered", "integrated"> {};
template <>
struct Described<IntegrationSetup::Loops>
    : Enumeration<IntegrationSetup::Loops, "Loops", "projection", "baumgarte", "acceleration", "open"> {};

}  // namespace grapnel
