#pragma once

/// @file
/// The contacts of a system: shapes on bodies, the pairs that may touch, and the modes between which their forces are
/// smooth.

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/contact/pair_contact.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

struct Kinematics;

/// A surface of a body of a model; body -1: fixed in W.
struct ContactSurface {
  int body;
  ContactShape shape;
};

/// Two surfaces that may touch, by index, and their law. Pairs of one group are reported together.
struct SurfacePair {
  int a, b;
  ContactLaw law;
  int group = 0;
};

/// Sums over the pairs of a group, at the last evaluate().
struct GroupContact {
  bool touches = false;
  bool beyond_model = false;
  Vector3d p_WC = Vector3d::zero();        // centre of the normal forces, in W [m]
  Vector3d force_on_b = Vector3d::zero();  // on the second body, in W [N]
  double normal_force = 0;                 // sum of magnitudes [N]
  double depth = 0;                        // maximum [m]
  double slip_speed = 0;                   // largest of the pairs [m/s]
  double friction_use = 0;                 // largest of the pairs, ContactForce::friction_use
  double damping_power = 0;                // dissipated [W]
  double friction_power = 0;               // dissipated [W]
  double power = 0;                        // of the forces on both bodies [W]
};

/// Contact of a group over time, since construction or take().
struct GroupHistory {
  int touches = 0;                   // times that contact began
  std::optional<double> first_time;  // [s]
  std::optional<double> since;       // begin of the present contact [s]; absent: none
  double duration = 0;               // of past contacts [s]
};

/// A pair is apart, without force; touching, with the forces of PairContact; or passing: its shapes overlap without
/// force until they are apart. Modes change where the gap of a pair changes sign. Thread safety: one thread at a time.
/// Forces depend on the state and the modes alone.
class ContactSet {
 public:
  enum class Mode : std::uint8_t { unknown, apart, touching, passing };

  /// All modes are unknown. @throws std::invalid_argument if an index or a group is invalid, if both surfaces of a pair
  /// are on one body, or as PairContact.
  ContactSet(const std::vector<ContactSurface>& surfaces, const std::vector<SurfacePair>& pairs, int groups);

  std::size_t size() const { return pairs_.size(); }
  std::size_t groups() const { return groups_.size(); }
  int group_of(std::size_t pair) const { return pairs_[pair].group; }

  /// Chooses unknown modes: apart or touching.
  void begin(double t, const Kinematics& kinematics);
  Mode mode(std::size_t pair) const { return pairs_[pair].mode; }
  /// Takes modes and histories from another set with the same pairs and groups, as for another model of the bodies.
  void take(const ContactSet& other);
  /// Lets the shapes of a group pass through each other: pairs that overlap now act once they have been apart.
  void let_pass(int group, const Kinematics& kinematics, double t);
  /// Positive while all modes are valid [m]: gaps of pairs that are apart, depths of others.
  double margin(const Kinematics& kinematics);
  /// Changes modes whose margins are not positive.
  void choose_modes(double t, const Kinematics& kinematics);

  /// Appends the wrenches on all bodies in contact, those on one pair's bodies after each other. Does not allocate if
  /// `wrenches` has room for two per pair.
  void evaluate(const Kinematics& kinematics, std::vector<ExternalWrench>& wrenches);
  /// Numbers of a pair's StickState among those of stick().
  static constexpr int kStickCount = 4;
  /// Numbers that a system integrates besides its state, all zero at first.
  std::size_t stick_count() const { return kStickCount * pairs_.size(); }
  /// Sets these numbers for the following evaluations and changes of modes.
  void set_stick(std::span<const double> numbers);
  /// Sets the present deformations as those that belong to zero numbers.
  void rebase_stick();
  /// Their rates at the last evaluate().
  void stick_rates(std::span<double> rates) const;
  const GroupContact& group(std::size_t group) const { return groups_[group]; }
  const GroupHistory& history(std::size_t group) const { return histories_[group]; }
  /// The elastic energy of a group's touching pairs [J].
  double elastic_energy(std::size_t group, const Kinematics& kinematics);
  /// The distance of a pair's surfaces; negative: overlap [m].
  ShapeSeparation separation(std::size_t pair, const Kinematics& kinematics) const;

 private:
  struct Pair {
    int body_a, body_b, group;
    PairContact contact;
    Mode mode = Mode::unknown;
    /// Present deformation, and what the integrated numbers must be less for it.
    StickState stick = {}, base = {};
  };
  double margin_of(Pair& pair, const Kinematics& kinematics);
  bool parts(const Pair& pair, const Kinematics& kinematics) const;
  Mode mode_after(const Pair& pair, double margin, const Kinematics& kinematics) const;
  void set_mode(Pair& pair, Mode mode, double t);
  void add_to_group(const Pair& pair, const ContactForce& force, double power);

  std::vector<Pair> pairs_;
  std::vector<GroupContact> groups_;
  std::vector<GroupHistory> histories_;
  std::vector<int> touching_;  // pairs, per group
};

}  // namespace grapnel
