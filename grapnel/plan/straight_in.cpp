#include "grapnel/plan/straight_in.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "grapnel/integrate/integrate.hpp"
#include "grapnel/plan/shooting.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kGain = 5;              // k of (1) [1/s]: reduces errors due to damping or rounding
constexpr double kNoDirection = 1e-9;    // smaller singular values, relative to the largest, are structural zeros
constexpr int kDegree = 16;              // of the series, per segment
constexpr double kFitTolerance = 1e-12;  // [rad or m]

// Inverse of a symmetric matrix times a vector.
Vector3d solve(const Symmetric3d& I, const Vector3d& b) {
  const double c0 = I.yy * I.zz - I.yz * I.yz, c1 = I.yz * I.xz - I.xy * I.zz, c2 = I.xy * I.yz - I.yy * I.xz;
  const double determinant = I.xx * c0 + I.xy * c1 + I.xz * c2;
  const double c3 = I.xx * I.zz - I.xz * I.xz, c4 = I.xy * I.xz - I.xx * I.yz, c5 = I.xx * I.yy - I.xy * I.xy;
  return (1 / determinant) * Vector3d{c0 * b[0] + c1 * b[1] + c2 * b[2], c1 * b[0] + c3 * b[1] + c4 * b[2],
                                      c2 * b[0] + c4 * b[1] + c5 * b[2]};
}

// Free motion of the targets as a differential equation. y: per target quaternion and angular velocity in T, from index
// `offset` on.
class Tumbling {
 public:
  Tumbling(const StraightInProblem& problem, int offset) : problem_(problem), offset_(offset) {}

  int size() const { return 7 * static_cast<int>(problem_.targets.size()); }
  void add_to(Manifold& m) const {
    m.size += size();
    for (std::size_t t = 0; t < problem_.targets.size(); ++t) m.quaternions.push_back(at(t));
  }

  void put_initial(std::span<double> y) const {
    for (std::size_t t = 0; t < problem_.targets.size(); ++t) {
      const FreeBody& body = problem_.targets[t];
      put(quaternion_from(body.X_WT.R), &y[at(t)]);
      const Vector3d w = transposed_times(body.X_WT.R, body.V_WT.angular);
      for (int k = 0; k < 3; ++k) y[at(t) + 4 + k] = w[k];
    }
  }

  void operator()(double, std::span<const double> y, std::span<double> dydt) const {
    for (std::size_t t = 0; t < problem_.targets.size(); ++t) {
      const double* q = &y[at(t)];
      const Vector3d w{q[4], q[5], q[6]};
      const Symmetric3d& I = problem_.targets[t].inertia;
      const Vector3d w_dot = solve(I, cross(I * w, w));  // (2.13) without torque
      put(quaternion_rate(quaternion(q), w), &dydt[at(t)]);
      for (int k = 0; k < 3; ++k) dydt[at(t) + 4 + k] = w_dot[k];
    }
  }

  // States at time t: orientation from y, centre of mass on its parabola.
  std::vector<FreeBody> bodies(double t, std::span<const double> y) const {
    if (problem_.surroundings && problem_.surroundings->targets) return problem_.surroundings->targets(t);
    std::vector<FreeBody> bodies = problem_.targets;
    const double s = t - problem_.begin;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      FreeBody& b = bodies[i];
      const Vector3d com = b.X_WT * b.com;
      const Vector3d velocity = shift(b.V_WT, b.X_WT.R * b.com).linear;
      const double* q = &y[at(i)];
      b.X_WT.R = rotation_matrix(quaternion(q));
      const Vector3d arm = b.X_WT.R * b.com;
      b.X_WT.p = com + s * velocity + (0.5 * s * s) * problem_.gravity - arm;
      b.V_WT.angular = b.X_WT.R * Vector3d{q[4], q[5], q[6]};
      b.V_WT.linear = velocity + s * problem_.gravity - cross(b.V_WT.angular, arm);
    }
    return bodies;
  }

  static Quaterniond quaternion(const double* q) { return {q[0], q[1], q[2], q[3]}; }
  static void put(const Quaterniond& from, double* q) { q[0] = from.w, q[1] = from.x, q[2] = from.y, q[3] = from.z; }

 private:
  int at(std::size_t t) const { return offset_ + 7 * static_cast<int>(t); }

  const StraightInProblem& problem_;
  int offset_;
};

// The motion (1) with base and targets as a differential equation.
// y: joints; position and quaternion of the base; the targets.
class Motion {
 public:
  Motion(FloatingBase& base, const StraightInProblem& problem, StraightInPath& path)
      : base_(base),
        problem_(problem),
        path_(path),
        n_(base.joints()),
        targets_(problem, n_ + 7),
        theta_dot_(n_),
        phi_(problem.self_motion.coefficients.size() / static_cast<std::size_t>(std::max(1, n_))) {
    if (!problem.rate_begin.empty()) {
      const std::vector<double> y = initial(), own = rates(problem.begin, y);
      for (int j = 0; j < n_; ++j) besides_.push_back(problem.rate_begin[j] - own[j]);
    }
    path_.smallest_singular_value = std::numeric_limits<double>::infinity();
  }

  Manifold manifold() const {
    Manifold m;
    m.size = n_ + 7;
    m.quaternions.push_back(n_ + 3);
    targets_.add_to(m);
    return m;
  }

  std::vector<double> initial() const {
    std::vector<double> y(manifold().size);
    std::copy(problem_.position.begin(), problem_.position.end(), y.begin());
    for (int k = 0; k < 3; ++k) y[n_ + k] = problem_.X_WB.p[k];
    Tumbling::put(quaternion_from(problem_.X_WB.R), &y[n_ + 3]);
    targets_.put_initial(y);
    return y;
  }

  void operator()(double t, std::span<const double> y, std::span<double> dydt) {
    const Posed X_WB = base_pose(y);
    const Momentumd h_B = momentum(t, X_WB);
    resolve(t, y, X_WB, h_B);
    std::copy(theta_dot_.begin(), theta_dot_.end(), dydt.begin());
    const Twistd V_B = twist_from(base_.twist_at(theta_dot_, h_B)) + turn_beside(t);
    const Vector3d v = X_WB.R * V_B.linear;
    for (int k = 0; k < 3; ++k) dydt[n_ + k] = v[k];
    Tumbling::put(quaternion_rate(Tumbling::quaternion(&y[n_ + 3]), V_B.angular), &dydt[n_ + 3]);
    targets_(t, y, dydt);
  }

  // Joint rates at a state; records damping and unmet demands.
  const std::vector<double>& rates(double t, std::span<const double> y) {
    const Posed X_WB = base_pose(y);
    record_ = true;
    resolve(t, y, X_WB, momentum(t, X_WB));
    record_ = false;
    return theta_dot_;
  }

  // Errors at a state.
  std::vector<GoalGap> gaps(double t, std::span<const double> y) {
    const std::vector<double> theta_dot = rates(t, y);
    const Posed X_WB = base_pose(y);
    base_.move(theta_dot, momentum(t, X_WB));
    const Twistd beside = turn_beside(t);
    std::vector<GoalGap> result;
    for (const Goal& g : goals_at(problem_, targets_.bodies(t, y), t)) {
      const Posed X_BE = base_.frame_pose(g.frame);
      const Twistd V_B = base_.frame_twist(g.frame) + shift(beside, X_BE.p);
      result.push_back(goal_gap(g, X_WB * X_BE, X_WB.R * V_B));
    }
    return result;
  }

  Posed base_pose(std::span<const double> y) const {
    return {rotation_matrix(Tumbling::quaternion(&y[n_ + 3])), {y[n_], y[n_ + 1], y[n_ + 2]}};
  }

 private:
  // Residual twist of the base about the centre of mass; after place().
  Twistd turn_beside(double t) const {
    if (!problem_.surroundings) return Twistd::zero();
    const Vector3d w_B = problem_.surroundings->w_B(t);
    return {w_B, -cross(w_B, base_.com())};
  }

  Momentumd momentum(double t, const Posed& X_WB) const {
    return (problem_.surroundings ? problem_.surroundings->motion(t) : problem_.motion).in_base(t, X_WB);
  }

  // theta_dot_ by (1).
  void resolve(double t, std::span<const double> y, const Posed& X_WB, const Momentumd& h_B) {
    const std::vector<Goal> goals = goals_at(problem_, targets_.bodies(t, y), t);
    base_.place(y.first(n_));
    goal_error(base_, X_WB, goals, error_);
    demand_rows(base_, X_WB, h_B, goals, RateDemand::task, G_, b_,
                problem_.surroundings ? problem_.surroundings->w_B(t) : Vector3d::zero());
    pull_in(goals);
    take_out_self_motion(t);
    // No damping if all singular values are above the edge, tested with an upper bound of the largest.
    const double largest = std::sqrt((G_ * G_.transpose()).cwiseAbs().colwise().sum().maxCoeff());
    if (const auto rates = least_norm_above(G_, b_, kDampedBelow * largest)) {
      for (int j = 0; j < n_; ++j) theta_dot_[j] = (*rates)[j];
      add_to_rates(t);
      if (!record_) return;
      const double smallest = smallest_above(kDampedBelow);
      note(t, smallest, smallest, (G_ * *rates - b_).lpNorm<Eigen::Infinity>());
      return;
    }
    const Eigen::BDCSVD<Eigen::MatrixXd> svd(G_, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Eigen::VectorXd& sigma = svd.singularValues();
    Eigen::VectorXd z = svd.matrixU().transpose() * b_;
    double smallest = std::numeric_limits<double>::infinity();
    const double edge = kDampedBelow * sigma[0];
    for (Eigen::Index i = 0; i < sigma.size(); ++i) {
      const double s = sigma[i];
      if (s <= kNoDirection * sigma[0]) {
        z[i] = 0;
        continue;
      }
      smallest = std::min(smallest, s);
      const double lack = std::max(0.0, edge - s);
      z[i] *= s / (s * s + lack * lack);
    }
    const Eigen::VectorXd rates = svd.matrixV() * z;
    for (int j = 0; j < n_; ++j) theta_dot_[j] = rates[j];
    add_to_rates(t);
    if (record_) note(t, smallest, edge, (G_ * rates - b_).lpNorm<Eigen::Infinity>());
  }

  // The smallest singular value of G_ if all are above a share of the largest or structurally zero.
  double smallest_above(double share) const {
    if (G_.size() == 0) return 0;
    const Eigen::VectorXd squares =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(Eigen::MatrixXd(G_ * G_.transpose()), Eigen::EigenvaluesOnly)
            .eigenvalues();
    const double largest = squares[squares.size() - 1];
    constexpr double kRounding = 0.5;
    const auto first =
        std::find_if(squares.begin(), squares.end(), [&](double s) { return s > kRounding * share * share * largest; });
    return first == squares.end() ? 0 : std::sqrt(*first);
  }

  // The rates closest to z that satisfy (1) are z plus the minimum-norm rates for the remainder.
  void take_out_self_motion(double t) {
    if (phi_.empty()) return;
    self_motion_basis((t - problem_.begin) / (problem_.end - problem_.begin), phi_);
    z_.setZero(n_);
    for (std::size_t k = 0; k < phi_.size(); ++k) {
      z_ += phi_[k] * Eigen::Map<const Eigen::VectorXd>(
                          problem_.self_motion.coefficients.data() + static_cast<std::ptrdiff_t>(k) * n_, n_);
    }
    b_ -= G_ * z_;
  }
  void add_to_rates(double t) {
    for (Eigen::Index j = 0; j < z_.size(); ++j) theta_dot_[static_cast<std::size_t>(j)] += z_[j];
    const double left = std::exp(-kGain * (t - problem_.begin));
    for (std::size_t j = 0; j < besides_.size(); ++j) theta_dot_[j] += left * besides_[j];
  }

  // - k e of (1). Rows of task and error agree, except that a roll is one row, or makes three rows in W of the two
  // across the direction.
  void pull_in(std::span<const Goal> goals) {
    Eigen::Index row = 0, at = 0;
    for (const Goal& g : goals) {
      const bool across = g.roll && g.orientation == Goal::Orientation::axis;
      const Eigen::Index rows = across ? 3 : rows_of(g);
      b_.segment(row, rows) -= kGain * error_.segment(at, rows);
      if (across) b_.segment<3>(row + 3) -= kGain * across_in_world(g, error_.segment<2>(at + 3));
      row += across ? 6 : rows + (g.roll && g.orientation == Goal::Orientation::free ? 1 : 0);
      at += rows_of(g);
    }
  }

  void note(double t, double smallest, double edge, double unmet) {
    path_.smallest_singular_value = std::min(path_.smallest_singular_value, smallest);
    if (smallest < edge) {
      if (!path_.damped) path_.damped_begin = t;
      path_.damped = true;
      path_.damped_end = t;
    }
    if (unmet > path_.unmet) path_.unmet = unmet, path_.unmet_time = t;
  }

  FloatingBase& base_;
  const StraightInProblem& problem_;
  StraightInPath& path_;
  int n_;
  Tumbling targets_;
  bool record_ = false;
  std::vector<double> theta_dot_, phi_, besides_;
  Eigen::VectorXd error_, b_, z_;
  Eigen::MatrixXd G_;
};

// Integral of a series of rates over its segment, from an initial value: sum_k c_k T_k integrates to b_k = half
// (c_{k-1} - c_{k+1}) / (2 k), with 2 c_0 for k = 1 (Trefethen 2013, chapter 19).
ChebyshevSegment integrated(const ChebyshevSegment& rates, double half, double begin_value) {
  const std::vector<double>& c = rates.coefficients;
  const std::size_t n = c.size();
  ChebyshevSegment position{std::vector<double>(n + 1, 0.0)};
  std::vector<double>& b = position.coefficients;
  double at_begin = 0;  // value of the sum without b_0: T_k(-1) = (-1)^k
  for (std::size_t k = 1; k <= n; ++k) {
    const double below = k == 1 ? 2 * c[0] : c[k - 1], above = k + 1 < n ? c[k + 1] : 0.0;
    b[k] = half * (below - above) / (2 * static_cast<double>(k));
    at_begin += k % 2 == 0 ? b[k] : -b[k];
  }
  b[0] = begin_value - at_begin;
  return position;
}

// Ends of the segments and the sample points of the series on them, increasing: segment i has those from i kDegree to
// (i + 1) kDegree.
std::vector<double> segment_times(const StraightInProblem& problem, int segments) {
  std::vector<double> times;
  const double h = (problem.end - problem.begin) / segments;
  for (int i = 0; i < segments; ++i) {
    const double a = problem.begin + i * h, b = i + 1 == segments ? problem.end : problem.begin + (i + 1) * h;
    for (int k = i == 0 ? 0 : 1; k <= kDegree; ++k) times.push_back(chebyshev_point(a, b, k, kDegree));
  }
  return times;
}

// The motion at the sample points of several numbers of segments, from one integration.
struct Integration {
  IntegrationResult result;
  std::vector<double> times;  // increasing
  std::vector<std::vector<double>> states;
};

DormandPrince853<double> make_stepper(const Manifold& manifold, const StraightInProblem& problem) {
  Tolerances tolerances;
  tolerances.rtol = 1e-12, tolerances.atol = 1e-13;
  StepControl control;
  control.max_steps = problem.max_steps;
  return {manifold, tolerances, control};
}

// Problem => motion at the sample points of all numbers of segments, by one adaptive integration of (1).
Integration integrate_approach(FloatingBase& base, const StraightInProblem& problem, std::span<const int> numbers,
                               StraightInPath& path) {
  Motion motion(base, problem, path);
  DormandPrince853<double> stepper = make_stepper(motion.manifold(), problem);
  Integration integration;
  for (int segments : numbers) {
    const std::vector<double> times = segment_times(problem, segments);
    integration.times.insert(integration.times.end(), times.begin(), times.end());
  }
  std::sort(integration.times.begin(), integration.times.end());
  integration.times.erase(std::unique(integration.times.begin(), integration.times.end()), integration.times.end());
  const auto observe = [&](double, std::span<const double> y) { integration.states.emplace_back(y.begin(), y.end()); };
  const std::vector<double> y0 = motion.initial();
  integration.result =
      integrate(stepper, motion, problem.begin, y0, problem.end, ObservedTimes{integration.times, observe});
  return integration;
}

// Fits the rates at the sample points; positions are the integrals of the series. Rates are therefore continuous
// between segments for any quality of the fit: a jump would be an impulse missing in the conservation checks. The
// largest last coefficient measures the quality of the fit.
void fit(FloatingBase& base, const StraightInProblem& problem, const Integration& integration, int segments,
         StraightInPath& path) {
  const int n = base.joints();
  Motion motion(base, problem, path);
  const std::vector<double> times = segment_times(problem, segments);
  std::vector<std::vector<double>> values(n);
  for (double t : times) {
    const auto at = std::lower_bound(integration.times.begin(), integration.times.end(), t) - integration.times.begin();
    const std::vector<double>& rates = motion.rates(t, integration.states[static_cast<std::size_t>(at)]);
    if (t == problem.begin) path.rate_begin = rates;
    if (t == problem.end) path.rate_end = rates;
    for (int j = 0; j < n; ++j) values[j].push_back(rates[j]);
  }
  for (std::size_t i = 0; i < integration.times.size(); ++i) {
    const std::vector<double>& y = integration.states[i];
    path.points.push_back({integration.times[i], {y.begin(), y.begin() + n}, motion.base_pose(y)});
  }
  path.gaps = motion.gaps(problem.end, integration.states.back());
  path.joints.assign(n, {});
  path.fit_error = 0;
  for (int j = 0; j < n; ++j) {
    double position = problem.position[j];
    for (int i = 0; i < segments; ++i) {
      const std::span<const double> samples(values[j].data() + i * kDegree, kDegree + 1);
      const double a = times[static_cast<std::size_t>(i) * kDegree],
                   b = times[static_cast<std::size_t>(i + 1) * kDegree];
      ChebyshevSegment segment = integrated(chebyshev_interpolant(samples), 0.5 * (b - a), position);
      const auto& c = segment.coefficients;
      path.fit_error = std::max({path.fit_error, std::abs(c[kDegree + 1]), std::abs(c[kDegree])});
      position = std::accumulate(c.begin(), c.end(), 0.0);  // T_k(1) = 1
      path.joints[j].segments.push_back({a, b, std::move(segment)});
    }
  }
}

Rotationd turned_by(const Vector3d& v) {
  const double angle = norm(v);
  return angle > 0 ? rotation_about((1 / angle) * v, angle) : Rotationd::identity();
}

}  // namespace

// Targets at a time => goals of all end-effectors on their approach lines, with the demanded twists.
std::vector<Goal> goals_at(const StraightInProblem& problem, std::span<const FreeBody> targets, double time) {
  const double duration = problem.end - problem.begin, t = time - problem.begin;
  const JointPath to_the_point{JointProfile::quintic, duration, problem.stand_off, 0, 0, -problem.final_speed};
  // The part with unit final rate that vanishes at the begin and end.
  const JointPath rate_alone{JointProfile::quintic, duration, 0, 0, 0, 1};
  const JointPoint d = evaluate(to_the_point, t), e = evaluate(rate_alone, t);
  std::vector<Goal> goals;
  for (const StraightGoal& s : problem.goals) {
    const FreeBody& body = targets[s.target];
    Goal g;
    g.frame = s.frame;
    g.name = s.name, g.target = s.target_name, g.point = s.point;
    g.orientation = s.orientation;
    g.axis_E = s.axis_E;
    g.roll = s.roll;
    const Rotationd turned = turned_by(e.position * s.spin_T) * turned_by(s.turn_T);
    const Vector3d p_T = s.X_TG.p - d.position * s.direction_T + e.position * s.velocity_T;
    g.direction_W = body.X_WT.R * (turned * s.direction_T);
    g.X_WG = body.X_WT * Posed{turned * s.X_TG.R, p_T};
    g.V_WG = shift(body.V_WT, body.X_WT.R * p_T);
    g.V_WG.linear += body.X_WT.R * (e.rate * s.velocity_T - d.rate * s.direction_T);
    g.V_WG.angular += body.X_WT.R * (e.rate * s.spin_T);
    goals.push_back(g);
  }
  return goals;
}

// Times during the straight approach => poses and twists of the targets, by integration of their free motion (5.1).
std::vector<std::vector<FreeBody>> target_states(const StraightInProblem& problem, std::span<const double> times) {
  const Tumbling tumbling(problem, 0);
  Manifold manifold;
  tumbling.add_to(manifold);
  std::vector<std::vector<FreeBody>> result;
  if (problem.targets.empty()) return std::vector<std::vector<FreeBody>>(times.size());
  std::vector<double> y0(static_cast<std::size_t>(manifold.size));
  tumbling.put_initial(y0);
  DormandPrince853<double> stepper = make_stepper(manifold, problem);
  const auto observe = [&](double t, std::span<const double> y) { result.push_back(tumbling.bodies(t, y)); };
  integrate(stepper, tumbling, problem.begin, y0, problem.end, ObservedTimes{times, observe});
  return result;
}

// x => phi_0(x), phi_1(x), ..., by the three-term recursion of the Gegenbauer polynomials.
void self_motion_basis(double x, std::span<double> phi) {
  constexpr double kOrder = 4.5;  // of the Gegenbauer polynomials: their weight on [-1, 1] is (1 - u^2)^4
  const double u = 2 * x - 1, bump = 1 - u * u;
  double before = 0, now = 1;
  for (std::size_t k = 0; k < phi.size(); ++k) {
    // NIST Digital Library of Mathematical Functions, table 18.3.1, over [-1, 1]; half of that over [0, 1].
    const double n = static_cast<double>(k);
    const double square = std::numbers::pi * std::pow(2.0, 1 - 2 * kOrder) * std::tgamma(n + 2 * kOrder) /
                          ((n + kOrder) * std::pow(std::tgamma(kOrder), 2) * std::tgamma(n + 1));
    phi[k] = bump * bump * now / std::sqrt(0.5 * square);
    const double next = (2 * (n + kOrder) * u * now - (n + 2 * kOrder - 1) * before) / (n + 1);
    before = now, now = next;
  }
}

// Problem => joint trajectories as Chebyshev series: integrates (1) and increases the number of segments until the fit
// is within tolerance.
StraightInPath plan_straight_in(FloatingBase& base, const StraightInProblem& problem) {
  // One integration serves these numbers of segments; most motions need no more.
  constexpr int kNumbers[2][3] = {{2, 4, 8}, {16, 32, 64}};
  StraightInPath path;
  long evaluations = 0;
  for (const auto& numbers : kNumbers) {
    const Integration integration = integrate_approach(base, problem, numbers, path);
    evaluations += integration.result.statistics.rhs_evaluations;
    for (int segments : numbers) {
      path = {};
      path.rhs_evaluations = evaluations;
      path.finished = integration.result.finished();
      if (!path.finished) {
        path.failure = integration.result.explanation();
        return path;  // a further attempt would fail as well
      }
      fit(base, problem, integration, segments, path);
      if (path.fit_error <= kFitTolerance) return path;
    }
  }
  return path;
}

}  // namespace grapnel
