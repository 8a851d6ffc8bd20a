#include "grapnel/impact/contact_impact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/impact/contact_path.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/impact/yielding_drives.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kOtherOrder = 100;       // factor on a stiffness that represents another order of the contacts
constexpr double kOtherTolerance = 1e-9;  // tolerance of the spread
constexpr int kOtherSteps = 5000;
constexpr double kUnique = 1e-6;          // spread below which the impulses count as unique
constexpr double kCreated = 1e-9;         // fraction of the exchanged work that counts as created energy
constexpr double kNothingYields = 1e-12;  // relative to the mobility of a contact without grasps and held rates

// Contacts => nothing; throws std::invalid_argument for restitution outside 0 to 1, negative friction, stiffness that
// is not positive, or a normal that is not a unit vector.
void check(std::span<const ContactPoint> contacts) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactPoint& c = contacts[i];
    const auto refuse = [&](const char* what, double value, const char* range) {
      throw std::invalid_argument(
          fmt::format("contact_impact: {} {} of contact {} is not {}", what, value, i + 1, range));
    };
    if (!(c.restitution >= 0 && c.restitution <= 1)) refuse("restitution", c.restitution, "within 0 to 1");
    if (!(c.friction >= 0 && std::isfinite(c.friction))) refuse("friction", c.friction, "zero or positive");
    if (!(c.relative_stiffness > 0 && std::isfinite(c.relative_stiffness))) {
      refuse("relative stiffness", c.relative_stiffness, "positive");
    }
    const double length = norm(c.n_W);
    if (!(std::abs(length - 1) <= 1e-9)) refuse("normal's length", length, "1");
  }
}

// Conversions between the 3-vectors of the kernels and of Eigen.
Eigen::Vector3d eigen(const Vector3d& a) { return {a[0], a[1], a[2]}; }
Vector3d vector(const Eigen::Vector3d& a) { return {a[0], a[1], a[2]}; }

// The contacts in the model: axes (rows normal, tangent, tangent, in W) and the Jacobian of their relative velocities
// along these.
struct ContactRows {
  std::vector<Eigen::Matrix3d> axes;
  Eigen::MatrixXd J;  // 3 n x velocities
};

// Kinematics and contacts => axes (rows: normal, two tangents, in W) and J, 3 rows per contact: velocity of the robot's
// point minus the target's along these axes (11.1).
ContactRows contact_rows(const Model& model, const Kinematics& kinematics, std::span<const ContactPoint> contacts) {
  ContactRows rows{{}, Eigen::MatrixXd(3 * static_cast<Eigen::Index>(contacts.size()), model.velocities())};
  Eigen::MatrixXd J_robot(6, model.velocities()), J_target(6, model.velocities());
  for (const ContactPoint& c : contacts) {
    const Rotationd R = rotation_between({0, 0, 1}, c.n_W);
    Eigen::Matrix3d axes;
    axes << eigen((1 / norm(c.n_W)) * c.n_W).transpose(), eigen(R.column(0)).transpose(),
        eigen(R.column(1)).transpose();
    point_jacobian(model, kinematics, c.robot_body, c.p_WC, J_robot);
    point_jacobian(model, kinematics, c.target_body, c.p_WC, J_target);
    rows.J.middleRows<3>(3 * static_cast<Eigen::Index>(rows.axes.size())) = axes * (J_robot - J_target).bottomRows<3>();
    rows.axes.push_back(axes);
  }
  return rows;
}

// The system seen from the contacts: their inverse inertia with grasps and held rates enforced, and the velocities once
// these are reached.
struct Felt {
  Eigen::MatrixXd W;
  Eigen::VectorXd velocity;  // of the model
  Eigen::VectorXd u;         // of the contacts
};

// M, its factor, J of contacts, bilateral rows, v- => W = J Pi M^-1 J^T, v0 and u0 = J v0 of (11.1), (11.2). Pi is
// applied column by column with solve_bilateral(). Rows of contacts without mobility are set to zero.
Felt felt(const Eigen::MatrixXd& M, const Cholesky& mass, const Eigen::MatrixXd& J, const BilateralRows& rows,
          const Eigen::VectorXd& v) {
  Felt f;
  if (rows.J.rows() == 0) {
    const Eigen::MatrixXd Y = lower_solution(mass, J.transpose());
    f.W = Y.transpose() * Y;
    f.velocity = v;
  } else {
    // The response to an impulse, M^-1 J^T, projected onto the motions that grasps and held rates permit.
    Eigen::MatrixXd response = cholesky_solution(mass, J.transpose());
    const Eigen::VectorXd free = response.cwiseProduct(J.transpose()).colwise().sum();
    for (Eigen::Index i = 0; i < response.cols(); ++i) {
      response.col(i) = solve_bilateral(M, mass, rows, response.col(i), Eigen::VectorXd::Zero(rows.J.rows())).velocity;
    }
    f.W = response.transpose() * M * response;
    for (Eigen::Index i = 0; i < f.W.rows(); ++i) {
      if (f.W(i, i) < kNothingYields * free[i]) f.W.row(i).setZero(), f.W.col(i).setZero();
    }
    f.velocity = solve_bilateral(M, mass, rows, v, rows.held_after).velocity;
  }
  f.u = J * f.velocity;
  return f;
}

ContactPathProblem path_problem(const Felt& f, std::span<const ContactPoint> contacts, const Eigen::MatrixXd& J,
                                RestitutionHypothesis hypothesis) {
  ContactPathProblem problem;
  problem.W = f.W;
  problem.u = f.u;
  problem.hypothesis = hypothesis;
  if (J.rows() > 0) problem.rounding = 1e-16 * (J.cwiseAbs() * f.velocity.cwiseAbs()).maxCoeff();
  for (const ContactPoint& c : contacts) {
    problem.contacts.push_back({c.restitution, c.friction, c.relative_stiffness, c.hypothesis});
  }
  return problem;
}

// Names a contact that is pressed together but cannot move; empty if there is none.
std::string unyielding(const ContactPathProblem& problem) {
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(problem.contacts.size()); ++i) {
    if (problem.W(3 * i, 3 * i) > 0 || problem.u[3 * i] >= -1e4 * problem.rounding) continue;
    return fmt::format("contact {}: held rates and grasps press it together at {:.3g} m/s and no body can move", i + 1,
                       -problem.u[3 * i]);
  }
  return {};
}

// The path, followed by those with which vary_order() evaluates the dependence on the order of the contacts: other
// stiffness ratios represent other orders.
std::vector<ContactPathProblem> with_other_orders(const ContactPathProblem& problem, bool spread) {
  const std::size_t n = problem.contacts.size();
  std::vector<ContactPathProblem> all(n < 2 || !spread ? 1 : 2 * n + 1, problem);
  for (std::size_t k = 0; k + 1 < all.size(); ++k) {
    ContactPathProblem& other = all[k + 1];
    other.tolerance = kOtherTolerance;
    other.max_steps = kOtherSteps;
    other.contacts[k / 2].stiffness *= k % 2 == 0 ? kOtherOrder : 1 / kOtherOrder;
  }
  return all;
}

// `paths`: of with_other_orders().
void vary_order(std::span<const ContactPath> paths, ImpactSolution& solution) {
  const ContactPath& path = paths[0];
  const std::size_t n = solution.points.size();
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, path.impulse[3 * static_cast<Eigen::Index>(i)]);
  if (largest == 0) return;
  for (const ContactPath& varied : paths.subspan(1)) {
    for (std::size_t i = 0; i < n; ++i) {
      const auto at = 3 * static_cast<Eigen::Index>(i);
      const double difference = varied.failure.empty() ? std::abs(varied.impulse[at] - path.impulse[at]) / largest
                                                       : std::numeric_limits<double>::infinity();
      solution.points[i].spread = std::max(solution.points[i].spread, difference);
    }
  }
  for (const ContactPointImpulse& c : solution.points) solution.unique = solution.unique && c.spread < kUnique;
}

// Path, velocities before and after => per contact in W: impulse, work, modes, relative velocities; also the cone
// residual relative to the largest normal impulse, and whether the contacts created energy (11.9).
void fill_contacts(const ContactPath& path, const ContactRows& rows, std::span<const ContactPoint> contacts,
                   const Eigen::VectorXd& before, const Eigen::VectorXd& after, ImpactSolution& solution) {
  double largest = 1e-300, turned_over = 0, gained = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const auto at = 3 * static_cast<Eigen::Index>(i);
    const Eigen::Vector3d P = path.impulse.segment<3>(at);
    const Eigen::Matrix3d out = rows.axes[i].transpose();
    ContactPointImpulse c;
    solution.contacts.push_back({{Vector3d::zero(), vector(out * P)}, {}});
    c.normal = P[0];
    c.tangential = vector(out.rightCols<2>() * P.tail<2>());
    c.compression = path.compression[i];
    c.compression_work = path.compression_work[i];
    c.normal_work = path.normal_work[i];
    c.friction_work = path.friction_work[i];
    c.modes = path.modes[i];
    c.velocity_before = vector(out * (rows.J.middleRows<3>(at) * before));
    c.velocity_after = vector(out * (rows.J.middleRows<3>(at) * after));
    solution.points.push_back(std::move(c));
    largest = std::max(largest, P[0]);
    solution.cone_residual = std::max(solution.cone_residual, P.tail<2>().norm() - contacts[i].friction * P[0]);
    turned_over += std::abs(path.compression_work[i]) + std::abs(path.friction_work[i]);
    gained += path.normal_work[i] + path.friction_work[i];
  }
  solution.cone_residual /= largest;
  solution.energy_created = gained > kCreated * turned_over;
}

// The total impulse of the grasps, as a generalized impulse.
Eigen::VectorXd generalized_impulse(const BilateralRows& rows, std::span<const Grasp> closed,
                                    const ImpactSolution& solution) {
  Eigen::VectorXd P(rows.J.rows());
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const Impulsed& F = solution.contacts[i].P_WC;
    Eigen::VectorXd six(6);
    six << eigen(F.angular), eigen(F.linear);
    P.segment(row, row_count(closed[i].model)) = constrained_directions(closed[i]) * six;
    row += row_count(closed[i].model);
  }
  for (double held : solution.held_impulses) P[row++] = held;
  return rows.J.transpose() * P;
}

}  // namespace

// State, contacts, hypothesis, closed grasps, held rates => v+, impulses, checks and dependence on the order of the
// contacts. Follows (11.3) to (11.8) with W of (11.2); grasps and held rates then receive their impulses by (7.7).
// `message` states why there is no solution; throws std::invalid_argument for invalid contacts.
ImpactSolution contact_impact(const Model& model, const State& state, std::span<const ContactPoint> contacts,
                              RestitutionHypothesis hypothesis, std::span<const Grasp> closed,
                              std::span<const HeldRate> held, const ContactImpactOptions& options) {
  check(contacts);
  const Kinematics kinematics = forward_kinematics(model, state);
  const Eigen::MatrixXd M = mass_matrix(model, state);
  const Cholesky mass(M);
  BilateralRows bilateral = bilateral_rows(model, kinematics, M, closed, held);
  const ContactRows rows = contact_rows(model, kinematics, contacts);
  const Eigen::VectorXd before =
      Eigen::Map<const Eigen::VectorXd>(state.v.data(), static_cast<Eigen::Index>(state.v.size()));

  if (options.keep_rates) {
    bilateral.held_after = bilateral.J * before;
  } else if (!closed.empty() && !held.empty()) {
    const Eigen::MatrixXd null = solve_bilateral(M, mass, bilateral, before, bilateral.held_after).null_space;
    if (const auto allowed = rates_that_grasps_allow(bilateral, bilateral.held_after, null))
      bilateral.held_after.tail(allowed->size()) = *allowed;
  }
  const Felt seen = felt(M, mass, rows.J, bilateral, before);
  ContactPathProblem problem = path_problem(seen, contacts, rows.J, hypothesis);
  problem.max_steps = options.max_steps;
  ImpactSolution solution;
  solution.message = unyielding(problem);
  if (!solution.message.empty()) {
    // Contacts receive no impulse: no finite one would suffice.
    for (auto& c : problem.contacts) c.stiffness = 1;
    problem.u.setZero();
  }
  // If the first path fails the spread is not needed, and only the spread needs the others.
  const std::vector<ContactPath> paths = follow_contacts(with_other_orders(problem, options.spread),
                                                         lanes::best_instruction_set(), OtherPaths::if_first_ends);
  const ContactPath& path = paths[0];
  if (solution.message.empty()) solution.message = path.failure;
  if (solution.message.empty()) solution.status = ImpactSolution::Status::solved;
  solution.steps = path.steps;

  // Grasps and held rates receive the impulses of the contacts and their own in one solution.
  State pushed = state;
  const Eigen::VectorXd brought = rows.J.transpose() * path.impulse;
  Eigen::Map<Eigen::VectorXd>(pushed.v.data(), before.size()) += cholesky_solution(mass, brought);
  Eigen::VectorXd impulse = brought;
  solution.velocity = pushed.v;
  if (bilateral.J.rows() > 0) {
    ImpactSolution bilateral_solution = solve_rows(M, bilateral, pushed, bilateral.held_after, closed, held);
    impulse += generalized_impulse(bilateral, closed, bilateral_solution);
    solution.velocity = std::move(bilateral_solution.velocity);
    solution.contacts = std::move(bilateral_solution.contacts);
    solution.held_impulses = std::move(bilateral_solution.held_impulses);
  }
  const Eigen::Map<const Eigen::VectorXd> after(solution.velocity.data(), before.size());
  Eigen::MatrixXd all(rows.J.rows() + bilateral.J.rows(), rows.J.cols());
  all << rows.J, bilateral.J;
  static_cast<ImpactChecks&>(solution) =
      impact_checks(M, mass, taking_part(model, all), before, after, impulse, 0.5 * impulse.dot(before + after));
  fill_contacts(path, rows, contacts, before, after, solution);
  const Eigen::VectorXd mean = 0.5 * (seen.u + rows.J * after);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const auto at = 3 * static_cast<Eigen::Index>(i);
    solution.points[i].work = path.impulse.segment<3>(at).dot(mean.segment<3>(at));
  }
  if (solution.status == ImpactSolution::Status::solved) vary_order(paths, solution);
  for (std::size_t i = closed.size(); i < solution.contacts.size(); ++i)
    solution.contacts[i].determined.assign(6, solution.unique);
  return solution;
}

}  // namespace grapnel
