#pragma once

/// @file
/// State of the inner time of contact_path.hpp, with the phases that the contacts are in: what steps need to know of it
/// and what follows from them. Dimensionless: velocities over the fastest approach, W over its largest normal entry,
/// stiffness over the largest.

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

/// A state and what follows from it.
struct PathPoint {
  PathState y;
  Eigen::VectorXd u;  // 3 n: velocities
  PathState rate;     // of y; not of the end of a stiff step
};

/// What a contact is doing.
struct PathSpring {
  NormalPhase phase = NormalPhase::open;
  Hold hold = Hold::slides;
  Eigen::Vector2d direction = Eigen::Vector2d::Zero();  // of sliding while its speed is still zero
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();     // tangential velocity that counts as none
  Eigen::Vector2d share = Eigen::Vector2d::Zero();      // where sticking is redundant: force over the cone's radius
  double released = 0;  // Newton's: the normal velocity at which the spring releases; otherwise 0
  double top = 0;       // f when unloading began
  double slope = 0;     // Poisson's: f' while unloading
};

/// What some contacts at rest in their tangent planes are to each other. It does not change along the path.
struct RestMobility {
  std::vector<int> contacts;
  Eigen::MatrixXd A;        // W_tt
  Eigen::MatrixXd inverse;  // A^+
  bool redundant = false;   // A is singular
};

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
  /// Whether of all contacts that touch the normal forces, and velocities less what Newton's hypothesis wants, have
  /// become this small: contacts can rebound from each other for ever, by the same factor in every cycle.
  bool rebounds_negligible(double small) const;
  /// Whether bodies are wedged: contacts that touch move no faster than `small`, and friction lets their forces balance
  /// each other, so that they never will. Newton's hypothesis can let these grow for ever.
  enum class Wedge { none, at_rest, ever_harder };
  Wedge wedged(double small);
  double friction(int i) const { return problem_.contacts[static_cast<std::size_t>(i)].friction; }

  double normal_velocity(const PathPoint& at, int i) const { return at.u[3 * i]; }
  /// Tangential velocity less what counts as none.
  Eigen::Vector2d slip(const PathPoint& at, int i) const { return at.u.segment<2>(3 * i + 1) - contact(i).offset; }
  /// Square of the frequency of contact i's spring alone; 0 where it does not act.
  double frequency_squared(int i) const;

  /// Whether contact i can meet this event now; how far it is from it, positive before it; and the rate of that at the
  /// step's beginning (0 for the cone).
  bool watches(int i, Watch watch) const;
  double gap(const PathPoint& at, int i, Watch watch) const;
  double gap_rate(int i, Watch watch) const;
  /// The event has happened to contact i now.
  void pass(int i, Watch watch);

  /// The friction of the contacts `rest`, all others that touch sliding.
  RestProblem at_rest(const std::vector<int>& rest);
  /// Of what has been asked of friction at rest: the largest FrictionForces::missed; how often it crawled.
  double law_missed() const { return law_missed_; }
  int crawled() const { return crawled_; }
  void count(const FrictionForces& forces) {
    law_missed_ = std::max(law_missed_, forces.missed);
    crawled_ += forces.crawled ? 1 : 0;
  }
  void count(const StickShare& share) { crawled_ += share.crawled; }
  /// After any change of phase, hold or share.
  void prepare();

  void begin_step();
  /// For an explicit step from now() in this lane: everything, or what has changed since the last.
  void enter(const PathLanes& lanes, int lane);
  void put(const PathLanes& lanes, int lane, double h);
  /// What came of it, in end(); its error over the tolerance.
  double take(const PathLanes& lanes, int lane);
  /// A step of size h for contacts that slide slowly, come to rest or begin to slide: needs none of their holds. The
  /// same.
  double try_stiff_step(double h);
  /// The last step ends where the next begins.
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
  double speed_ = 1, mobility_ = 1, rounding_ = 0;  // what makes things dimensionless
  Eigen::MatrixXd W_;
  Eigen::VectorXd before_, stiffness_;
  std::vector<PathSpring> springs_;
  PathTable at_;
  std::vector<double> table_;            // of the equations, as lanes have it
  std::deque<RestMobility> mobilities_;  // of the sets of contacts that have been asked for
  PathPoint now_, end_;
  bool rates_known_ = false, end_rates_known_ = false;
  bool springs_changed_ = false, point_changed_ = false;  // since they were put into a lane
  // Scratch of the right-hand side and of the stiff step: contacts that touch and rub, their W_tt, velocities without
  // friction and cones.
  Eigen::VectorXd b_, u_, force_, end_rate_;
  PathState difference_;
  std::vector<int> rubbing_, sticking_;
  Eigen::MatrixXd rub_;
  FrictionChoice rub_choice_ = FrictionChoice::any;
  double law_missed_ = 0;
  int crawled_ = 0;
  Eigen::VectorXd rub_rate_, rub_radius_;
};

}  // namespace grapnel
