#include "grapnel/control/impedance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// Singular values below this part of the largest are directions in which efforts cannot move an end-effector.
constexpr double kUnreachable = 1e-12;

using Vector6 = Eigen::Matrix<double, 6, 1>;

Vector6 stacked6(const Vector3d& angular, const Vector3d& linear) {
  Vector6 v;
  v << angular[0], angular[1], angular[2], linear[0], linear[1], linear[2];
  return v;
}

Vector3d scaled(const Vector3d& by, const Vector3d& v) { return {by[0] * v[0], by[1] * v[1], by[2] * v[2]}; }
Vector3d divided(const Vector3d& v, const Vector3d& by) { return {v[0] / by[0], v[1] / by[1], v[2] / by[2]}; }

Rotationd turned_about(const Vector3d& phi) {
  const double angle = norm(phi);
  if (angle < 1e-150) return Rotationd::identity();
  const Vector3d v = (std::sin(0.5 * angle) / angle) * phi;
  return rotation_matrix(Quaterniond{std::cos(0.5 * angle), v[0], v[1], v[2]});
}

// The angular velocity of exp(phi) is w = phi' + a phi x phi' + b phi x (phi x phi'), with a = (1 - cos x)/x^2 and b =
// (x - sin x)/x^3 at x = |phi|. The rates of a and b are a' = a1 phi.phi', b' = b1 phi.phi'.
struct TurnFactors {
  double a = 0, b = 0, a1 = 0, b1 = 0;
};
// x = |phi| => a, b and their derivatives a1, b1, in closed form or by power series for small x.
TurnFactors turn_factors(double x) {
  TurnFactors f;
  if (x < 1) {  // power series, since the closed forms cancel
    double term = 0.5;
    for (int k = 0; k < 12; ++k) {  // (-1)^k / (2k + 2)! and so on
      const double even = term, odd = term / (2 * k + 3);
      const double power = std::pow(x, 2 * k);
      f.a += even * power, f.b += odd * power;
      if (k > 0) {
        const double before = 2 * k * std::pow(x, 2 * k - 2);
        f.a1 += even * before, f.b1 += odd * before;
      }
      term *= -1.0 / ((2 * k + 3) * (2 * k + 4));
    }
    return f;
  }
  const double c = std::cos(x), s = std::sin(x), xx = x * x;
  f.a = (1 - c) / xx, f.b = (x - s) / (xx * x);
  f.a1 = (x * s - 2 * (1 - c)) / (xx * xx), f.b1 = (3 * s - 2 * x - x * c) / (xx * xx * x);
  return f;
}

// Angular velocity and acceleration of exp(phi).
BodyAcceleration turning(const Vector3d& phi, const Vector3d& rate, const Vector3d& second, Vector3d& velocity) {
  const TurnFactors f = turn_factors(norm(phi));
  const auto map = [&](const Vector3d& u) { return u + f.a * cross(phi, u) + f.b * cross(phi, cross(phi, u)); };
  velocity = map(rate);
  const double change = dot(phi, rate);
  const Vector3d across = cross(phi, rate);
  return {map(second) + (f.a1 * change) * across + (f.b1 * change) * cross(phi, across) + f.b * cross(rate, across),
          Vector3d::zero()};
}

// Length of the chain from the base to an end-effector.
double reach_of(const Model& model, const ImpedanceEndEffector& end_effector) {
  double length = norm(end_effector.X_BE.p);
  for (int body = end_effector.body; body >= 0 && model.bodies()[body].parent >= 0; body = model.bodies()[body].parent)
    length += norm(model.bodies()[body].description.X_PF.p);
  return length;
}

}  // namespace

// Reference, kinematics, accelerations => pose, twist and acceleration of D in W: uniform translation, or the body's
// motion composed with the path on it.
EndEffectorState end_effector_motion(const EndEffectorReference& reference, const Kinematics& kinematics,
                                     std::span<const BodyAcceleration> accelerations, double time) {
  EndEffectorState motion;
  if (reference.body < 0) {
    motion.X_WD = {reference.X_D.R, reference.X_D.p + (time - reference.begin) * reference.velocity};
    motion.V.linear = reference.velocity;
    return motion;
  }
  const JointPoint s = evaluate(reference.remaining_fraction, time);
  const Posed& X_WB = kinematics.X_WB[reference.body];
  const Twistd& V = kinematics.V_WB[reference.body];
  const BodyAcceleration& A = accelerations[reference.body];
  // On the body: s times the remaining offset, and (t - t_0) s times the velocity of departure, which contributes only
  // at the begin.
  const double since = time - reference.begin;
  const double u = since * s.position, u1 = s.position + since * s.rate, u2 = 2 * s.rate + since * s.acceleration;
  const Vector3d arm = X_WB.R * (reference.X_D.p + s.position * reference.offset + u * reference.departure);
  const Vector3d rate = X_WB.R * (s.rate * reference.offset + u1 * reference.departure);
  const Vector3d second = X_WB.R * (s.acceleration * reference.offset + u2 * reference.departure);
  const Vector3d phi = s.position * reference.turn + u * reference.turn_rate;
  Vector3d w_D;
  const BodyAcceleration turns = turning(phi, s.rate * reference.turn + u1 * reference.turn_rate,
                                         s.acceleration * reference.turn + u2 * reference.turn_rate, w_D);
  const Rotationd R_WX = X_WB.R * reference.X_D.R;
  const Vector3d w = R_WX * w_D;
  motion.X_WD = {R_WX * turned_about(phi), X_WB.p + arm};
  motion.V.angular = V.angular + w;
  motion.V.linear = V.linear + cross(V.angular, arm) + rate;
  motion.A.angular = A.angular + cross(V.angular, w) + R_WX * turns.angular;
  motion.A.linear = A.linear + cross(A.angular, arm) + cross(V.angular, cross(V.angular, arm)) +
                    2.0 * cross(V.angular, rate) + second;
  // (t - T)(1 - s) times the velocity of arrival, which contributes only at the end.
  const double left = time - reference.arrival_time;
  motion.X_WD.p += (left * (1 - s.position)) * reference.arrival;
  motion.V.linear += (1 - s.position - left * s.rate) * reference.arrival;
  motion.A.linear -= (2 * s.rate + left * s.acceleration) * reference.arrival;
  return motion;
}

Vector3d rotation_vector_rate(const Vector3d& phi, const Vector3d& angular_velocity) {
  // The inverse of the map above: phi' = w - phi x w / 2 + c phi x (phi x w), c = (1 - (x/2) cot(x/2))/x^2.
  const double x = norm(phi), half = 0.5 * x;
  const double c = x < 1e-2 ? 1.0 / 12 + x * x / 720 : (1 - half / std::tan(half)) / (x * x);
  return angular_velocity - 0.5 * cross(phi, angular_velocity) + c * cross(phi, cross(phi, angular_velocity));
}

std::vector<int> controlled_rows(ImpedanceLaw::Motion motion) {
  if (motion == ImpedanceLaw::Motion::position) return {3, 4, 5};
  if (motion == ImpedanceLaw::Motion::plane) return {2, 3, 4};
  return {0, 1, 2, 3, 4, 5};
}

Impedance::Impedance(const Model& model, ImpedanceLaw law, LawScope scope)
    : JointLaw(model, std::move(scope)),
      law_(std::move(law)),
      rows_(controlled_rows(law_.motion)),
      length_(0),
      kinematics_(model) {
  for (const ImpedanceEndEffector& end_effector : law_.end_effectors)
    length_ = std::max(length_, reach_of(model, end_effector));
}

void Impedance::sense(std::span<const ExternalWrench> wrenches) {
  sensed_.clear();
  if (law_.force == ImpedanceGains::Force::sensed) sensed_.assign(wrenches.begin(), wrenches.end());
}

// Rows of all end-effectors, in the controlled directions.
struct Impedance::Rows {
  Eigen::MatrixXd A;       // accelerations per effort
  Eigen::VectorXd free;    // accelerations without efforts
  Eigen::VectorXd wanted;  // accelerations demanded by (21.1)
  Eigen::VectorXd force;   // K e - D v
};

// Time => rows of all end-effectors in the controlled directions: accelerations per effort and without efforts, and the
// demanded acceleration or force (21.1).
Impedance::Rows Impedance::rows_of(double time) {
  const Model& model = response_.model();
  const Kinematics& k = response_.kinematics();
  const auto m = static_cast<Eigen::Index>(rows_.size()), n = static_cast<Eigen::Index>(joints().size());
  const auto count = static_cast<Eigen::Index>(law_.end_effectors.size());
  Rows rows{Eigen::MatrixXd(m * count, n), Eigen::VectorXd(m * count), Eigen::VectorXd(m * count),
            Eigen::VectorXd(m * count)};
  const std::vector<double> vdot(response_.free().data(), response_.free().data() + response_.free().size());
  const std::vector<BodyAcceleration> free = body_accelerations(model, k, vdot);
  Eigen::MatrixXd J(6, model.velocities());
  for (Eigen::Index h = 0; h < count; ++h) {
    const ImpedanceEndEffector& end_effector = law_.end_effectors[h];
    const Posed X_WE = k.X_WB[end_effector.body] * end_effector.X_BE;
    const Vector3d arm = X_WE.p - k.X_WB[end_effector.body].p, w = k.V_WB[end_effector.body].angular;
    const Twistd V = shift(k.V_WB[end_effector.body], arm);
    const EndEffectorState D = end_effector_motion(end_effector.reference, k, free, time);
    Wrenchd F = Wrenchd::zero();  // contact wrench at the end-effector
    for (const ExternalWrench& e : sensed_) {
      if (e.body != end_effector.body) continue;
      F.angular += e.F_W.angular + cross(e.p_WP - X_WE.p, e.F_W.linear), F.linear += e.F_W.linear;
    }
    // M (a - a_D) + D (v - v_D) + K e = F, in the axes of D (21.1).
    const Rotationd& R = D.X_WD.R;
    const Vector3d e_D = transposed_times(R, X_WE.p - D.X_WD.p), v_D = transposed_times(R, V.linear - D.V.linear);
    const Vector3d phi_D = rotation_vector(transpose(R) * X_WE.R);
    const Vector3d w_D = transposed_times(R, V.angular - D.V.angular);
    const Vector3d pull = R * (-scaled(law_.stiffness, e_D) - scaled(law_.damping, v_D));
    const Vector3d twist = R * (-scaled(law_.angular_stiffness, phi_D) - scaled(law_.angular_damping, w_D));
    const auto by_mass = [&](const Vector3d& f) { return R * divided(transposed_times(R, f), law_.mass); };
    const Vector3d f = pull + F.linear;
    Vector3d linear = by_mass(f);
    if (end_effector.normal) {  // across the normal the apparent mass, along it the matched mass
      const Vector3d n_W = *end_effector.normal;
      const Vector3d across = by_mass(f - dot(n_W, f) * n_W);
      linear = across - dot(n_W, across) * n_W + (dot(n_W, f) / end_effector.matched_mass) * n_W;
    }
    const Vector3d angular = R * divided(transposed_times(R, twist + F.angular), law_.inertia);
    point_jacobian(model, k, end_effector.body, X_WE.p, J);
    const BodyAcceleration& now = free[end_effector.body];
    const Vector6 a = stacked6(now.angular, now.linear + cross(now.angular, arm) + cross(w, cross(w, arm)));
    const Vector6 wanted = stacked6(D.A.angular + angular, D.A.linear + linear);
    const Vector6 force = stacked6(twist, pull);
    for (Eigen::Index i = 0; i < m; ++i) {
      const int row = rows_[i];
      // Small matrices: avoids the blocking and buffers of large products.
      rows.A.row(m * h + i) = J.row(row).lazyProduct(response_.response());
      rows.free[m * h + i] = a[row], rows.wanted[m * h + i] = wanted[row], rows.force[m * h + i] = force[row];
    }
  }
  return rows;
}

namespace {

// Pseudo-inverse of a symmetric positive semidefinite matrix S, applied to vectors weighted by `size`.
class Inverse {
 public:
  Inverse(const Eigen::MatrixXd& S, const Eigen::VectorXd& size) : size_(size), regular_(S) {
    // Lower bound of the smallest over the largest eigenvalue: determinant over the trace to the power of the size. It
    // usually proves full rank without an eigenvalue decomposition.
    const auto L = regular_.matrixLLT().diagonal();
    is_regular_ = regular_.info() == Eigen::Success && (L.array().square() / S.trace()).prod() > kUnreachable;
    if (is_regular_) return;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
    vectors_ = eigen.eigenvectors(), inverse_ = eigen.eigenvalues();
    const double least = kUnreachable * inverse_.maxCoeff();
    for (double& value : inverse_) value = value > least ? 1 / value : 0;
  }
  Eigen::VectorXd operator()(const Eigen::VectorXd& a) const {
    if (is_regular_) return cholesky_solution(regular_, Eigen::VectorXd(size_.cwiseProduct(a)));
    return vectors_ * inverse_.cwiseProduct(vectors_.transpose() * size_.cwiseProduct(a));
  }

 private:
  const Eigen::VectorXd& size_;
  Cholesky regular_;
  bool is_regular_ = false;
  Eigen::MatrixXd vectors_;
  Eigen::VectorXd inverse_;
};

}  // namespace

Eigen::VectorXd Impedance::efforts(double time, const State& state) {
  Eigen::MatrixXd J_t;
  return compute_command(time, state, {}, J_t).effort;
}

JointLawCommand Impedance::at(double time, const State& state, std::span<const double> force) {
  Eigen::MatrixXd J_t;
  JointLawCommand command = compute_command(time, state, force, J_t);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J_t);
  const Eigen::VectorXd& s = svd.singularValues();
  const Eigen::Index n = J_t.rows(), m = J_t.cols();
  command.condition = n >= m && s[0] > 0 ? s[m - 1] / s[0] : 0;
  return command;
}

// State and time => efforts (21.2) or (21.6), clipped at the limits, plus null-space damping (21.5) within the
// remaining limits. `J_t`: the weighted transpose of J* (21.3).
JointLawCommand Impedance::compute_command(double time, const State& state, std::span<const double> force,
                                           Eigen::MatrixXd& J_t) {
  response_.update(state, force, gravity_, sensed_);
  const Rows rows = rows_of(time);
  const auto n = static_cast<Eigen::Index>(joints().size()), m = rows.A.rows();

  // q'' = H*^-1 tau + ..., J*^T = H* A^T (21.3); angular rows are multiplied by the reach to be commensurable.
  Eigen::MatrixXd R(n, n);
  Eigen::VectorXd rates(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto joint = static_cast<std::size_t>(j);
    R.row(j) = response_.response().row(response_.velocity(joint));
    rates[j] = state.v[response_.velocity(joint)];
  }
  Eigen::VectorXd size = Eigen::VectorXd::Ones(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    if (rows_[static_cast<std::size_t>(i) % rows_.size()] < 3) size[i] = length_;
  }
  const Cholesky inverse_inertia(R);
  J_t = cholesky_solution(inverse_inertia, Eigen::MatrixXd(rows.A.transpose() * size.asDiagonal()));
  JointLawCommand command;

  const Inverse lambda(size.asDiagonal() * rows.A * J_t, size);  // (J* H*^-1 J*^T)^-1 (21.4)
  const Eigen::VectorXd moving = law_.law == ImpedanceGains::Law::transpose
                                     ? Eigen::VectorXd(J_t * size.cwiseInverse().cwiseProduct(rows.force))  // (21.6)
                                     : Eigen::VectorXd(J_t * lambda(rows.wanted - rows.free));              // (21.2)
  // Damping that does not move the end-effectors (21.5).
  Eigen::VectorXd still = -law_.null_rate * cholesky_solution(inverse_inertia, rates);
  still -= J_t * lambda(rows.A * still);

  const std::vector<double>& limits = response_.limits();
  for (Eigen::Index j = 0; j < n; ++j) {
    const double limit = limits[j];
    if (std::abs(moving[j]) > limit) command.scale = std::min(command.scale, limit / std::abs(moving[j]));
  }
  command.within_limits = command.scale == 1;
  command.effort = moving + largest_share(moving, still, limits, 1).value_or(0) * still;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double limit = limits[j];
    command.effort[j] = std::clamp(command.effort[j], -limit, limit);
  }
  return command;
}

// End-effector, time and state => distance [m] and angle [rad] from its reference, in the controlled directions of W
// only.
Impedance::Deviation Impedance::deviation(std::size_t index, double time, const State& state) {
  const Model& model = response_.model();
  forward_kinematics(model, state, kinematics_);
  const ImpedanceEndEffector& h = law_.end_effectors[index];
  const std::vector<BodyAcceleration> none(model.bodies().size(), {Vector3d::zero(), Vector3d::zero()});
  const Posed X_WD = end_effector_motion(h.reference, kinematics_, none, time).X_WD,
              X_WE = kinematics_.X_WB[h.body] * h.X_BE;
  Vector3d apart = X_WE.p - X_WD.p, turn = X_WD.R * rotation_vector(transpose(X_WD.R) * X_WE.R);
  for (int k = 0; k < 3; ++k) {
    if (std::find(rows_.begin(), rows_.end(), k) == rows_.end()) turn[k] = 0;
    if (std::find(rows_.begin(), rows_.end(), 3 + k) == rows_.end()) apart[k] = 0;
  }
  return {norm(apart), norm(turn)};
}

Impedance::Deviation Impedance::deviation(double time, const State& state) {
  Deviation largest;
  for (std::size_t h = 0; h < law_.end_effectors.size(); ++h) {
    const Deviation d = deviation(h, time, state);
    largest.distance = std::max(largest.distance, d.distance), largest.angle = std::max(largest.angle, d.angle);
  }
  return largest;
}

// --- Effective mass at a contact ---

double effective_mass(const Model& model, const State& state, int body, const Vector3d& p_W, const Vector3d& n_W) {
  const Kinematics k = forward_kinematics(model, state);
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, k, body, p_W, J);
  const Eigen::VectorXd f = J.bottomRows<3>().transpose() * Eigen::Vector3d(n_W[0], n_W[1], n_W[2]);
  const Eigen::VectorXd change = cholesky_solution(Cholesky(mass_matrix(model, state)), f);
  const double mobility = f.dot(change);
  return mobility > 0 ? 1 / mobility : std::numeric_limits<double>::infinity();
}

// Contact law, reduced mass [kg] and approach speed [m/s] => coefficient of restitution of section 21.2: closed form
// for kelvin_voigt, bisection of (12.14) for hunt_crossley, else 1.
double restitution_of(const CompliantContact& contact, double reduced_mass, double speed) {
  if (contact.model == ContactForceModel::hertz || contact.damping == 0) return 1;
  if (contact.model == ContactForceModel::kelvin_voigt) {
    const double zeta = contact.damping / (2 * std::sqrt(contact.stiffness * reduced_mass));
    const double rest = std::abs(1 - zeta * zeta);
    if (rest < 1e-12) return std::exp(-2.0);
    const double root = std::sqrt(rest);
    return std::exp(-2 * zeta * (zeta < 1 ? std::acos(zeta) : std::acosh(zeta)) / root);
  }
  // g(v) = a v - ln(1 + a v) has equal values before and after the contact, for any stiffness, exponent and mass.
  const double x = contact.damping * speed;
  if (x < 1e-9) return 1;
  const double before = x - std::log1p(x);
  double low = 0, high = 1;
  for (int i = 0; i < 200; ++i) {
    const double e = 0.5 * (low + high);
    const double after = e * x < 1 ? -e * x - std::log1p(-e * x) : std::numeric_limits<double>::infinity();
    (after < before ? low : high) = e;
  }
  return 0.5 * (low + high);
}

// Contact law, target mass and approach speed => mass m with e(m) m = m_t (21.9), by bisection; infinite if there is
// none up to 1e9 target masses.
double matching_mass(const CompliantContact& contact, double target_mass, double speed) {
  const auto excess = [&](double mass) {
    const double reduced = mass * target_mass / (mass + target_mass);
    return restitution_of(contact, reduced, speed) * mass - target_mass;
  };
  double low = target_mass, high = target_mass;
  while (excess(high) < 0) {
    if (high > 1e9 * target_mass) return std::numeric_limits<double>::infinity();
    low = high, high *= 2;
  }
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    (excess(middle) < 0 ? low : high) = middle;
  }
  return high;
}

}  // namespace grapnel
