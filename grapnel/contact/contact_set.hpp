#pragma once

/// @file
/// The contacts of a system: shapes on bodies, the pairs that may touch, the modes between which their forces are
/// smooth, and the instantaneous impacts of hard pairs.

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "grapnel/contact/pair_contact.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

struct Kinematics;
struct ContactChain;
class ChainMotion;

/// A surface of a body of a model; body -1: fixed in W.
struct ContactSurface {
  int body;
  ContactShape shape;
  /// Of a flexible link: its pieces. The shape is then in the link's frame L, the body is the first piece, and the
  /// other surface of its pairs is a sphere.
  std::shared_ptr<const ContactChain> chain = {};
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
  // Of hard pairs:
  long impacts = 0;                        // in an instant
  std::optional<double> last_impact;       // [s]
  std::optional<double> persistent_since;  // begin of the first persistent contact [s]
  double fastest_impact = 0;               // largest approach speed [m/s]
  double impact_impulse = 0;               // sum of the normal impulses [N s]
  double impact_work = 0;                  // of the impulses on both bodies [J]
  double impact_loss = 0;                  // by normal impulses: less restitution than 1 [J]
  double impact_friction_loss = 0;         // by tangential impulses [J]
};

/// A point at which a hard pair touches at the instant of an impact.
struct HardPoint {
  std::size_t pair;
  int body_a, body_b;  // -1: fixed in W
  Vector3d p_WC;
  Vector3d normal;        // unit, from a to b, in W
  double restitution;     // 0 to 1
  double friction;        // Coulomb's coefficient
  double approach_speed;  // [m/s]; negative: the bodies separate
  bool lasts;             // the pair has lasting contact, with forces
  double rest_speed;      // of the pair's law: slower approach begins lasting contact [m/s]
};
/// The impact at such a point.
struct HardPointImpact {
  double impulse = 0;           // normal [N s]
  double work = 0;              // of the whole impulse on both bodies [J]
  double loss = 0;              // of the normal impulse [J]
  double friction_loss = 0;     // of the tangential impulse [J]
  double separation_speed = 0;  // afterwards [m/s]
};

/// A pair is apart, without force; touching, with the forces of PairContact; or passing: its shapes overlap without
/// force until they are apart. Modes change where the gap of a pair changes sign. Thread safety: one thread at a time.
/// Forces depend on the state and the modes alone.
///
/// A hard pair (ContactLaw::hard) that closes has an impact in an instant and remains apart, unless it closes more
/// slowly than its rest speed, has had kCrowdedImpacts impacts within kCrowdedTime, or does not separate afterwards:
/// then it touches, with the forces of its law, until its gap exceeds kPartingGap (theory section 23, Hard contacts).
class ContactSet {
 public:
  enum class Mode : std::uint8_t { unknown, apart, touching, passing };

  /// All modes are unknown. @throws std::invalid_argument if an index or a group is invalid, if both surfaces of a pair
  /// are on one body, if a surface with a chain meets another shape than a sphere, or as PairContact.
  ContactSet(const std::vector<ContactSurface>& surfaces, const std::vector<SurfacePair>& pairs, int groups);

  /// Impacts of a hard pair within this time [s] after which it has persistent contact.
  static constexpr int kCrowdedImpacts = 20;
  static constexpr double kCrowdedTime = 0.01;
  /// Gap at which persistent contact of a hard pair ends [m].
  static constexpr double kPartingGap = 1e-6;

  std::size_t size() const { return pairs_.size(); }
  std::size_t groups() const { return groups_.size(); }
  int group_of(std::size_t pair) const { return pairs_[pair].group; }
  /// Both bodies of a pair; -1: fixed in W. Of a flexible link the first piece.
  std::pair<int, int> bodies_of(std::size_t pair) const { return {pairs_[pair].body_a, pairs_[pair].body_b}; }
  /// All bodies between which the forces of a pair may act.
  std::vector<std::pair<int, int>> all_bodies_of(std::size_t pair) const;
  /// Both bodies of the first pair of a group; -1: fixed in W, or the group has no pair.
  std::pair<int, int> bodies_of_group(std::size_t group) const {
    for (const Pair& pair : pairs_) {
      if (pair.group == static_cast<int>(group)) return {pair.body_a, pair.body_b};
    }
    return {-1, -1};
  }

  /// Chooses unknown modes: apart or touching.
  void begin(double t, const Kinematics& kinematics);
  Mode mode(std::size_t pair) const { return pairs_[pair].mode; }
  /// Takes modes and histories from another set with the same pairs and groups, as for another model of the bodies.
  void take(const ContactSet& other);
  /// Lets the shapes of a group pass through each other: pairs that overlap now act once they have been apart. With
  /// `but_touching`, pairs in contact remain in contact.
  void let_pass(int group, const Kinematics& kinematics, double t, bool but_touching = false);
  /// Positive while the modes of all watched pairs are valid [m]: gaps of pairs that are apart, depths of others.
  double margin(double t, const Kinematics& kinematics);
  /// Begins a step in this state, and watches all pairs. `duration`: of the step [s], as expected; a longer one may
  /// watch more pairs.
  void begin_step(const Kinematics& kinematics, double duration = std::numeric_limits<double>::infinity());
  /// Ends a step of this duration [s] in this state, in which the next one begins. Of this step, those pairs are
  /// watched whose modes may change if no velocity inside of the step exceeds kFaster times the largest one of its ends
  /// and the mean, or, of pairs with a sphere, no acceleration kFaster times the mean ones. Returns whether there are
  /// any. `prescribed_travel`: a bound of what changes of prescribed rates inside of the step add to the travel of
  /// shapes relative to each other, by any rates [m]; above zero, accelerations have no bound. `next`: duration of the
  /// step that begins here [s], if one is expected that is longer; a still longer one may watch more pairs.
  bool end_step(const Kinematics& kinematics, double duration, double prescribed_travel = 0, double next = 0);
  static constexpr double kFaster = 3;
  /// Whether the contact of a pair may end within a few steps of this duration [s] after the last begin_step() or
  /// end_step(), if velocities change little.
  bool may_part(double duration) const;
  /// The least overlap of the pairs that touch [m]; infinite without any. Their forces end with a kink where it is
  /// zero.
  double least_overlap(const Kinematics& kinematics);
  /// Changes modes whose margins are not positive.
  void choose_modes(double t, const Kinematics& kinematics);

  /// The points of all hard pairs that touch at this instant, if at least one of them must have an impact; otherwise
  /// none. Allocates.
  std::vector<HardPoint> impact_points(double t, const Kinematics& kinematics);
  /// The points of all hard pairs that touch at this instant, in lasting contact or not. Allocates.
  std::vector<HardPoint> touching_points(double t, const Kinematics& kinematics) const;
  /// Records an impact of these points, one entry each, and chooses the modes of their pairs.
  void note_impact(double t, std::span<const HardPoint> points, std::span<const HardPointImpact> impacts,
                   const Kinematics& kinematics);
  bool any_hard() const { return any_hard_; }
  /// Whether any pair's mode is touching.
  bool touches() const {
    return std::any_of(touching_.begin(), touching_.end(), [](int pairs) { return pairs > 0; });
  }

  /// Appends the wrenches on all bodies in contact, those on one pair's bodies after each other. Does not allocate if
  /// `wrenches` has room for most_wrenches() more.
  void evaluate(const Kinematics& kinematics, std::vector<ExternalWrench>& wrenches);
  /// Largest number of wrenches of evaluate().
  std::size_t most_wrenches() const;
  /// Radius of a sphere about a body's origin that contains its shapes of all pairs [m]: zero without any, infinite for
  /// half-spaces and flexible links.
  double reach_of(int body) const;
  /// Calls add(body_a, body_b, p_WC, wrench on b about it) with the forces of all pairs at the last evaluate().
  template <class Add>
  void each_force(Add&& add) const {
    for (const Pair& pair : pairs_) {
      if (pair.mode != Mode::touching || !pair.contact.last().touches) continue;
      for (int i = 0; i < pair.acting_count; ++i)
        add(pair.acting[i].body_a, pair.acting[i].body_b, pair.acting[i].p_WC, pair.acting[i].on_b);
    }
  }
  /// Numbers of a pair's StickState among those of stick().
  static constexpr int kStickCount = 4;
  /// Numbers that a system integrates besides its state, all zero at first.
  std::size_t stick_count() const { return kStickCount * pairs_.size(); }
  /// Sets these numbers for the following evaluations and changes of modes.
  void set_stick(std::span<const double> numbers);
  /// Sets the present deformations as those that belong to zero numbers.
  void rebase_stick();
  /// Appends `offset` + i for those numbers i on which forces depend with the present modes.
  void add_active_sticks(int offset, std::vector<int>& numbers) const;
  /// Their rates at the last evaluate().
  void stick_rates(std::span<double> rates) const;
  const GroupContact& group(std::size_t group) const { return groups_[group]; }
  const GroupHistory& history(std::size_t group) const { return histories_[group]; }
  /// The elastic energy of a group's touching pairs [J].
  double elastic_energy(std::size_t group, const Kinematics& kinematics);
  /// The distance of a pair's surfaces; negative: overlap [m].
  ShapeSeparation separation(std::size_t pair, const Kinematics& kinematics) const;

 private:
  /// Of a hard pair.
  struct HardHistory {
    double level = 0, level_time = 0;  // gap at which it closes after an impact [m], and the impact's time [s]
    std::array<double, kCrowdedImpacts> times = {};  // of the last impacts, cyclically
    std::size_t next = 0;                            // place of the next one
    bool full = false;
  };
  /// A pair at an end of a step. Apart: a lower bound of the gap [m], a bound of its rate [m/s], and the position of
  /// both shapes relative to each other. Touching or passing: the margin, and a bound of its rate.
  struct Clearance {
    double gap = 0, speed = 0;
    Vector3d between = Vector3d::zero();
    /// Of a pair with a sphere that is near: its margin and the margin's rate.
    bool is_smooth = false;
    double margin = 0, rate = 0;
  };
  /// Between two bodies, at the last evaluate().
  struct ActingForce {
    int body_a, body_b;
    Vector3d p_WC;
    Wrenchd on_b;  // about p_WC
  };
  struct Pair {
    int body_a, body_b, group;
    PairContact contact;
    /// Of a flexible link, on the side of a or b; the other shape is a sphere.
    std::shared_ptr<const ContactChain> chain = {};
    bool chain_is_a = false;
    Vector3d p_BC = Vector3d::zero();  // centre of the sphere on its body
    std::array<ActingForce, 2> acting = {};
    int acting_count = 0;
    Mode mode = Mode::unknown;
    bool watched = true;      // its margin counts
    Clearance at_begin = {};  // of the step
    /// Present deformation, and what the integrated numbers must be less for it.
    StickState stick = {}, base = {};
    HardHistory hard = {};
    bool is_hard() const { return contact.law().hard; }
  };
  static ChainMotion chain_motion(const Pair& pair, const Kinematics& kinematics);
  static std::pair<MovingBody, MovingBody> motions_of(const Pair& pair, const Kinematics& kinematics);
  static std::pair<Posed, Posed> poses_of(const Pair& pair, const Kinematics& kinematics);
  static void spread(Pair& pair, const ContactForce& force, const Kinematics& kinematics);
  double margin_of(Pair& pair, double t, const Kinematics& kinematics);
  Clearance clearance_of(Pair& pair, const Kinematics& kinematics, double duration);
  static bool may_change(const Clearance& begin, const Clearance& end, double duration, bool overlaps,
                         double prescribed_travel);
  void part(Pair& pair, double t, const Kinematics& kinematics);
  static bool is_crowded(const Pair& pair, double t);
  static bool takes_part(const Pair& pair);
  bool add_hard_points(std::size_t index, double t, const Kinematics& kinematics, std::vector<HardPoint>& points) const;
  void note_pair_impact(Pair& pair, double t, std::span<const HardPoint> points,
                        std::span<const HardPointImpact> impacts, const Kinematics& kinematics);
  bool parts(const Pair& pair, const Kinematics& kinematics) const;
  Mode mode_after(const Pair& pair, double margin, const Kinematics& kinematics) const;
  void set_mode(Pair& pair, Mode mode, double t);
  void add_to_group(const Pair& pair, const ContactForce& force, const Vector3d& force_on_b, double power);

  std::vector<Pair> pairs_;
  std::vector<GroupContact> groups_;
  std::vector<GroupHistory> histories_;
  std::vector<int> touching_;  // pairs, per group
  bool any_hard_ = false;
};

}  // namespace grapnel
