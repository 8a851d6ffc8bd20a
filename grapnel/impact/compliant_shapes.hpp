#pragma once

/// @file
/// Contacts between shapes within a compliant impact (docs/theory, section 12, Contacts between shapes): the pairs of a
/// ContactSet act by the laws of section 23 while grasps and contact points deform.

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "grapnel/contact/contact_integrals.hpp"
#include "grapnel/contact/contact_peaks.hpp"
#include "grapnel/contact/contact_set.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/impact/compliant_kernel.hpp"

namespace grapnel {

class Model;

/// Impulse between two bodies over an impact; -1: fixed in W.
struct ShapeImpulse {
  int body_a, body_b;
  Impulsed on_b = Impulsed::zero();  // about ImpactShapes::point, in W [N m s; N s]
};

/// Contacts at a sample of an impact. Empty while no pair has touched.
struct ShapeSample {
  std::vector<ExternalWrench> wrenches;      // on all bodies in contact
  std::vector<GroupContact> groups = {};     // of the set
  Momentumd from_fixed = Momentumd::zero();  // impulse of fixed surfaces so far, about W's origin, in W
};

/// Contacts between shapes in an impact: what takes part, and the results.
struct ImpactShapes {
  ContactSet& contacts;  // no mode is unknown; has the modes and deformations at the end afterwards
  double begin = 0;      // of the impact, on the clock of the contacts [s]

  /// Whether a pair touched. Otherwise there are no results, and the impact is the same as without shapes, bit by bit.
  bool touched = false;
  // Per group:
  std::vector<ContactIntegrals> integrals = {};
  std::vector<ContactPeak> peaks = {};      // times since the beginning of the impact
  std::vector<double> elastic_energy = {};  // at the end [J]
  // Per pair of bodies:
  std::vector<ShapeImpulse> impulses = {};
  Vector3d point = Vector3d::zero();  // in W
  /// Largest |work + change of elastic energy + dissipated energy| of a group at the end of a step, and the largest of
  /// its terms, until an overlap is too deep for the model [J].
  double energy_error = 0, energy_exchanged = 0;
  double strike_work = 0;                 // of the impulses of hard pairs in an instant [J]
  std::vector<ShapeSample> samples = {};  // per sample of the impact
};

/// The forces of shapes for a CompliantSystem, in doubles. Its integrated numbers are the deformations of the pairs
/// that stick or slip (23.7a); per group ContactIntegrals, per pair of bodies ShapeImpulse.
class ShapeForces {
 public:
  /// `point`: in W, about which impulses are integrated.
  ShapeForces(const Model& model, ImpactShapes& shapes, const Vector3d& point);

  ContactSet& contacts() { return shapes_.contacts; }
  ImpactShapes& results() { return shapes_; }
  int integral_numbers() const {
    return static_cast<int>(kOfGroup * shapes_.integrals.size() + 6 * shapes_.impulses.size());
  }

  // Events:

  /// ContactSet::margin(), begin_step() and end_step() in a state, `t` since the beginning.
  double margin(double t, const State& state);
  void begin_step(const State& state);
  bool end_step(const State& state, double duration);

  /// Number of deformations that are integrated now: those of the pairs in contact with friction.
  int stick_numbers() const { return ContactSet::kStickCount * static_cast<int>(rubbing_.size()); }
  /// Sets them.
  void set_sticks(std::span<const double> numbers);
  /// Writes them.
  void get_sticks(std::span<double> numbers) const;
  /// Chooses the modes of all pairs in a state.
  void choose_modes(double t, const State& state);

  // Forces:

  /// Evaluates all pairs in a state.
  void evaluate(const State& state);
  /// Of the last evaluation: on links of the kernels' tree, and on bodies.
  std::span<const LinkForce<double>> link_forces() const { return link_forces_; }
  std::span<const ExternalWrench> wrenches() const { return wrenches_; }
  /// Rates of the deformations, and of the integrals of all groups and pairs of bodies.
  void stick_rates(std::span<double> rates);
  void integral_rates(std::span<double> rates) const;
  /// Impulse rate of each pair: add(body_a, body_b, p_WC, wrench on b about it).
  template <class Add>
  void each_force(Add&& add) const {
    shapes_.contacts.each_force(std::forward<Add>(add));
  }

  // Results:

  /// Adds a wrench on body b, or an impulse, to the numbers or rates of ShapeImpulse among the integrals.
  void add_impulse(int body_a, int body_b, const Vector3d& p_WC, const Wrenchd& on_b,
                   std::span<double> integrals) const;
  /// Updates the peaks by a step; `evaluate` evaluates all pairs at a time since the beginning.
  void note_peaks(double begin, double end, const std::function<void(double t)>& evaluate);
  /// Updates the integrals and the energy balances, by a state and the integrals there.
  void note_integrals(const State& state, std::span<const double> integrals);

 private:
  static constexpr std::size_t kOfGroup = 5;
  void find_rubbing();
  std::size_t find_impulse(int body_a, int body_b) const;

  const Model& model_;
  ImpactShapes& shapes_;
  ContactPeaks peaks_;
  Kinematics kinematics_;
  std::vector<std::size_t> rubbing_;          // the pairs in contact with friction
  std::vector<double> sticks_, stick_rates_;  // of all pairs: numbers of ContactSet::set_stick()
  std::vector<ExternalWrench> wrenches_;
  std::vector<LinkForce<double>> link_forces_;
  std::vector<double> stored_;  // elastic energy at the beginning, per group [J]
};

}  // namespace grapnel
