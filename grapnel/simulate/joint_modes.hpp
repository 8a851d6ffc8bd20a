#pragma once

/// @file
/// Joints that stick, and joints that meet stops: the modes in which their motion is smooth, how they are chosen where
/// one ends, and the impacts at stops. docs/theory, section 19. Thread safety: one thread at a time.

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "grapnel/model/model.hpp"
#include "grapnel/simulate/friction_program.hpp"

namespace grapnel {

/// A joint between two events either moves, and its friction has one sense, or is held: at rest, by friction up to its
/// breakaway effort, at a stop also by the stop, which only pushes. Modes change at events, where a margin falls to
/// zero: a rate that turns round, a stop that is met, an effort that no longer holds.
///
/// Joints that move as prescribed have no modes.
class JointModes {
 public:
  enum class Mode { moving, held };
  enum class End : std::int8_t { lower = -1, none = 0, upper = 1 };

  struct Joint {
    std::size_t joint;  // position in Model::joints()
    int q, v;           // its places in State
    bool sticks;
    double viscous, coulomb, breakaway;  // zero where it does not stick
    double lower, upper;                 // where stops are; infinite: none
    double restitution, rest_rate;
    Mode mode = Mode::moving;
    double sense = 0;       // of its motion, +1 or -1, against which Coulomb's friction acts
    End end = End::none;    // at which stop it is
    double unit = 1;        // of its holding effort, where the efforts of several joints are compared [N m or N]
    double slack = 0;       // of the holding effort: rounding [N m or N]
    double relief = 1;      // factor on the slack where no choice of modes fits
    double rate_noise = 0;  // rounding error of its acceleration where it slips [rad/s^2 or m/s^2]
    // Since begin():
    int sticks_count = 0, breakaways = 0, stop_impacts = 0;
    double stop_energy_lost = 0;  // [J]
    double largest_share = 0;     // of its breakaway effort that friction has given while it was held
    bool undetermined = false;    // closed loops have left that friction open
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
  /// `prescribed`: per velocity of the model, those that move as prescribed.
  JointModes(const Model& model, std::span<const std::uint8_t> prescribed);

  bool empty() const { return joints_.empty(); }
  const std::vector<Joint>& joints() const { return joints_; }
  /// Of one of the model's joints; null: it has no modes.
  const Joint* of(std::size_t joint) const { return at_[joint] < 0 ? nullptr : &joints_[at_[joint]]; }
  bool any_held() const;
  /// The first ones since begin(), and how many there were.
  const std::vector<StopImpact>& stop_impacts() const { return stop_impacts_; }
  long stop_impact_count() const { return stop_impact_count_; }

  /// A phase begins with this state: forgets what was, and takes modes by rates alone. A joint that is beyond its stop
  /// is stopped where it is.
  void begin(std::span<const double> q, std::span<const double> v);

  /// Friction of a joint that moves [N m or N].
  static double sliding_friction(const Joint& joint, double rate) {
    return -(joint.viscous * rate + joint.coulomb * joint.sense);
  }

  /// Efforts that closed loops leave open between held joints: per velocity, one column for each self-stress, and the
  /// size of the self-stress. No columns: none.
  struct OpenEfforts {
    Eigen::MatrixXd effort, terms;
  };
  /// What a choice of modes means: accelerations per velocity; per joint of the model the effort that holds it, of
  /// friction and stop together, where it is held, and the rounding error of that effort.
  struct Response {
    std::span<const double> acceleration, holding, rounding;
    OpenEfforts open = {};
    bool possible = true;  // the held joints do not contradict the closed loops
  };
  /// How joints at rest answer to unit efforts at their axes, all of them free.
  struct Mobility {
    Eigen::MatrixXd with_loops;     // accelerations [1/(kg m^2) or 1/kg]; singular where loops leave less freedom
    Eigen::VectorXd without_loops;  // of each under its own effort, loops open
  };
  /// The dynamics as choose() sees them.
  struct Dynamics {
    std::function<Response()> respond;  // with the present modes
    std::function<Mobility(std::span<const int> velocities)> mobility;
    /// Accelerations of these without friction and stops, under the efforts of motors of the last response.
    std::function<Eigen::VectorXd(std::span<const int> velocities)> released;
  };
  /// Chooses the modes for the motion that goes on from a state: all joints at rest are held where that takes no
  /// friction above breakaway; else those slip that the convex program (19.15) has slip, with (19.18) for breakaway
  /// efforts above Coulomb's.
  void choose(std::span<const double> q, std::span<const double> v, const Dynamics& dynamics);

  /// Positive while the modes of joints that move may stay.
  double moving_margin(std::span<const double> q, std::span<const double> v) const;
  /// The same of those that are held; `holding` per joint of the model. Of several sets of holding efforts the one that
  /// exceeds the limits least counts.
  double holding_margin(std::span<const double> holding, const OpenEfforts& open) const;
  /// Replaces the efforts in `holding` that loops leave open by the admissible set of least norm in shares of
  /// breakaway. Returns the velocities of joints whose efforts were open.
  std::vector<int> share_out(const OpenEfforts& open, std::span<double> holding);
  /// Takes note of what friction gives at held joints.
  void note_holding(std::span<const double> holding);

  /// A change of rate that stops give: a velocity's place in State::v, and the change [rad/s or m/s].
  struct RateChange {
    int v;
    double change;
  };
  /// Of joints that stick and whose rates have just turned round: what is left of their rates, which events find to
  /// the resolution of time, taken away.
  std::vector<RateChange> overshoots(std::span<const double> v) const;

  /// What given changes of some velocities do to the whole system: changes of all velocities, and the impulses that
  /// those take, per velocity.
  struct ImpulseResponse {
    std::span<const double> change, impulse;
  };
  /// Joints that are at a stop and move on into it meet it: their rates become -restitution times what they were, or
  /// zero where they are slower than the rest rate; of several at one instant the least restitution holds for all.
  /// Joints that rest on a stop are kept by it where that takes a push. Stuck joints slide: no friction is felt in an
  /// impact. Changes q (to the very end of the range) and v. Whether anything was met.
  bool meet_stops(double time, std::span<double> q, std::span<double> v,
                  const std::function<ImpulseResponse(std::span<const RateChange>)>& respond);
  /// By the whole system in the last impact, all stops together [J].
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
  std::vector<int> at_;  // per joint of the model: place in joints_, or -1
  std::vector<StopImpact> stop_impacts_;
  long stop_impact_count_ = 0;
  double last_energy_lost_ = 0;
  bool chosen_ = false;  // since begin()
};

}  // namespace grapnel
