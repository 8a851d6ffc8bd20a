#pragma once

/// @file
/// Linear couplings of joints (JointCoupling): their faults in descriptions, their defects, and the values of dependent
/// joints. Thread safety: free functions.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "grapnel/model/model.hpp"

namespace grapnel {

/// An error in JointDescription::mimic of one body.
struct CouplingFault {
  std::size_t body;      // index in the descriptions
  int term;              // index in mimic; -1: the coupling as a whole
  std::string key;       // of the term: "joint", "ratio", "offset"; empty: the term as a whole
  std::string text;      // "mimic names the unknown joint 'fingr'"
  bool unknown = false;  // the term's joint does not exist
};

/// All errors: a joint without one axis or with a spring, flexible gear or mode shapes; unknown joints; numbers that
/// are not finite or zero ratios; a joint that follows itself, also through other couplings, or one joint twice.
std::vector<CouplingFault> coupling_faults(std::span<const BodyDescription> bodies);

/// Couplings of bodies without faults, in the order of the bodies.
std::vector<JointCoupling> couplings_of(std::span<const BodyDescription> bodies);

/// The dependent joint's body.
inline int dependent_body(const JointCoupling& coupling) { return coupling.joints.front().body; }
/// Whether a body's joint depends on others: it has no motor.
inline bool follows_others(const Body& body) { return !body.description.joint.mimic.empty(); }
/// Whether the joint of `body` belongs to a coupling.
bool is_coupled(const Model& model, int body);

/// Sum of factor q - offset: zero if the coupling holds [rad or m, as the dependent joint].
double coupling_defect(const Model& model, const JointCoupling& coupling, std::span<const double> q);
/// Sum of factor v, its rate [rad/s or m/s].
double coupling_rate(const Model& model, const JointCoupling& coupling, std::span<const double> v);

/// Sets coordinates and rates of all dependent joints by their couplings.
void follow_couplings(const Model& model, std::span<double> q, std::span<double> v);

/// Factor of the unit effort of a coupling in the given scale: 1 / sqrt(sum of factor^2 / inertia) with each joint's
/// inertia of its body alone, its rotor included [sqrt(kg m^2) or sqrt(kg)].
double coupling_scale(const Model& model, const JointCoupling& coupling);

}  // namespace grapnel
