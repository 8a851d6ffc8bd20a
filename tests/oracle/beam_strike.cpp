#include "oracle/beam_strike.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace grapnel::oracle {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr int kPoints = 4;  // of Gauss in an element: exact for the mass of cubic displacements

// The angle at a node or on the base: a coordinate, if it has one, and a constant.
struct Angle {
  int coordinate;  // -1: none
  double constant;
};

// Points of Gauss on (0, 1), their weights, and the integrals of the interpolating polynomial from 0 to each point.
struct Quadrature {
  std::array<double, kPoints> at, weight;
  std::array<std::array<double, kPoints>, kPoints> to;
};

Quadrature gauss() {
  const double a = std::sqrt(3.0 / 7 - 2.0 / 7 * std::sqrt(1.2)), b = std::sqrt(3.0 / 7 + 2.0 / 7 * std::sqrt(1.2));
  const double wa = (18 + std::sqrt(30.0)) / 72, wb = (18 - std::sqrt(30.0)) / 72;
  Quadrature q{{(1 - b) / 2, (1 - a) / 2, (1 + a) / 2, (1 + b) / 2}, {wb, wa, wa, wb}, {}};
  // Integrals of monomials fix the rows: sum_j to[i][j] at[j]^p = at[i]^(p+1)/(p+1).
  Eigen::Matrix4d monomials;
  for (int p = 0; p < kPoints; ++p) {
    for (int j = 0; j < kPoints; ++j) monomials(p, j) = std::pow(q.at[j], p);
  }
  for (int i = 0; i < kPoints; ++i) {
    Eigen::Vector4d integral;
    for (int p = 0; p < kPoints; ++p) integral[p] = std::pow(q.at[i], p + 1) / (p + 1);
    const Eigen::Vector4d row = monomials.inverse() * integral;
    for (int j = 0; j < kPoints; ++j) q.to[i][j] = row[j];
  }
  return q;
}

// A place of the arm: position, its derivatives by the coordinates, and the acceleration at constant rates.
struct Place {
  Vector2d p, bias;
  Eigen::Matrix2Xd J;
};

// Sums of the equations of motion M z'' = f.
struct Equations {
  MatrixXd M;
  VectorXd f;
};

class Arm {
 public:
  explicit Arm(const StrikeSetup& setup) : s_(setup), gauss_(gauss()) {
    n_ = s_.base_held ? 0 : 3;
    Angle end{s_.base_held ? -1 : 2, 0};
    for (const StrikingLink& link : s_.links) {
      nodes_.push_back({{end.coordinate, end.constant + link.joint_angle}});
      if (link.joint_free) nodes_.back()[0].coordinate = n_++;
      if (link.joint_free) nodes_.back()[0].constant = 0;
      for (int k = 0; k < 2 * s_.elements; ++k) nodes_.back().push_back({n_++, 0});
      end = nodes_.back().back();
    }
  }

  int size() const { return n_; }

  // All beams straight; free joints with their rates, other angles with those of a rigid body.
  void start(VectorXd& z, VectorXd& rates) {
    z = VectorXd::Zero(n_), rates = VectorXd::Zero(n_);
    double angle = 0, rate = 0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      angle += s_.links[i].joint_angle;
      if (s_.links[i].joint_free) rate += s_.links[i].joint_rate;
      for (std::size_t k = s_.links[i].joint_free ? 0 : 1; k < nodes_[i].size(); ++k) {
        z[nodes_[i][k].coordinate] = angle, rates[nodes_[i][k].coordinate] = rate;
      }
    }
    straight_ = z;
  }

  // Coordinates, rates => mass matrix and forces of base, beams and tip; the place and angle of the tip.
  Place equations(const VectorXd& z, const VectorXd& rates, Equations& e) const {
    e.M.setZero(n_, n_), e.f.setZero(n_);
    Place at{Vector2d::Zero(), Vector2d::Zero(), Eigen::Matrix2Xd::Zero(2, n_)};
    if (!s_.base_held) {
      at.p = z.head(2), at.J(0, 0) = at.J(1, 1) = 1;
      add_mass(at, s_.base_mass, e);
      e.M(2, 2) += s_.base_inertia;
    }
    const Angle base{s_.base_held ? -1 : 2, 0};
    const double direction = std::atan2(s_.mount[1], s_.mount[0]);
    advance({{{base.coordinate, 1}}, direction}, s_.mount.norm(), z, rates, at);
    for (std::size_t i = 0; i < nodes_.size(); ++i) add_link(i, z, rates, at, e);
    add_mass(at, s_.tip_mass, e);
    const int tip = nodes_.back().back().coordinate;
    e.M(tip, tip) += s_.tip_inertia;
    return at;
  }

  double tip_rate(const VectorXd& rates) const { return rates[nodes_.back().back().coordinate]; }
  int tip_coordinate() const { return nodes_.back().back().coordinate; }

  // The energy of bending; the power of damping.
  double bending_energy(const VectorXd& z) const {
    return 0.5 * bending(z, z, [](const StrikingLink&) { return 1.0; });
  }
  double damping_power(const VectorXd& rates) const {
    return bending(
        rates, rates, [](const StrikingLink& link) { return damping_time(link); }, 0);
  }

 private:
  // An angle that is linear in the coordinates: sum of factors of coordinates, and a constant.
  struct Direction {
    std::vector<std::pair<int, double>> factors;
    double constant;
  };

  // Moments of the damping are those of bending with rates in place of angles, times this (2 zeta/w_1).
  static double damping_time(const StrikingLink& link) {
    const double beta = 1.875104068711961 / link.length;
    return 2 * link.damping_ratio / (beta * beta * std::sqrt(link.bending_stiffness * link.length / link.mass));
  }

  double angle_of(const Direction& d, const VectorXd& z) const {
    double angle = d.constant;
    for (const auto& [k, factor] : d.factors) {
      if (k >= 0) angle += factor * z[k];
    }
    return angle;
  }

  // Integral (1) over the length at one angle, added to a place.
  void advance(const Direction& d, double length, const VectorXd& z, const VectorXd& rates, Place& at) const {
    const double angle = angle_of(d, z), straight = s_.small_angles ? angle_of(d, straight_) : angle;
    const Vector2d along{std::cos(straight), std::sin(straight)}, across{-along[1], along[0]};
    double rate = 0;
    for (const auto& [k, factor] : d.factors) {
      if (k < 0) continue;
      rate += factor * rates[k];
      at.J.col(k) += length * factor * across;
    }
    at.p += length * (along + (angle - straight) * across);
    if (!s_.small_angles) at.bias -= length * rate * rate * along;
  }

  void add_mass(const Place& at, double mass, Equations& e) const {
    e.M.noalias() += mass * at.J.transpose() * at.J;
    e.f.noalias() -= mass * at.J.transpose() * at.bias;
  }

  Direction direction(std::size_t link, int element, double x) const {
    const std::array<double, 3> shape{(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)};
    Direction d{{}, 0};
    for (int k = 0; k < 3; ++k) {
      const Angle& node = nodes_[link][2 * element + k];
      d.factors.push_back({node.coordinate, shape[k]});
      d.constant += shape[k] * node.constant;
    }
    return d;
  }

  // The kinetic energy (2) of a link by Gauss's rule, its bending and damping; the place moves to its end.
  void add_link(std::size_t i, const VectorXd& z, const VectorXd& rates, Place& at, Equations& e) const {
    const StrikingLink& link = s_.links[i];
    const double h = link.length / s_.elements;
    for (int element = 0; element < s_.elements; ++element) {
      std::array<Direction, kPoints> directions;
      for (int j = 0; j < kPoints; ++j) directions[j] = direction(i, element, gauss_.at[j]);
      for (int k = 0; k < kPoints; ++k) {
        Place point = at;
        for (int j = 0; j < kPoints; ++j) advance(directions[j], h * gauss_.to[k][j], z, rates, point);
        add_mass(point, gauss_.weight[k] * link.mass / s_.elements, e);
        add_rotary_inertia(directions[k], gauss_.weight[k] * h * link.rotary_inertia, e);
      }
      for (int j = 0; j < kPoints; ++j) advance(directions[j], h * gauss_.weight[j], z, rates, at);
      add_bending(i, element, z, rates, e);
    }
  }

  void add_rotary_inertia(const Direction& d, double inertia, Equations& e) const {
    for (const auto& [k, a] : d.factors) {
      for (const auto& [l, b] : d.factors) {
        if (k >= 0 && l >= 0) e.M(k, l) += inertia * a * b;
      }
    }
  }

  void add_bending(std::size_t i, int element, const VectorXd& z, const VectorXd& rates, Equations& e) const {
    const StrikingLink& link = s_.links[i];
    const Eigen::Matrix3d K = stiffness(link);
    Eigen::Vector3d angles, changes;
    for (int k = 0; k < 3; ++k) {
      const Angle& node = nodes_[i][2 * element + k];
      angles[k] = node.constant + (node.coordinate >= 0 ? z[node.coordinate] : 0);
      changes[k] = node.coordinate >= 0 ? rates[node.coordinate] : 0;
    }
    const Eigen::Vector3d moments = K * (angles + damping_time(link) * changes);
    for (int k = 0; k < 3; ++k) {
      const int c = nodes_[i][2 * element + k].coordinate;
      if (c >= 0) e.f[c] -= moments[k];
    }
  }

  // Of int E I (dt/ds)^2 ds over the three nodes of an element.
  Eigen::Matrix3d stiffness(const StrikingLink& link) const {
    Eigen::Matrix3d K;
    K << 7, -8, 1, -8, 16, -8, 1, -8, 7;
    return link.bending_stiffness * s_.elements / (3 * link.length) * K;
  }

  template <class Factor>
  double bending(const VectorXd& a, const VectorXd& b, Factor factor, double constants = 1) const {
    double sum = 0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      for (int element = 0; element < s_.elements; ++element) {
        Eigen::Vector3d x, y;
        for (int k = 0; k < 3; ++k) {
          const Angle& node = nodes_[i][2 * element + k];
          x[k] = constants * node.constant + (node.coordinate >= 0 ? a[node.coordinate] : 0);
          y[k] = constants * node.constant + (node.coordinate >= 0 ? b[node.coordinate] : 0);
        }
        sum += factor(s_.links[i]) * x.dot(stiffness(s_.links[i]) * y);
      }
    }
    return sum;
  }

  const StrikeSetup& s_;
  Quadrature gauss_;
  int n_ = 0;
  std::vector<std::vector<Angle>> nodes_;  // of each link: 2 per element and one more
  VectorXd straight_;                      // the coordinates of the undeformed arm
};

double cross(const Vector2d& a, const Vector2d& b) { return a[0] * b[1] - a[1] * b[0]; }
Vector2d turned(double rate, const Vector2d& a) { return rate * Vector2d{-a[1], a[0]}; }

// What the contact does at an instant; forces act on the ball.
struct ContactState {
  double gap = 0, normal_force = 0, loss = 0, deformation_rate = 0;
  Vector2d force{0, 0}, point{0, 0};
};

class Strike {
 public:
  explicit Strike(const StrikeSetup& setup) : s_(setup), arm_(s_), n_(arm_.size()) {}

  StrikeResult run();

 private:
  // The state: coordinates and rates of the arm; position, velocity and rate of the ball; deformation of the contact;
  // integrals of the normal force, of the force, and of all losses.
  int ball() const { return 2 * n_; }
  int deformation() const { return 2 * n_ + 5; }
  int integrals() const { return 2 * n_ + 6; }

  VectorXd start();
  VectorXd derivative(const VectorXd& y, bool touching, ContactState* contact = nullptr) const;
  ContactState contact(const VectorXd& y, const Vector2d& tip, const Vector2d& tip_velocity, bool touching) const;
  void add_friction(double slip, double chi, const Vector2d& along, double depth, ContactState& c) const;
  double energy(const VectorXd& y) const;
  Vector2d momentum(const VectorXd& y) const;
  double gap(const VectorXd& y) const {
    ContactState c;
    derivative(y, false, &c);
    return c.gap;
  }
  double step(const VectorXd& y, double h, bool touching, VectorXd& next) const;
  void record(const VectorXd& y, double t, bool touching, const VectorXd& at_begin, StrikeResult& result) const;

  const StrikeSetup s_;
  Arm arm_;
  int n_;
};

VectorXd Strike::start() {
  VectorXd y = VectorXd::Zero(2 * n_ + 10), z, rates;
  arm_.start(z, rates);
  y.head(n_) = z, y.segment(n_, n_) = rates;
  y.segment(ball(), 2) = s_.ball_position, y.segment(ball() + 2, 2) = s_.ball_velocity;
  y[ball() + 4] = s_.ball_rate;
  return y;
}

// Dupont's model, (23.7a) in a plane: an elastic deformation chi that saturates at 1, in units of the stiction
// displacement.
void Strike::add_friction(double slip, double chi, const Vector2d& along, double depth, ContactState& c) const {
  const StrikingContact& law = s_.contact;
  if (law.static_friction <= 0) return;
  const double l = law.stiction_displacement, vs = law.stiction_speed;
  const double mu = law.kinetic_friction + (law.static_friction - law.kinetic_friction) / (1 + slip * slip / (vs * vs));
  const double alpha = std::clamp((std::abs(chi) - 0.8) / 0.2, 0.0, 1.0);
  double rate = slip / l;
  if (chi != 0) rate -= alpha * std::max(0.0, slip * chi) / (l * chi);
  const double d = std::min(1.0, depth / (l / 1000));
  rate *= d * d * (3 - 2 * d);
  const double y = chi + l / vs * rate;
  const double force = -mu * c.normal_force * std::clamp(y, -1.0, 1.0);
  c.deformation_rate = rate;
  c.force += force * along;
  c.loss -= force * slip;
}

ContactState Strike::contact(const VectorXd& y, const Vector2d& tip, const Vector2d& tip_velocity,
                             bool touching) const {
  const StrikingContact& law = s_.contact;
  const Vector2d p = y.segment(ball(), 2), v = y.segment(ball() + 2, 2), across = p - tip;
  ContactState c;
  c.gap = across.norm() - s_.tip_radius - s_.ball_radius;
  const double depth = -c.gap;
  if (!touching || depth <= 0) return c;
  const Vector2d n = across.normalized(), t{-n[1], n[0]};
  c.point = tip + (s_.tip_radius - depth / 2) * n;
  const double tip_rate = arm_.tip_rate(y.segment(n_, n_));
  const Vector2d relative = v + turned(y[ball() + 4], c.point - p) - tip_velocity - turned(tip_rate, c.point - tip);
  const double approach = -relative.dot(n), elastic = law.stiffness * std::pow(depth, law.exponent);
  const double d = std::min(1.0, depth / law.damping_depth);
  c.normal_force =
      std::max(0.0, elastic * (1 + law.dissipation * approach) + law.damping * d * d * (3 - 2 * d) * approach);
  c.force = c.normal_force * n;
  c.loss = (c.normal_force - elastic) * approach;
  add_friction(relative.dot(t), y[deformation()], t, depth, c);
  return c;
}

VectorXd Strike::derivative(const VectorXd& y, bool touching, ContactState* out) const {
  Equations e;
  const VectorXd z = y.head(n_), rates = y.segment(n_, n_);
  const Place tip = arm_.equations(z, rates, e);
  const ContactState c = contact(y, tip.p, tip.J * rates, touching);
  if (out != nullptr) *out = c;
  e.f -= tip.J.transpose() * c.force;
  e.f[arm_.tip_coordinate()] -= cross(c.point - tip.p, c.force);
  VectorXd d(y.size());
  d.head(n_) = rates;
  d.segment(n_, n_) = e.M.llt().solve(e.f);
  d.segment(ball(), 2) = y.segment(ball() + 2, 2);
  d.segment(ball() + 2, 2) = c.force / s_.ball_mass;
  d[ball() + 4] = cross(c.point - y.segment<2>(ball()), c.force) / s_.ball_inertia;
  d[deformation()] = c.deformation_rate;
  d[integrals()] = c.normal_force;
  d.segment(integrals() + 1, 2) = c.force;
  d[integrals() + 3] = c.loss + arm_.damping_power(rates);
  return d;
}

double Strike::energy(const VectorXd& y) const {
  Equations e;
  const VectorXd rates = y.segment(n_, n_);
  arm_.equations(y.head(n_), rates, e);
  const double depth = std::max(0.0, -gap(y));
  return 0.5 * rates.dot(e.M * rates) + arm_.bending_energy(y.head(n_)) +
         0.5 * s_.ball_mass * y.segment(ball() + 2, 2).squaredNorm() +
         0.5 * s_.ball_inertia * y[ball() + 4] * y[ball() + 4] +
         s_.contact.stiffness * std::pow(depth, s_.contact.exponent + 1) / (s_.contact.exponent + 1);
}

// Of a free base: the rows of its translation are those of the total momentum.
Vector2d Strike::momentum(const VectorXd& y) const {
  Equations e;
  arm_.equations(y.head(n_), y.segment(n_, n_), e);
  return (e.M * y.segment(n_, n_)).head(2) + s_.ball_mass * y.segment(ball() + 2, 2);
}

// One step of Dormand and Prince (1980), order 5 => the error of its embedded solution over the tolerance.
double Strike::step(const VectorXd& y, double h, bool touching, VectorXd& next) const {
  const VectorXd k1 = derivative(y, touching);
  const VectorXd k2 = derivative(y + h / 5 * k1, touching);
  const VectorXd k3 = derivative(y + h * (3.0 / 40 * k1 + 9.0 / 40 * k2), touching);
  const VectorXd k4 = derivative(y + h * (44.0 / 45 * k1 - 56.0 / 15 * k2 + 32.0 / 9 * k3), touching);
  const VectorXd k5 = derivative(
      y + h * (19372.0 / 6561 * k1 - 25360.0 / 2187 * k2 + 64448.0 / 6561 * k3 - 212.0 / 729 * k4), touching);
  const VectorXd k6 = derivative(
      y + h * (9017.0 / 3168 * k1 - 355.0 / 33 * k2 + 46732.0 / 5247 * k3 + 49.0 / 176 * k4 - 5103.0 / 18656 * k5),
      touching);
  next = y + h * (35.0 / 384 * k1 + 500.0 / 1113 * k3 + 125.0 / 192 * k4 - 2187.0 / 6784 * k5 + 11.0 / 84 * k6);
  const VectorXd k7 = derivative(next, touching);
  const VectorXd error = h * (71.0 / 57600 * k1 - 71.0 / 16695 * k3 + 71.0 / 1920 * k4 - 17253.0 / 339200 * k5 +
                              22.0 / 525 * k6 - 1.0 / 40 * k7);
  return error.head(deformation()).lpNorm<Eigen::Infinity>() / s_.tolerance;
}

void Strike::record(const VectorXd& y, double t, bool touching, const VectorXd& at_begin, StrikeResult& result) const {
  if (!touching) return;
  ContactState c;
  derivative(y, true, &c);
  Touch& touch = result.touches.back();
  touch.end = t;
  touch.normal_impulse = y[integrals()] - at_begin[integrals()];
  touch.impulse = y.segment(integrals() + 1, 2) - at_begin.segment(integrals() + 1, 2);
  touch.peak_force = std::max(touch.peak_force, c.normal_force);
}

// Steps with error control; where the gap changes its sign, the step is shortened to the zero (regula falsi).
StrikeResult Strike::run() {
  StrikeResult result;
  VectorXd y = start(), next, at_begin = y;
  const double energy_before = energy(y);
  const Vector2d momentum_before = s_.base_held ? Vector2d{0, 0} : momentum(y);
  bool touching = false;
  double t = 0, h = 1e-5;
  while (t < s_.duration) {
    h = std::min({h, s_.duration - t, touching ? 2e-5 : 1e-3});
    if (++result.steps > 2000000) throw std::runtime_error("too many steps");
    const double error = step(y, h, touching, next);
    if (error > 1) {
      h *= std::max(0.2, 0.9 * std::pow(error, -0.2));
      continue;
    }
    const auto apart = [&](const VectorXd& state) { return touching ? -gap(state) : gap(state); };
    bool changes = apart(next) < 0;
    if (changes) {
      double low = 0, high = h, below = std::max(apart(y), 0.0), above = apart(next);
      for (int i = 0; i < 60 && high - low > 1e-13; ++i) {
        double middle = i % 3 == 2 ? (low + high) / 2 : low + (high - low) * below / (below - above);
        middle = std::clamp(middle, low + 1e-3 * (high - low), high - 1e-3 * (high - low));
        step(y, middle, touching, next);
        (apart(next) < 0 ? high : low) = middle, (apart(next) < 0 ? above : below) = apart(next);
      }
      step(y, high, touching, next), h = high;
    }
    t += h, y = next;
    record(y, t, touching, at_begin, result);
    if (changes) {
      touching = !touching;
      if (touching) result.touches.push_back({t, t}), at_begin = y, y[deformation()] = 0;
      h = 1e-6;
    } else {
      h *= std::min(5.0, 0.9 * std::pow(std::max(error, 1e-6), -0.2));
    }
  }
  Equations e;
  const Place tip = arm_.equations(y.head(n_), y.segment(n_, n_), e);
  result.ball_velocity = y.segment(ball() + 2, 2), result.ball_rate = y[ball() + 4];
  result.tip_position = tip.p, result.tip_velocity = tip.J * y.segment(n_, n_);
  result.base_velocity = s_.base_held ? Vector2d{0, 0} : Vector2d(y.segment(n_, 2));
  result.base_rate = s_.base_held ? 0 : y[n_ + 2];
  result.normal_impulse = y[integrals()];
  for (const Touch& touch : result.touches) result.peak_force = std::max(result.peak_force, touch.peak_force);
  result.energy_defect = (energy(y) + y[integrals() + 3] - energy_before) / energy_before;
  if (!s_.base_held) result.momentum_defect = momentum(y) - momentum_before;
  return result;
}

}  // namespace

StrikeResult strike(const StrikeSetup& setup) { return Strike(setup).run(); }

}  // namespace grapnel::oracle
