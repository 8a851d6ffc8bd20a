#pragma once

/// @file
/// State of the inner time of contact_path.hpp and the contacts' phases: the input of steps and derived quantities.
/// Dimensionless: velocities relative to the fastest approach, W to its largest normal entry, stiffness to the largest.

#include <Eigen/Core>
#include <algorithm>
#include <deque>
#include <vector>

#include "grapnel/impact/contact_path.hpp"
#include "grapnel/impact/contact_path_steps.hpp"
#include "grapnel/impact/friction_at_rest.hpp"

namespace grapnel {

enum class NormalPhase { open, loading, unloading };
enum class Hold { sticks, slides };

/// n normal forces f; 3 n impulses; then per contact the impulse of compression, its work, the work of the normal force
/// and that of friction.
using PathState = Eigen::VectorXd;

/// A state and derived quantities.
struct PathPoint {
  PathState y;
  Eigen::VectorXd u;  // 3 n: velocities
  PathState rate;     // of y; not at the end of a stiff step
};

/// The state of a contact.
struct PathSpring {
  NormalPhase phase = NormalPhase::open;
  Hold hold = Hold::slides;
  Eigen::Vector2d direction = Eigen::Vector2d::Zero();  // of sliding while its speed is still zero
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();     // tangential velocity that counts as zero
  Eigen::Vector2d share = Eigen::Vector2d::Zero();      // for redundant sticking: force over the cone's radius
  double released = 0;  // Newton's: the normal velocity at which the spring releases; otherwise 0
  double top = 0;       // f when unloading began
  double slope = 0;     // Poisson's: f' while unloading
};

/// Coupling of contacts at rest in their tangent planes. It is constant along the path.
struct RestMobility {
  std::vector<int> contacts;
  Eigen::MatrixXd A;        // W_tt
  Eigen::MatrixXd inverse;  // A^+
  bool redundant = false;   // A is singular
};

/// Sets slip rates that are rounding errors to zero: forces that balanced them would have no meaning. `size`: of the
/// terms of which b is the sum, with mobilities and speeds of the order of 1 (PathMotion).
inline void remove_rounding(Eigen::Ref<Eigen::VectorXd> b, double size) {
  if (b.norm() <= 1e-14 * size) b.setZero();
}

/// Contacts at rest in their tangent planes: rate = A force + b, |force_i| <= radius_i.
struct RestProblem {
  const RestMobility& mobility;
  Eigen::VectorXd b, radius;
};

/// Instants that end a step: the normal velocity turns, the spring releases, the friction force reaches its cone.
enum class Watch { velocity, release, cone };

class PathMotion {
 public:
  static constexpr std::size_t kStiffColumns = 8;

  explicit PathMotion(const ContactPathProblem& problem);

  int count() const { return count_; }
  double rounding() const { return rounding_; }
  const PathPoint& now() const { return now_; }
  const PathPoint& end() const { return end_; }
  PathSpring& contact(int i) { return springs_[static_cast<std::size_t>(i)]; }
  const PathSpring& contact(int i) const { return springs_[static_cast<std::size_t>(i)]; }
  bool touches(int i) const { return contact(i).phase != NormalPhase::open; }
  bool any_touching() const;
  /// Whether the normal forces of all touching contacts, and their velocities relative to Newton's hypothesis, are
  /// below `small`: contacts can rebound from each other endlessly, by the same factor in every cycle.
  bool rebounds_negligible(double small) const;
  /// Whether bodies are wedged: touching contacts move no faster than `small`, and friction lets their forces balance
  /// each other permanently. With Newton's hypothesis these forces can grow without bound.
  enum class Wedge { none, at_rest, ever_harder };
  Wedge wedged(double small);
  double friction(int i) const { return problem_.contacts[static_cast<std::size_t>(i)].friction; }
  RestitutionHypothesis hypothesis(int i) const {
    return problem_.contacts[static_cast<std::size_t>(i)].hypothesis.value_or(problem_.hypothesis);
  }

  double normal_velocity(const PathPoint& at, int i) const { return at.u[3 * i]; }
  /// Tangential velocity less the part that counts as zero.
  Eigen::Vector2d slip(const PathPoint& at, int i) const { return at.u.segment<2>(3 * i + 1) - contact(i).offset; }
  /// Square of the frequency of contact i's spring alone; 0 if it is inactive.
  double frequency_squared(int i) const;

  /// Whether this event can occur at contact i; its distance, positive before it; and the rate of the distance at the
  /// step's beginning (0 for the cone).
  bool watches(int i, Watch watch) const;
  double gap(const PathPoint& at, int i, Watch watch) const;
  double gap_rate(int i, Watch watch) const;
  /// Processes the event at contact i.
  void pass(int i, Watch watch);

  /// The friction problem of the contacts `rest`, with all other touching contacts sliding.
  RestProblem at_rest(const std::vector<int>& rest);
  /// Statistics of friction at rest: the maximum of FrictionForces::residual; the number of slow solutions.
  double law_residual() const { return law_residual_; }
  int crawled() const { return crawled_; }
  void count(const FrictionForces& forces) {
    law_residual_ = std::max(law_residual_, forces.residual);
    crawled_ += forces.crawled ? 1 : 0;
  }
  void count(const StickShare& share) { crawled_ += share.crawled; }
  /// Call after any change of phase, hold or share.
  void prepare();

  void begin_step();
  /// Writes an explicit step from now() into this lane: all data, or the changes since the last.
  void enter(const PathLanes& lanes, int lane);
  void put(const PathLanes& lanes, int lane, double h);
  /// Reads its result into end(); returns its error over the tolerance.
  double take(const PathLanes& lanes, int lane);
  /// A step of size h for contacts that slide slowly, come to rest or begin to slide: needs none of their holds.
  /// Returns the same.
  double try_stiff_step(double h);
  /// Makes the last step's end the current state.
  void accept();
  /// Rate of the tangential velocity at the step's beginning.
  Eigen::Vector2d slip_rate(int i) const;

  void fill(ContactPath& path) const;

 private:
  const RestMobility& mobility_of(const std::vector<int>& contacts);
  bool balanced(const std::vector<int>& rubbing, const Eigen::VectorXd& normal, double small);
  void find_rates(PathPoint& at);
  void write_springs();
  void write_undo();
  void prepare_stiff();
  void moreau(double h, PathState& increment, Eigen::VectorXd& l);
  double unexplained(const PathState& increment) const;
  double error_size(const PathState& error) const;
  void turn(int i, double velocity);
  void open(int i);
  double force_rate(int i, double normal_velocity) const;
  double stiffness(int i) const { return stiffness_[i]; }
  double restitution(int i) const { return problem_.contacts[static_cast<std::size_t>(i)].restitution; }

  const ContactPathProblem& problem_;
  int count_;
  double speed_ = 1, mobility_ = 1, rounding_ = 0;  // scales of the dimensionless quantities
  Eigen::MatrixXd W_;
  Eigen::VectorXd before_, stiffness_;
  std::vector<PathSpring> springs_;
  PathTable at_;
  std::vector<double> table_;            // of the equations, in the layout of lanes
  std::deque<RestMobility> mobilities_;  // of the sets of contacts used so far
  PathPoint now_, end_;
  bool rates_known_ = false, end_rates_known_ = false;
  bool springs_changed_ = false, point_changed_ = false;  // since they were written into a lane
  // Scratch of the right-hand side and of the stiff step: touching contacts with friction, their W_tt, velocities
  // without friction and cones.
  Eigen::VectorXd b_, u_, force_, end_rate_;
  PathState difference_;
  std::vector<int> rubbing_, sticking_;
  Eigen::MatrixXd rub_;
  FrictionChoice rub_choice_ = FrictionChoice::any;
  double law_residual_ = 0;
  int crawled_ = 0;
  Eigen::VectorXd rub_rate_, rub_radius_;
};

}  // namespace grapnel
