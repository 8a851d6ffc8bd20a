#include "grapnel/problem/vibration_modes.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// A mode whose translation, relative to the body's size, is below this fraction of its rotation has no sliding mass.
constexpr double kNoTranslation = 1e-9;
// Fraction of the mode's kinetic energy that belongs to the rotor with the mode's rotation.
constexpr double kRotorPart = 1e-12;
// Tolerance for modes that move more than the body's inertia: numbers in tables have some six digits.
constexpr double kExcess = 1e-6;

// Size of a body seen from its frame, whose origin may be at its end [m].
double reach_of(const BodyDescription& link) {
  const RigidBodyInertiad I = RigidBodyInertiad::about_com(link.mass, link.com, link.inertia);
  const Symmetric3d& J = I.rotational;
  return std::sqrt(2 * (J.xx + J.yy + J.zz) / link.mass);
}

// A mode as a body on one spring: a sliding point mass or a rotating body, and a rotor (22.9).
struct Oscillator {
  bool slides = false;
  double inertia = 0;  // of its coordinate: effective mass [kg], or moment of inertia [kg m^2]
  Vector3d axis{1, 0, 0};
  Vector3d place = Vector3d::zero();  // of the mass, in the link's frame [m]
  Vector3d spin = Vector3d::zero();   // angular momentum of the rotor per rate of the coordinate [kg m, or kg m^2]
};

Oscillator oscillator_of(const VibrationMode& mode, double reach) {
  Oscillator o;
  const Vector3d &t = mode.translation, &r = mode.rotation;
  o.slides = norm(t) * reach > kNoTranslation * norm(r);
  o.inertia = o.slides ? dot(t, t) : dot(r, r);
  if (!(o.inertia > 0)) return o;
  const double scale = std::sqrt(o.inertia);
  o.axis = (1 / scale) * (o.slides ? t : r);
  if (!o.slides) {
    o.spin = scale * r;
    return o;
  }
  // Position at which the mass has the part of the rotation across the axis; at most the body's size away.
  o.place = (1 / scale) * cross(o.axis, r);
  if (const double distance = norm(o.place); distance > reach) o.place = (reach / distance) * o.place;
  o.spin = scale * (r - cross(o.place, t));
  if (norm(o.spin) < 1e-14 * scale * norm(r)) o.spin = Vector3d::zero();  // rounding errors
  return o;
}

RigidBodyInertiad point_mass(const Oscillator& o) {
  return RigidBodyInertiad::about_com(o.slides ? o.inertia : 0, o.place, Symmetric3d::zero());
}

// The 6x6 matrix, [angular; linear], about the frame's origin.
Matrix6 matrix_of(const RigidBodyInertiad& I) {
  Matrix6 M = Matrix6::Zero();
  const Vector3d& h = I.first_moment;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) M(i, j) = I.rotational(i, j);
    M(3 + i, 3 + i) = I.mass;
  }
  M(0, 4) = M(4, 0) = -h[2], M(0, 5) = M(5, 0) = h[1];
  M(1, 3) = M(3, 1) = h[2], M(1, 5) = M(5, 1) = -h[0];
  M(2, 3) = M(3, 2) = -h[1], M(2, 4) = M(4, 2) = h[0];
  return M;
}

// The direction of a motion of the whole body in words, [angular; linear].
std::string direction_in_words(const Eigen::Matrix<double, 6, 1>& u, double reach) {
  static constexpr std::array kNames{"turning about x", "turning about y", "turning about z",
                                     "moving along x",  "moving along y",  "moving along z"};
  int largest = 0;
  const auto size = [&](int k) { return std::abs(u[k]) * (k < 3 ? reach : 1); };
  for (int k = 1; k < 6; ++k) {
    if (size(k) > size(largest)) largest = k;
  }
  return kNames[largest];
}

}  // namespace

std::vector<BodyDescription> bodies_of_modes(const BodyDescription& link) {
  std::vector<BodyDescription> bodies;
  const double reach = reach_of(link);
  RigidBodyInertiad counted_twice{0, Vector3d::zero(), Symmetric3d::zero()};
  int number = 0;
  for (const VibrationMode& mode : link.modes) {
    const Oscillator o = oscillator_of(mode, reach);
    const double omega = 2 * std::numbers::pi * mode.frequency;
    BodyDescription body;
    body.name = fmt::format("{}:mode-{}", link.name, ++number);
    body.parent = link.name;
    body.X_PF.p = o.place;
    body.joint.name = body.name;
    body.joint.type = o.slides ? JointType::prismatic : JointType::continuous;
    body.joint.axis = o.axis;
    body.part_of = link.name;
    double inertia = o.inertia;
    const double spin = norm(o.spin);
    if (o.slides) body.mass = o.inertia;
    if (spin > 0) {
      // For a given angular momentum, a slower rotor has less kinetic energy: the rotor turns slowly and its inertia is
      // large. Without a sliding mass, the rotor is the mode.
      body.joint.rotor_axis = (1 / spin) * o.spin;
      body.joint.gear_ratio = o.slides ? kRotorPart * o.inertia / spin : o.inertia / spin;
      body.joint.rotor_inertia = spin / body.joint.gear_ratio;
      inertia = (o.slides ? o.inertia : 0) + body.joint.reflected_inertia();
    }
    body.joint.spring = JointSpring{inertia * omega * omega, 2 * mode.damping_ratio * omega * inertia, 0};
    counted_twice += point_mass(o);
    bodies.push_back(std::move(body));
  }
  if (counted_twice.mass > 0) {
    BodyDescription less;
    less.name = fmt::format("{}:modes", link.name);
    less.parent = link.name;
    less.joint.name = less.name;
    less.joint.type = JointType::fixed;
    less.mass = -counted_twice.mass, less.com = counted_twice.com();
    const Symmetric3d J = counted_twice.rotational_about_com();
    less.inertia = {-J.xx, -J.yy, -J.zz, -J.xy, -J.xz, -J.yz};
    less.part_of = link.name;
    bodies.push_back(std::move(less));
  }
  return bodies;
}

std::string modes_fault(const BodyDescription& link) {
  if (link.beam) return "a body cannot have both a beam and modes";
  if (link.parent.empty()) return "the base cannot have modes; make panels links on it";
  int number = 0;
  Matrix6 P2 = Matrix6::Zero();
  for (const VibrationMode& mode : link.modes) {
    ++number;
    if (!(mode.frequency > 0)) return fmt::format("mode {} needs a positive frequency", number);
    const Vector3d &t = mode.translation, &r = mode.rotation;
    if (!(dot(t, t) + dot(r, r) > 0))
      return fmt::format("mode {} has no participation, so it cannot be excited", number);
    const Eigen::Matrix<double, 6, 1> P{r[0], r[1], r[2], t[0], t[1], t[2]};
    P2 += P * P.transpose();
  }
  // The rest, I - P P^T, must have positive kinetic energy (22.9b). With I = L L^T the maximum eigenvalue of L^-1 P P^T
  // L^-T is the fraction of the body's inertia that the modes move, in the direction of the maximum.
  const Matrix6 I = matrix_of(RigidBodyInertiad::about_com(link.mass, link.com, link.inertia));
  const Cholesky factor(I);
  const Eigen::MatrixXd half = lower_solution(factor, Eigen::MatrixXd(P2));
  const Eigen::MatrixXd part = lower_solution(factor, Eigen::MatrixXd(half.transpose()));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(Eigen::MatrixXd(0.5 * (part + part.transpose())));
  const double most = solver.eigenvalues()[5];
  const bool moves = link.joint.type != JointType::fixed;
  if (most > 1 + kExcess || (moves && most > 1 - kExcess)) {
    const Eigen::Matrix<double, 6, 1> u = upper_solution(factor, Eigen::VectorXd(solver.eigenvectors().col(5)));
    return fmt::format(
        "together the modes move {:.6g} times the body's inertia in one direction, mostly {}: {}; check units "
        "(kg^(1/2), kg^(1/2) m about the frame's origin) and the body's mass and inertia",
        most, direction_in_words(u, reach_of(link)),
        most > 1 + kExcess ? "the residual inertia would be negative" : "on a moving joint part of it must remain");
  }
  return {};
}

}  // namespace grapnel
