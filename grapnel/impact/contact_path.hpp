#pragma once

/// @file
/// The path of simultaneous contacts through the space of impulses, at one configuration (docs/theory, section 11).
///
/// In an inner time every contact has a linear normal spring of infinitesimal size and Coulomb friction on a rigid
/// tangent plane; the hypothesis of restitution determines how the spring unloads. For one contact the result does not
/// depend on its stiffness: it is Routh's construction. Integrated with DOP853 to `tolerance`; the instants at which a
/// spring turns, releases or begins to act, and at which a contact begins or ceases to slide, are located.

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/impact/contact_impact.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel {

struct PathContact {
  double restitution, friction, stiffness;               // as of ContactPoint
  std::optional<RestitutionHypothesis> hypothesis = {};  // absent: ContactPathProblem::hypothesis
};

struct ContactPathProblem {
  Eigen::MatrixXd W;  // 3 n x 3 n, contact by contact: normal, then two orthonormal tangents
  Eigen::VectorXd u;  // 3 n: velocities before [m/s]
  std::vector<PathContact> contacts;
  RestitutionHypothesis hypothesis = RestitutionHypothesis::stronge;
  double rounding = 0;  // of u [m/s]
  double tolerance = 1e-13;
  int max_steps = 100000;  // limit at which it fails
};

struct ContactPath {
  std::string failure;                          // empty if it reached its end
  Eigen::VectorXd impulse;                      // 3 n [N s]
  std::vector<double> compression;              // normal impulse while approaching, n [N s]
  std::vector<double> compression_work;         // normal work while approaching, n, <= 0 [J]
  std::vector<double> normal_work;              // n [J]
  std::vector<double> friction_work;            // n [J]
  std::vector<std::vector<ContactMode>> modes;  // n
  int steps = 0;
};

/// Several paths in parallel, in as many SIMD lanes as the set has; without a set sequentially, in doubles. A path
/// depends on its own problem alone: results are bit-identical for any combination and width among the sets with fused
/// products. All have the same number of contacts (std::invalid_argument). `others`: whether the other paths are
/// followed to their ends if the first has failed; otherwise they fail, too.
enum class OtherPaths { always, if_first_ends };
std::vector<ContactPath> follow_contacts(std::span<const ContactPathProblem> problems,
                                         std::optional<lanes::InstructionSet> set = lanes::best_instruction_set(),
                                         OtherPaths others = OtherPaths::always);
ContactPath follow_contacts(const ContactPathProblem& problem);

}  // namespace grapnel
