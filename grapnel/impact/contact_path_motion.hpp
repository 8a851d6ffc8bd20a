#pragma once

/// @file
/// State and equations of motion of the inner time of contact_path.hpp, with the phases that the contacts are in, and
/// one step of DOP853. Dimensionless: velocities over the fastest approach, W over its largest normal entry, stiffness
/// over the largest.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "grapnel/impact/contact_path.hpp"
#include "grapnel/integrate/dormand_prince_853_kernel.hpp"

namespace grapnel {

// Coulomb friction of contacts that do not slide: forces that hold as many of them as the cones allow.

/// Friction at m points in their tangent planes.
struct FrictionForces {
  Eigen::VectorXd force;  // 2 m
  Eigen::VectorXd rate;   // 2 m: A force + b, how the points begin to slide: zero where they stick
};

/// The l that minimizes 1/2 l^T A l + l^T b over |l_i| <= radius_i (l_i: two components). Its optimality conditions are
/// Coulomb's law at the onset of sliding: either A l + b is zero at point i, or |l_i| = radius_i against it
/// (docs/theory.md, section 11). `A`: 2 m x 2 m, symmetric, positive semidefinite; the rate is unique also where it is
/// singular, the forces then are not. `start`: forces near the solution, or empty.
FrictionForces friction_at_rest(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius,
                                const Eigen::VectorXd& start = {});

/// Where every point can stick although A is singular: the factor by which all radii can shrink until one cannot, and
/// forces at (about) that factor. Above 1: not all can stick.
struct StickShare {
  Eigen::VectorXd force;
  double used = 0;  // largest |l_i| / radius_i
};
StickShare least_used_cones(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& radius);

enum class NormalPhase { open, loading, unloading };
enum class Hold { sticks, slides };

/// n normal forces f; 3 n impulses; then per contact the impulse of compression, its work, the work of the normal force
/// and that of friction.
using PathState = Eigen::VectorXd;

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

/// Contacts at rest in their tangent planes: rate = A force + b, |force_i| <= radius_i.
struct RestProblem {
  Eigen::MatrixXd A;
  Eigen::VectorXd b, radius;
  bool redundant = false;  // A is singular
};

/// Instants that end a step: the normal velocity turns, the spring releases, the friction force reaches its cone.
enum class Watch { velocity, release, cone };

class PathMotion {
 public:
  static constexpr std::size_t kStiffColumns = 8;

  explicit PathMotion(const ContactPathProblem& problem);

  int count() const { return count_; }
  double rounding() const { return rounding_; }
  const PathState& y() const { return y_; }
  const PathState& end() const { return end_; }
  PathSpring& contact(int i) { return springs_[static_cast<std::size_t>(i)]; }
  const PathSpring& contact(int i) const { return springs_[static_cast<std::size_t>(i)]; }
  bool touches(int i) const { return contact(i).phase != NormalPhase::open; }
  bool any_touching() const;
  /// Whether of all contacts that touch the normal forces, and velocities less what Newton's hypothesis wants, have
  /// become this small: contacts can rebound from each other for ever, by the same factor in every cycle.
  bool rebounds_negligible(double small) const;
  double friction(int i) const { return problem_.contacts[static_cast<std::size_t>(i)].friction; }

  double normal_velocity(const PathState& y, int i) const;
  /// Tangential velocity less what counts as none.
  Eigen::Vector2d slip(const PathState& y, int i) const;
  /// Square of the frequency of contact i's spring alone; 0 where it does not act.
  double frequency_squared(int i) const;

  /// Whether contact i can meet this event now; how far it is from it, positive before it; and the rate of that at the
  /// step's beginning (0 for the cone).
  bool watches(int i, Watch watch) const;
  double gap(const PathState& y, int i, Watch watch) const;
  double gap_rate(int i, Watch watch) const;
  /// The event has happened to contact i at y().
  void pass(int i, Watch watch);

  /// The friction of the contacts `rest`, all others that touch sliding.
  RestProblem at_rest(const std::vector<int>& rest) const;
  /// After any change of phase, hold or share.
  void prepare();

  void begin_step();
  /// A step of size h from y() to end(); its error over the tolerance.
  double try_step(double h);
  /// The same for contacts that slide slowly, come to rest or begin to slide: needs none of their holds.
  double try_stiff_step(double h);
  void accept() { y_ = end_; }
  /// Rate of the tangential velocity at the step's beginning.
  Eigen::Vector2d slip_rate(int i) const;

  void fill(ContactPath& path) const;

 private:
  template <std::size_t N>
  void stage(const std::array<dop853::Term, N>& row, int number, double h);
  void forces(const PathState& y, Eigen::VectorXd& u, Eigen::VectorXd& force) const;
  void derivative(const PathState& y, Eigen::Ref<Eigen::VectorXd> rate);
  void prepare_stiff();
  void moreau(double h, const Eigen::VectorXd& base, PathState& increment, Eigen::VectorXd& l);
  double unexplained(const Eigen::VectorXd& base, const PathState& increment) const;
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
  PathState y_, end_, stage_state_, difference_;
  Eigen::MatrixXd stages_;
  // Scratch of the right-hand side, and the solution operator of sticking: l = s - inverse (A s + b), s by share.
  mutable Eigen::VectorXd u_, force_, end_rate_;
  std::vector<int> sticking_;
  Eigen::MatrixXd inverse_;
  // Of the stiff step: contacts that touch and rub, their W_tt, velocities without friction and cones.
  std::vector<int> rubbing_;
  Eigen::MatrixXd rub_;
  Eigen::VectorXd rub_rate_, rub_radius_;
};

}  // namespace grapnel
