#pragma once

/// @file
/// Joints with static friction and stops: modes in which their motion is smooth, the choice of modes at events, and
/// impacts at stops. docs/theory, section 19. Thread safety: one thread at a time.

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "grapnel/model/model.hpp"
#include "grapnel/simulate/friction_program.hpp"

namespace grapnel {

/// Between two events a joint either moves, with friction of constant sign, or is held at rest: by friction up to its
/// breakaway effort, and at a stop also by the stop, which only pushes. Modes change at events, at which a margin falls
/// to zero: a rate changes sign, a stop is reached, a holding effort exceeds its limit.
///
/// Joints that move as prescribed have no modes.
class JointModes {
 public:
  enum class Mode { moving, held };
  enum class End : std::int8_t { lower = -1, none = 0, upper = 1 };

  struct Joint {
    std::size_t joint;  // index in Model::joints()
    int q, v;           // its indices in State
    bool sticks;
    double viscous, coulomb, breakaway;  // zero without static friction
    double lower, upper;                 // positions of stops; infinite: none
    double restitution, rest_rate;
    Mode mode = Mode::moving;
    double sense = 0;       // of its motion, +1 or -1, opposite to Coulomb friction
    End end = End::none;    // the stop at which it is
    double unit = 1;        // of its holding effort, for comparison between joints [N m or N]
    double slack = 0;       // rounding error of the holding effort [N m or N]
    double relief = 1;      // factor on the slack if no choice of modes is consistent
    double rate_noise = 0;  // rounding error of its acceleration while it slips [rad/s^2 or m/s^2]
    // Since begin():
    int sticks_count = 0, breakaways = 0, stop_impacts = 0;
    double stop_energy_lost = 0;  // [J]
    double largest_share = 0;     // maximum of the holding friction over the breakaway effort
    bool undetermined = false;    // closed loops left that friction undetermined
  };

  /// An impact at a stop. `joint` as Joint::joint.
  struct StopImpact {
    double time;
    std::size_t joint;
    End end;
    double rate_before, rate_after;
    double impulse;      // of the stop on the joint [N m s or N s]
    double energy_lost;  // [J]
  };

  JointModes() = default;
  /// `prescribed`: per velocity of the model, whether it moves as prescribed.
  JointModes(const Model& model, std::span<const std::uint8_t> prescribed);

  bool empty() const { return joints_.empty(); }
  const std::vector<Joint>& joints() const { return joints_; }
  /// The modes of one of the model's joints; null: it has none.
  const Joint* of(std::size_t joint) const { return at_[joint] < 0 ? nullptr : &joints_[at_[joint]]; }
  bool any_held() const;
  /// The first ones since begin(), and their total number.
  const std::vector<StopImpact>& stop_impacts() const { return stop_impacts_; }
  long stop_impact_count() const { return stop_impact_count_; }

  /// Begins a phase with this state: resets all modes, and sets them by rates alone. A joint beyond its stop is stopped
  /// at its position.
  void begin(std::span<const double> q, std::span<const double> v);

  /// Friction of a moving joint [N m or N].
  static double sliding_friction(const Joint& joint, double rate) {
    return -(joint.viscous * rate + joint.coulomb * joint.sense);
  }

  /// Efforts of held joints that closed loops leave undetermined: per velocity, one column for each self-stress, and
  /// the magnitude of the self-stress. No columns: none.
  struct OpenEfforts {
    Eigen::MatrixXd effort, terms;
  };
  /// The response to a choice of modes: accelerations per velocity; per joint of the model the effort that holds it
  /// (friction and stop together) if it is held, and the rounding error of that effort.
  struct Response {
    std::span<const double> acceleration, holding, rounding;
    OpenEfforts open = {};
    bool possible = true;  // the held joints do not contradict the closed loops
  };
  /// The response of joints at rest to unit efforts at their axes, all of them free.
  struct Mobility {
    Eigen::MatrixXd with_loops;     // accelerations [1/(kg m^2) or 1/kg]; singular if loops reduce the freedom
    Eigen::VectorXd without_loops;  // of each joint under its own effort, loops open
  };
  /// The dynamics as a callback interface of choose().
  struct Dynamics {
    std::function<Response()> respond;  // with the current modes
    std::function<Mobility(std::span<const int> velocities)> mobility;
    /// Accelerations of these velocities without friction and stops, under the motor efforts of the last response.
    std::function<Eigen::VectorXd(std::span<const int> velocities)> released;
  };
  /// Chooses the modes of the motion that continues from a state. All joints at rest are held if that needs no friction
  /// above breakaway; otherwise the convex program (19.15) determines which slip, with (19.18) for breakaway efforts
  /// above Coulomb friction.
  void choose(std::span<const double> q, std::span<const double> v, const Dynamics& dynamics);

  /// Positive while the modes of moving joints are valid.
  double moving_margin(std::span<const double> q, std::span<const double> v) const;
  /// The same for held joints; `holding` per joint of the model. Of several sets of holding efforts, the one with the
  /// minimum excess counts.
  double holding_margin(std::span<const double> holding, const OpenEfforts& open) const;
  /// Replaces undetermined efforts in `holding` by the admissible set with the minimum norm, relative to breakaway
  /// efforts. Returns the velocities of the affected joints.
  std::vector<int> share_out(const OpenEfforts& open, std::span<double> holding);
  /// Records the friction of held joints.
  void note_holding(std::span<const double> holding);

  /// A change of rate caused by stops: the index of a velocity in State::v, and the change [rad/s or m/s].
  struct RateChange {
    int v;
    double change;
  };
  /// Corrections that set the rates of joints with static friction to zero after a change of sign: events have a finite
  /// resolution in time.
  std::vector<RateChange> overshoots(std::span<const double> v) const;

  /// The response of the whole system to given changes of some velocities: changes of all velocities, and the required
  /// impulses, per velocity.
  struct ImpulseResponse {
    std::span<const double> change, impulse;
  };
  /// Computes impacts of joints at a stop that move into it. Their rates become -restitution times the rates before, or
  /// zero if they are below the rest rate; of several at one instant the minimum restitution applies to all. Joints
  /// resting on a stop remain there if that needs a push. Stuck joints slide: friction has no effect in an impact.
  /// Changes q (to the exact end of the range) and v. Returns whether any impact occurred.
  bool meet_stops(double time, std::span<double> q, std::span<double> v,
                  const std::function<ImpulseResponse(std::span<const RateChange>)>& respond);
  /// Energy loss of the whole system in the last impact, all stops together [J].
  double last_energy_lost() const { return last_energy_lost_; }

 private:
  void take_modes(std::span<const double> q, std::span<const double> v);
  void settle(const Dynamics& dynamics);
  void take_slacks(const Response& response);
  EffortFamily held_family(std::span<const double> holding, const OpenEfforts& open) const;
  double held_excess(std::span<const double> holding, const OpenEfforts& open) const;
  void slip(const std::vector<Joint*>& resting, const Mobility& mobility, const Eigen::VectorXd& released,
            const Response& response, double slack_share);
  bool fits(const Response& response, const std::vector<Joint*>& resting) const;

  std::vector<Joint> joints_;
  std::vector<int> at_;  // per joint of the model: index in joints_, or -1
  std::vector<StopImpact> stop_impacts_;
  long stop_impact_count_ = 0;
  double last_energy_lost_ = 0;
  bool chosen_ = false;  // since begin()
};

}  // namespace grapnel
