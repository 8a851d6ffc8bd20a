#include "grapnel/plan/self_motions.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/plan/shooting.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kSteps = 40;  // initial number of steps
constexpr std::size_t kFinest = 160;
constexpr std::size_t kBegun = 4;  // nodes of the one-step method before the multistep method

// Whether plan_straight_in() damps the rates at this configuration.
bool is_damped(const Eigen::MatrixXd& G) {
  const Eigen::VectorXd sigma = Eigen::JacobiSVD<Eigen::MatrixXd>(G).singularValues();
  constexpr double kNever = 1e-9;  // structurally zero singular values, as of a planar arm
  return std::any_of(sigma.begin(), sigma.end(),
                     [&](double s) { return s > kNever * sigma[0] && s < kDampedBelow * sigma[0]; });
}

// Error estimate from predictor and corrector, by Milne's device.
class Estimate {
 public:
  explicit Estimate(int joints) : position_(static_cast<std::size_t>(joints), 0.0) {}

  // Adds a step: the increments of the joint values by both formulas, each times h.
  void add(const std::vector<double>& corrector, const std::vector<double>& predictor, double h) {
    constexpr double kMilne = 19.0 / 270;
    for (std::size_t j = 0; j < position_.size(); ++j) {
      const double between = std::abs(h * (corrector[j] - predictor[j]));
      position_[j] += kMilne * between;
      predicted_ = std::isfinite(between) ? std::max(predicted_, between) : between;
    }
  }

  // Error of the integration. Rates are evaluated at the predicted states; a deviation of a predicted state changes
  // them as a step of that size does. The largest rate and its largest change per step convert the deviation to an
  // error.
  double error(double rate, double change, double step) const {
    double position = 0;
    for (const double e : position_) position = std::isfinite(e) ? std::max(position, e) : e;
    const double of_rates = rate > 0 ? change / (step * rate * rate) * (position + predicted_) : 0;
    return position + of_rates;
  }

 private:
  std::vector<double> position_;  // sum over the steps
  double predicted_ = 0;          // maximum deviation of a predicted state
};

}  // namespace

SelfMotions::SelfMotions(FloatingBase& base, const StraightInProblem& problem, const StartFreedom* freedom)
    : base_(base), problem_(problem), freedom_(freedom), n_(base.joints()), steps_(kSteps) {
  place_targets();
}

void SelfMotions::place_targets() {
  times_.clear();
  for (std::size_t i = 0; i <= 2 * steps_; ++i)
    times_.push_back(i == 2 * steps_ ? problem_.end : problem_.begin + 0.5 * step() * static_cast<double>(i));
  targets_ = target_states(problem_, times_);
}

bool SelfMotions::refine() {
  if (steps_ >= kFinest) return false;
  steps_ *= 2;
  place_targets();
  return true;
}

std::vector<double> SelfMotions::start(const Eigen::VectorXd& v) const {
  std::vector<double> position = problem_.position;
  if (freedom_)
    Eigen::Map<Eigen::VectorXd>(position.data(), n_) += start_scale() * freedom_->position * v.head(start_unknowns());
  return position;
}

double SelfMotions::begins_elsewhere_by(const Eigen::VectorXd& v) const {
  if (start_unknowns() == 0) return 0;
  return start_scale() * (freedom_->position * v.head(start_unknowns())).lpNorm<Eigen::Infinity>();
}

// Unknowns v => initial state of the approach and its derivatives.
SelfMotions::State SelfMotions::begin(const Eigen::VectorXd& v) {
  const int columns = derivatives_ ? unknowns() : 0;
  State s;
  s.position = start(v);
  s.X_WB = problem_.X_WB;
  s.per_position = Eigen::MatrixXd::Zero(n_, columns);
  s.per_displacement = Matrix6Xd::Zero(6, columns);
  if (freedom_) {
    const Vector6d xi = start_scale() * (freedom_->displacement * v.head(start_unknowns()));
    s.X_WB = displaced(s.X_WB, xi);
  }
  if (freedom_ && derivatives_) {
    s.per_position.leftCols(start_unknowns()) = start_scale() * freedom_->position;
    s.per_displacement.leftCols(start_unknowns()) = start_scale() * freedom_->displacement;
  }
  s.q_WB = quaternion_from(s.X_WB.R);
  settle(s, problem_.begin);
  return s;
}

// Unknowns v => states at the ends of all steps, with derivatives on request: three Runge-Kutta steps, then
// Adams-Bashforth-Moulton.
std::vector<SelfMotions::Node> SelfMotions::integrate(const Eigen::VectorXd& v, Derivatives derivatives) {
  derivatives_ = derivatives == Derivatives::all;
  std::vector<Node> nodes;
  State s = begin(v);
  Estimate estimate(n_);
  std::vector<Change> f;  // at the nodes; from the fifth on at the predicted states
  for (std::size_t i = 0;; ++i) {
    const int at = 2 * static_cast<int>(i);
    if (i < kBegun) f.push_back(change(s, at, v));
    base_.place(s.position, links_);
    nodes.push_back({times_[2 * i],
                     s.position,
                     f[i].rate,
                     {},
                     s.X_WB,
                     links_,
                     s.per_position,
                     f[i].per_position,
                     {},
                     s.per_displacement});
    if (i == steps_) break;
    if (i + 1 < kBegun) {
      const Change k2 = change(after(s, f[i], 0.5 * step(), at + 1), at + 1, v);
      const Change k3 = change(after(s, k2, 0.5 * step(), at + 1), at + 1, v);
      const Change k4 = change(after(s, k3, step(), at + 2), at + 2, v);
      s = after(s, sum({{1, f[i]}, {2, k2}, {2, k3}, {1, k4}}), step() / 6, at + 2);
    } else {
      const Change predictor = sum({{55, f[i]}, {-59, f[i - 1]}, {37, f[i - 2]}, {-9, f[i - 3]}});
      f.push_back(change(after(s, predictor, step() / 24, at + 2), at + 2, v));
      const Change corrector = sum({{9, f[i + 1]}, {19, f[i]}, {-5, f[i - 1]}, {1, f[i - 2]}});
      s = after(s, corrector, step() / 24, at + 2);
      estimate.add(corrector.rate, predictor.rate, step() / 24);
    }
  }
  double rate = 0, rate_change = 0;
  for (std::size_t i = 0; i < f.size(); ++i) {
    for (std::size_t j = 0; j < f[i].rate.size(); ++j) {
      rate = std::max(rate, std::abs(f[i].rate[j]));
      if (i > 0) rate_change = std::max(rate_change, std::abs(f[i].rate[j] - f[i - 1].rate[j]));
    }
  }
  error_ = estimate.error(rate, rate_change, step());
  add_accelerations(nodes);
  return nodes;
}

// Computes the base's position from its attitude.
void SelfMotions::settle(State& s, double time) {
  if (!base_.floats()) return;
  s.X_WB.R = rotation_matrix(s.q_WB);
  base_.place(s.position, links_);
  s.X_WB.p = problem_.motion.com_at(time) - s.X_WB.R * links_.com;
}

SelfMotions::State SelfMotions::after(const State& s, const Change& k, double h, int at) {
  State next = s;
  for (int j = 0; j < n_; ++j) next.position[static_cast<std::size_t>(j)] += h * k.rate[static_cast<std::size_t>(j)];
  next.q_WB = normalized(
      Quaterniond{s.q_WB.w + h * k.turn.w, s.q_WB.x + h * k.turn.x, s.q_WB.y + h * k.turn.y, s.q_WB.z + h * k.turn.z});
  next.per_position += h * k.per_position;
  next.per_displacement += h * k.per_displacement;
  settle(next, times_[static_cast<std::size_t>(at)]);
  return next;
}

// (1) to (3).
SelfMotions::Change SelfMotions::change(const State& s, int at, const Eigen::VectorXd& v) {
  ++evaluations_;
  const double time = times_[static_cast<std::size_t>(at)];
  const std::vector<Goal> goals = goals_at(problem_, targets_[static_cast<std::size_t>(at)], time);
  const Momentumd h_B = problem_.motion.in_base(time, s.X_WB);
  base_.place(s.position);
  double phi[kTerms];
  self_motion_basis((time - problem_.begin) / (problem_.end - problem_.begin), phi);
  Eigen::VectorXd z = Eigen::VectorXd::Zero(n_);
  for (int k = 0; k < kTerms; ++k) z += phi[k] * v.segment(start_unknowns() + k * n_, n_);
  if (!derivatives_) {
    const Eigen::VectorXd rates = rates_nearest_to(z, s.X_WB, h_B, goals);
    Change c;
    c.rate.assign(rates.begin(), rates.end());
    base_.move(c.rate, h_B);
    c.turn = quaternion_rate(s.q_WB, twist_from(base_.base_twist()).angular);
    c.per_position.resize(n_, 0), c.per_displacement.resize(6, 0);
    return c;
  }
  DemandedRates demanded = demanded_rates(base_, s.X_WB, h_B, goals, RateDemand::task);
  add_self_motion(z, demanded);
  const RateSensitivity rho = rate_sensitivity(base_, s.X_WB, h_B, goals, RateDemand::task, demanded);
  Change c;
  c.rate.assign(demanded.rates.begin(), demanded.rates.end());
  base_.move(c.rate, h_B);
  c.turn = quaternion_rate(s.q_WB, twist_from(base_.base_twist()).angular);
  c.per_position = rho.per_angle * s.per_position + rho.per_displacement * s.per_displacement;
  Eigen::MatrixXd free = Eigen::MatrixXd::Identity(n_, n_) - demanded.G_inverse * demanded.G;
  for (int j = 0; j < n_; ++j) {
    if (base_.is_held(j)) free.col(j).setZero(), free.row(j).setZero();
  }
  self_motions_ = std::max(self_motions_, static_cast<int>(std::lround(free.trace())));
  constexpr double kRounding = 1e-12;  // smaller freedoms are zero; the optimizer must not use them
  free = (free.array().abs() < kRounding).select(0.0, free);
  for (int k = 0; k < kTerms; ++k) c.per_position.middleCols(start_unknowns() + k * n_, n_) += phi[k] * free;
  c.per_displacement = base_.displacement_rate(h_B) * s.per_displacement + base_.per_angle() * s.per_position +
                       base_.per_rate() * c.per_position;
  return c;
}

// (1); by normal equations away from singularities.
Eigen::VectorXd SelfMotions::rates_nearest_to(const Eigen::VectorXd& z, const Posed& X_WB, const Momentumd& h_B,
                                              const std::vector<Goal>& goals) {
  demand_rows(base_, X_WB, h_B, goals, RateDemand::task, G_, b_);
  const double largest = std::sqrt((G_ * G_.transpose()).cwiseAbs().rowwise().sum().maxCoeff());
  if (const auto rest = least_norm_above(G_, b_ - G_ * z, kDampedBelow * largest)) return z + *rest;
  near_singularity_ = near_singularity_ || is_damped(G_);
  DemandedRates demanded = demanded_rates(base_, X_WB, h_B, goals, RateDemand::task);
  add_self_motion(z, demanded);
  return demanded.rates;
}

// Weighted sum of changes.
SelfMotions::Change SelfMotions::sum(std::initializer_list<std::pair<double, const Change&>> terms) {
  Change sum = terms.begin()->second;
  const double first = terms.begin()->first;
  for (double& rate : sum.rate) rate *= first;
  Quaterniond& q = sum.turn;
  q = {first * q.w, first * q.x, first * q.y, first * q.z};
  sum.per_position *= first, sum.per_displacement *= first;
  for (auto term = terms.begin() + 1; term != terms.end(); ++term) {
    const auto& [weight, k] = *term;
    for (std::size_t j = 0; j < sum.rate.size(); ++j) sum.rate[j] += weight * k.rate[j];
    q = {q.w + weight * k.turn.w, q.x + weight * k.turn.x, q.y + weight * k.turn.y, q.z + weight * k.turn.z};
    sum.per_position += weight * k.per_position, sum.per_displacement += weight * k.per_displacement;
  }
  return sum;
}

// Accelerations by finite differences of order 4 of the rates at five nodes.
void SelfMotions::add_accelerations(std::vector<Node>& nodes) const {
  constexpr double kWeights[5][5] = {
      {-25, 48, -36, 16, -3}, {-3, -10, 18, -6, 1}, {1, -8, 0, 8, -1}, {-1, 6, -18, 10, 3}, {3, -16, 36, -48, 25}};
  const int last = static_cast<int>(nodes.size()) - 1;
  for (int i = 0; i <= last; ++i) {
    const int from = std::clamp(i - 2, 0, last - 4);
    Node& node = nodes[static_cast<std::size_t>(i)];
    node.acceleration.assign(static_cast<std::size_t>(n_), 0.0);
    node.per_acceleration = Eigen::MatrixXd::Zero(n_, node.per_rate.cols());
    for (int k = 0; k < 5; ++k) {
      const double weight = kWeights[i - from][k] / (12 * step());
      const Node& other = nodes[static_cast<std::size_t>(from + k)];
      for (std::size_t j = 0; j < node.acceleration.size(); ++j) node.acceleration[j] += weight * other.rate[j];
      node.per_acceleration += weight * other.per_rate;
    }
  }
}

}  // namespace grapnel
