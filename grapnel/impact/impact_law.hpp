#pragma once

/// @file
/// The impact laws: one interface, and the table with one row per law. Everything that depends on the law of an impact
/// reads its row.

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <string_view>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/contact/contact_set.hpp"
#include "grapnel/describe/type.hpp"
#include "grapnel/impact/contact_impact.hpp"
#include "grapnel/impact/impact_setup.hpp"
#include "grapnel/impact/impact_solution.hpp"
#include "grapnel/model/model.hpp"

namespace grapnel {

class ImpactDrive;
struct ImpactShapes;

/// The input of every law.
struct ImpactInput {
  const Model& model;
  const State& state;  // just before the impact
  const ImpactSetup& setup;
  int root = -1;                              // body: the robot's base
  std::span<const Grasp> grasps = {};         // grasps and contacts; first grasps that already hold
  std::size_t holding = 0;                    // number of these
  std::span<const Vector3d> normals = {};     // per grasp: of a contact, from the target to the robot, in W; else zero
  std::span<const HeldRate> held = {};        // rates that drives and brakes hold
  std::span<const HardPoint> hard = {};       // hard contacts that touch; used by solve_impact() alone
  std::span<const ContactPoint> beside = {};  // further contacts, laws of contacts; last in the solution
  std::function<void(double)> each_step{};    // in time: called with the time reached; may throw to end it
  ImpactDrive* drive = nullptr;               // in time: efforts of joints
  ImpactShapes* shapes = nullptr;             // in time: contacts between shapes
  std::span<const LoopClosure> loops = {};    // in time: closures that hold

  bool is_contact(std::size_t grasp) const { return grasp < normals.size() && norm(normals[grasp]) > 0; }
};

struct ImpactLaw {
  ImpactSetup::Law law;
  std::string_view name;  // in files and results
  bool of_grasps;         // grasps close by it; otherwise they close plastically before its contacts touch
  bool of_contacts;       // contacts rebound by it
  bool in_time;           // integrated, and the system moves; otherwise instantaneous
  bool separates;         // its grasps do not hold afterwards, as contacts never do
  bool differentiable;    // impulse_sensitivities() and impulses_by_modes() are those of this law
  /// The thesis's formulas, for comparison: they conserve no momentum, and are defined for rigid bodies, a free base
  /// and rigid grasps that close together.
  bool published;
  /// One impulse per grasp, in the input's order. @throws std::invalid_argument if the system is numerically singular.
  ImpactSolution (*solve)(const ImpactInput&);
  std::array<std::string_view, 6> keys;  // of "impact" that only some laws use: those of this law

  bool uses(std::string_view key) const { return std::ranges::find(keys, key) != keys.end(); }
};

std::span<const ImpactLaw> impact_laws();
const ImpactLaw& impact_law(ImpactSetup::Law law);
inline const ImpactLaw& impact_law(const ImpactSetup& setup) { return impact_law(setup.law); }

struct CompliantContact;
/// The contact at a grasp with this normal, with the compliance of the setup.
CompliantContact compliant_contact(const ImpactSetup& setup, const Grasp& grasp, const Vector3d& n_W);

// Descriptions of the settings, whose keys are those of "impact" in scenarios (impact_law.cpp).
template <>
const Type& type_of<ImpactSetup::Law>();
template <>
const Type& type_of<ContactComplianceSetup>();
template <>
const Type& type_of<ImpactSetup>();

template <>
struct Described<ContactForceModel>
    : Enumeration<ContactForceModel, "ContactForceModel", "kelvin_voigt", "hertz", "hunt_crossley"> {};
template <>
struct Described<ImpactSetup::Joints>
    : Enumeration<ImpactSetup::Joints, "Joints", "free", "braked", "driven", "impedance"> {};
template <>
struct Described<RestitutionHypothesis>
    : Enumeration<RestitutionHypothesis, "RestitutionHypothesis", "newton", "poisson", "stronge"> {};
template <>
struct Described<ImpactSetup::Modes> : Enumeration<ImpactSetup::Modes, "Modes", "all", "none", "slow"> {};

}  // namespace grapnel
