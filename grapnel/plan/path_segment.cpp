#include "grapnel/plan/path_segment.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {
namespace {

constexpr int kStages = 16;  // nodes of a panel
// The last Legendre coefficients of w over a panel, times its length, may be this large [rad]. The collocation's error
// goes with their square.
constexpr double kUnresolved[] = {1e-5, 1e-8};
// More nodes are not spent on one motion: in a search joints that swing so far are no plan, and all nodes are kept in
// memory. Some three are needed per radian that joints or the base turn.
constexpr std::size_t kMostNodes[] = {4096, 8192};

const GaussLegendre& method() {
  static const GaussLegendre gauss(kStages);
  return gauss;
}

Eigen::Matrix3d matrix_of(const Symmetric3d& I) {
  return (Eigen::Matrix3d() << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz).finished();
}
Eigen::Matrix3d cross_matrix(const Vector3d& v) {
  return (Eigen::Matrix3d() << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0).finished();
}

}  // namespace

Quaterniond normalized(const Quaterniond& q) {
  const double scale = 1 / std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {scale * q.w, scale * q.x, scale * q.y, scale * q.z};
}

Vector3d FreeMotion::com_at(double t) const {
  const double s = t - time;
  return p_WCom + (s / mass) * h.linear + (0.5 * s * s) * gravity;
}

Momentumd FreeMotion::in_base(double t, const Posed& X_WB) const {
  const double s = t - time;
  const Momentumd now{h.angular, h.linear + (mass * s) * gravity};
  return transposed_times(X_WB.R, shift(now, X_WB.p - com_at(t)));
}

FreeMotion free_motion(const Model& model, const State& state, double time, const Vector3d& gravity) {
  const Kinematics k = forward_kinematics(model, state);
  const Vector3d com = center_of_mass(model, k);
  return {time, com, momentum_about(model, k, com), model.mass(), gravity};
}

PathSegment::PathSegment(FloatingBase& base, SegmentStart start, FreeMotion motion)
    : base_(base),
      start_(std::move(start)),
      motion_(motion),
      spline_(start_.knots),
      theta_(base.joints()),
      g_(base.joints()) {
  // A spline's third derivatives jump at its knots: none lies inside of a panel.
  for (int& panels : panels_) panels = spline_.knots() + 1;
  least_panels_ = spline_.knots() + 1;
}

JointPath PathSegment::path(int j, double position, double rate) const {
  return {start_.profile, start_.end - start_.begin, start_.position[j], position, start_.rate[j], rate};
}

std::vector<JointPiece> PathSegment::pieces(int j, double position, double rate,
                                            std::span<const double> coefficients) const {
  std::vector<double> own;
  for (std::size_t k = static_cast<std::size_t>(j); k < coefficients.size(); k += theta_.size()) {
    own.push_back(coefficients[k]);
  }
  return pieces_of(start_.begin, path(j, position, rate), own);
}

void PathSegment::lay_panels(int panels) {
  if (laid_ == panels) return;
  laid_ = panels;
  nodes_.resize(static_cast<std::size_t>(panels) * kStages);
  const double T = start_.end - start_.begin, h = T / panels;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    const int stage = static_cast<int>(i) % kStages;
    const double s = h * (static_cast<double>(i / kStages) + method().node(stage));
    node.time = start_.begin + s;
    node.weight = h * method().weight(stage);
    node.a = evaluate(JointPath{start_.profile, T, 0, 1, 0, 0}, s);
    node.b = evaluate(JointPath{start_.profile, T, 0, 0, 0, 1}, s);
    node.c = evaluate(JointPath{start_.profile, T, 0, 0, 1, 0}, s);
    node.N.resize(static_cast<std::size_t>(spline_.knots()));
    spline_.evaluate(s / T, node.N);
    for (JointPoint& N : node.N) N.rate /= T, N.acceleration /= T * T;
    node.rates.resize(theta_.size());
  }
}

void PathSegment::place_nodes(std::span<const double> position, std::span<const double> rate,
                              std::span<const double> coefficients) {
  for (Node& node : nodes_) {
    for (std::size_t j = 0; j < theta_.size(); ++j) {
      const double from = start_.position[j], way = position[j] - from, first = start_.rate[j];
      theta_[j] = from + way * node.a.position + rate[j] * node.b.position + first * node.c.position;
      node.rates[j] = way * node.a.rate + rate[j] * node.b.rate + first * node.c.rate;
    }
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
      const JointPoint& N = node.N[i / theta_.size()];
      theta_[i % theta_.size()] += coefficients[i] * N.position;
      node.rates[i % theta_.size()] += coefficients[i] * N.rate;
    }
    base_.place(theta_, node.links);
    node.u = FloatingBase::momentum_of_rates(node.links, node.rates);
  }
  evaluations_ += static_cast<long>(nodes_.size());
}

double PathSegment::turn_panel(std::span<Node> nodes, Quaterniond& q0) {
  constexpr int kMost = 40;
  constexpr double kSettled = 4e-16;
  const double h = (start_.end - start_.begin) / laid_;
  const Vector3d& L = motion_.h.angular;
  const bool driven = dot(L, L) > 0;
  // One quaternion per column.
  using Quaternions = Eigen::Matrix<double, 4, kStages>;
  const Eigen::Vector4d begin(q0.w, q0.x, q0.y, q0.z);
  Quaternions q = begin.replicate<1, kStages>(), rate;
  const auto at = [](const Quaternions& all, int i) { return Quaterniond{all(0, i), all(1, i), all(2, i), all(3, i)}; };
  for (Node& node : nodes) node.w_B = node.links.H_inverse * -node.u;
  double change = 1, before = std::numeric_limits<double>::infinity();
  for (int iteration = 0;; ++iteration) {
    for (int i = 0; i < kStages; ++i) {
      Node& node = nodes[static_cast<std::size_t>(i)];
      if (driven) {
        node.R = rotation_matrix(normalized(at(q, i)));
        node.w_B = node.links.H_inverse * (transposed_times(node.R, L) - node.u);  // (1)
      }
      const Quaterniond r = quaternion_rate(at(q, i), node.w_B);
      rate.col(i) << h * r.w, h * r.x, h * r.y, h * r.z;
    }
    // Once nothing changes but by rounding.
    if (change <= kSettled || (change <= 1e-14 && change >= before)) break;
    if (iteration == kMost || !std::isfinite(change)) return std::numeric_limits<double>::infinity();
    before = change;
    Quaternions next = begin.replicate<1, kStages>();
    for (int j = 0; j < kStages; ++j) {
      for (int i = 0; i < kStages; ++i) next.col(i) += method().a(i, j) * rate.col(j);
    }
    change = (next - q).cwiseAbs().maxCoeff();
    q = next;
  }
  Vector3d last = Vector3d::zero(), last_but_one = Vector3d::zero();
  Eigen::Vector4d end = begin;
  for (int i = 0; i < kStages; ++i) {
    Node& node = nodes[static_cast<std::size_t>(i)];
    node.R = rotation_matrix(normalized(at(q, i)));
    end += method().weight(i) * rate.col(i);
    last += method().last(i) * node.w_B, last_but_one += method().last_but_one(i) * node.w_B;
  }
  q0 = normalized({end[0], end[1], end[2], end[3]});
  return h * std::max(norm(last), norm(last_but_one));
}

double PathSegment::turn(Quaterniond& q) {
  double worst = 0;
  for (std::size_t i = 0; i < nodes_.size(); i += kStages) {
    worst = std::max(worst, turn_panel(std::span(nodes_).subspan(i, kStages), q));
    if (!std::isfinite(worst)) break;
  }
  return worst;
}

// Phi of (3) at the nodes, and at the end, by the same collocation.
Eigen::Matrix3d PathSegment::propagate_phi() {
  Eigen::Matrix3d Phi = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d L = cross_matrix(motion_.h.angular);
  if (!(dot(motion_.h.angular, motion_.h.angular) > 0)) return Phi;
  const double h = (start_.end - start_.begin) / laid_;
  std::array<Eigen::Matrix3d, kStages> N, rate;
  for (std::size_t first = 0; first < nodes_.size(); first += kStages) {
    const auto nodes = std::span(nodes_).subspan(first, kStages);
    for (int i = 0; i < kStages; ++i) {
      Node& node = nodes[static_cast<std::size_t>(i)];
      const Eigen::Matrix3d R = as_matrix(node.R);
      N[i] = R * matrix_of(node.links.H_inverse) * R.transpose() * L;
      node.Phi = Phi;
    }
    constexpr int kMost = 40;
    for (int iteration = 0; iteration < kMost; ++iteration) {
      for (int i = 0; i < kStages; ++i) rate[i] = N[i] * nodes[static_cast<std::size_t>(i)].Phi;
      double change = 0;
      for (int i = 0; i < kStages; ++i) {
        Eigen::Matrix3d next = Phi;
        for (int j = 0; j < kStages; ++j) next += h * method().a(i, j) * rate[j];
        change = std::max(change, (next - nodes[static_cast<std::size_t>(i)].Phi).lpNorm<Eigen::Infinity>());
        nodes[static_cast<std::size_t>(i)].Phi = next;
      }
      if (change <= 1e-15 * Phi.lpNorm<Eigen::Infinity>()) break;
    }
    for (int i = 0; i < kStages; ++i) Phi += h * method().weight(i) * rate[i];
  }
  return Phi;
}

void PathSegment::add_sensitivities(const Quaterniond& q, const PlacedLinks& at_end, SegmentEnd& end) {
  const int n = joints(), knots = spline_.knots();
  const Eigen::Matrix3d Phi = propagate_phi();
  const bool turns = dot(motion_.h.angular, motion_.h.angular) > 0;
  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, unknowns());  // the integral of (3)
  turned_.clear();
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    if (keeps_way_) {
      node.turning.setZero(3, unknowns());
      if (i % kStages == 0) turned_.push_back(sum);
    }
    base_.angular_momentum_per_angle(node.links, node.rates, node.w_B, g_);
    Eigen::Matrix3d M = -as_matrix(node.R) * matrix_of(node.links.H_inverse);
    if (turns) M = (node.Phi.inverse() * M).eval();
    for (int j = 0; j < n; ++j) {
      const Eigen::Vector3d g = M * column(g_[j]), k = M * column(node.links.k[j]);
      const auto add = [&](int unknown, const JointPoint& basis) {
        const Eigen::Vector3d turning = basis.position * g + basis.rate * k;
        sum.col(unknown) += node.weight * turning;
        if (keeps_way_) node.turning.col(unknown) = turning;
      };
      add(j, node.a);
      add(n + j, node.b);
      for (int c = 0; c < knots; ++c) add((2 + c) * n + j, node.N[static_cast<std::size_t>(c)]);
    }
  }
  const Eigen::Matrix3d to_base = as_matrix(rotation_matrix(q)).transpose() * Phi;
  const Eigen::Vector3d c = column(at_end.com);
  Matrix6Xd all(6, unknowns());
  all.topRows(3) = to_base * sum;
  for (int j = 0; j < unknowns(); ++j) {
    all.col(j).tail(3) = c.cross(all.col(j).head<3>());
    if (j < n) all.col(j).tail(3) -= column((1 / at_end.mass) * at_end.joint_momentum[j].linear);
  }
  end.per_position = all.leftCols(n);
  end.per_rate = all.middleCols(n, n);
  end.per_coefficient = all.rightCols(knots * n);
}

void PathSegment::keep_way(int least_panels) {
  keeps_way_ = true;
  const int parts = spline_.knots() + 1;
  least_panels_ = (std::max(least_panels, 1) + parts - 1) / parts * parts;
  for (int& panels : panels_) panels = std::max(panels, least_panels_);
}

PathSegment::WayPoint PathSegment::way_point(int index) const {
  const Node& node = nodes_[static_cast<std::size_t>(index)];
  WayPoint at;
  at.time = node.time, at.weight = node.weight;
  at.a = node.a, at.b = node.b, at.N = node.N;
  at.links = &node.links, at.w_B = node.w_B;
  at.rate = node.rates;
  const std::size_t n = theta_.size();
  for (std::size_t j = 0; j < n; ++j) {
    const double from = start_.position[j], way = position_[j] - from, first = start_.rate[j];
    at.position.push_back(from + way * node.a.position + rate_[j] * node.b.position + first * node.c.position);
    at.acceleration.push_back(way * node.a.acceleration + rate_[j] * node.b.acceleration + first * node.c.acceleration);
  }
  for (std::size_t i = 0; i < coefficients_.size(); ++i) {
    at.position[i % n] += coefficients_[i] * node.N[i / n].position;
    at.acceleration[i % n] += coefficients_[i] * node.N[i / n].acceleration;
  }
  at.X_WB = start_.X_WB;
  if (base_.floats()) at.X_WB = {node.R, motion_.com_at(node.time) - node.R * node.links.com};
  return at;
}

Eigen::Matrix3Xd PathSegment::turn_per_unknown(int index) const {
  if (!base_.floats()) return Eigen::Matrix3Xd::Zero(3, unknowns());
  const std::size_t panel = static_cast<std::size_t>(index) / kStages, first = panel * kStages;
  const double h = (start_.end - start_.begin) / laid_;
  Eigen::Matrix3Xd sum = turned_[panel];
  for (int j = 0; j < kStages; ++j) {
    sum += h * method().a(index % kStages, j) * nodes_[first + static_cast<std::size_t>(j)].turning;
  }
  return nodes_[static_cast<std::size_t>(index)].Phi * sum;
}

Eigen::Matrix3Xd PathSegment::w_per_unknown(int index) {
  const int n = joints();
  Eigen::Matrix3Xd D = Eigen::Matrix3Xd::Zero(3, unknowns());
  if (!base_.floats()) return D;
  const Node& node = nodes_[static_cast<std::size_t>(index)];
  // (1): H dw = -g dtheta - k dtheta' + d(R^T L), and R^T L changes by (R^T L) x (R^T eta).
  base_.angular_momentum_per_angle(node.links, node.rates, node.w_B, g_);
  const Eigen::Matrix3d H_inverse = matrix_of(node.links.H_inverse);
  for (int j = 0; j < n; ++j) {
    const Eigen::Vector3d g = H_inverse * column(g_[j]), k = H_inverse * column(node.links.k[j]);
    const auto put = [&](int unknown, const JointPoint& basis) {
      D.col(unknown) = -(basis.position * g + basis.rate * k);
    };
    put(j, node.a);
    put(n + j, node.b);
    for (int c = 0; c < spline_.knots(); ++c) put((2 + c) * n + j, node.N[static_cast<std::size_t>(c)]);
  }
  if (dot(motion_.h.angular, motion_.h.angular) > 0) {
    const Eigen::Matrix3d Rt = as_matrix(node.R).transpose();
    D += H_inverse * cross_matrix(transposed_times(node.R, motion_.h.angular)) * Rt * turn_per_unknown(index);
  }
  return D;
}

SegmentEnd PathSegment::fly(std::span<const double> position, std::span<const double> rate, bool sensitivities,
                            SegmentAccuracy accuracy, std::span<const double> coefficients) {
  const int n = base_.joints();
  SegmentEnd end;
  if (keeps_way_) {
    position_.assign(position.begin(), position.end()), rate_.assign(rate.begin(), rate.end());
    coefficients_.assign(coefficients.begin(), coefficients.end());
  }
  if (!base_.floats()) {
    end.finished = true;
    end.X_WB = start_.X_WB;
    end.per_position = end.per_rate = Matrix6Xd::Zero(6, n);
    end.per_coefficient = Matrix6Xd::Zero(6, spline_.knots() * n);
    if (keeps_way_) {
      lay_panels(least_panels_);
      place_nodes(position, rate, coefficients);
    }
    return end;
  }
  const double tolerance = kUnresolved[static_cast<int>(accuracy)];
  int& panels = panels_[static_cast<int>(accuracy)];
  Quaterniond q;
  for (;; panels *= 2) {
    lay_panels(panels);
    place_nodes(position, rate, coefficients);
    q = quaternion_from(start_.X_WB.R);
    const double unresolved = turn(q);
    if (unresolved <= tolerance) {
      // A panel of twice the length resolves less by 2^stages: whether that would have done.
      for (double longer = unresolved; panels > least_panels_; panels /= 2) {
        longer = std::ldexp(longer, kStages + 1);
        if (longer > tolerance) break;
      }
      break;
    }
    if (std::isnan(unresolved) || 2 * nodes_.size() > kMostNodes[static_cast<int>(accuracy)]) {
      end.failure = fmt::format("the base's rotation is not resolved by {} nodes on a segment of {:.6g} s",
                                nodes_.size(), start_.end - start_.begin);
      panels = least_panels_;
      return end;
    }
  }
  base_.place(position, end_links_);
  ++evaluations_;
  end.finished = true;
  end.X_WB.R = rotation_matrix(q);
  end.X_WB.p = motion_.com_at(start_.end) - end.X_WB.R * end_links_.com;
  if (sensitivities) add_sensitivities(q, end_links_, end);
  return end;
}

}  // namespace grapnel
