#include "grapnel/plan/path_segment.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {
namespace {

constexpr int kStages = kPanelNodes;
using Vector4 = std::array<double, 4>;
// Maximum of the last Legendre coefficients of w over a panel, times its length [rad]. The collocation error is
// proportional to their square.
constexpr double kUnresolved[] = {1e-5, 1e-8};
// Maximum number of nodes per segment: joint motion that needs more is not a useful plan, and all nodes are stored in
// memory. About three nodes are needed per radian of joint or base rotation.
constexpr std::size_t kMaxNodes[] = {4096, 8192};

const GaussLegendre& method() {
  static const GaussLegendre gauss(kStages);
  return gauss;
}

// a_ij of the collocation, column-major.
const double* collocation() {
  static const std::vector<double> columns = [] {
    std::vector<double> a;
    for (int j = 0; j < kStages; ++j) {
      for (int i = 0; i < kStages; ++i) a.push_back(method().a(i, j));
    }
    return a;
  }();
  return columns.data();
}

NodeLayout layout_of(int links, int joints) {
  NodeLayout l{};
  int next = 0;
  const auto put = [&](int& offset, int numbers) { offset = next, next += numbers; };
  put(l.X_BL, 12 * links), put(l.axis, 6 * links), put(l.composite, 10 * links), put(l.inertia, 10 * links);
  put(l.joint_momentum, 6 * joints), put(l.k, 3 * joints);
  put(l.com, 3), put(l.mass, 1), put(l.H_inverse, 6);
  put(l.u, 3), put(l.R, 9), put(l.w_B, 3), put(l.Phi, 9), put(l.rate, joints);
  put(l.g, 3 * joints), put(l.g_turned, 3 * joints), put(l.k_turned, 3 * joints);
  l.size = next;
  return l;
}

using MakeNodes = SegmentNodes* (*)(const NodeTables&);

// Instruction set => factory of its nodes; one lane if there is none.
MakeNodes nodes_of(std::optional<lanes::InstructionSet> set) {
  return lanes::of_set(set.value_or(lanes::InstructionSet::one_lane),
                       []<class Set>(std::type_identity<Set>) -> MakeNodes { return make_segment_nodes_of<Set>; });
}

Eigen::Matrix3d cross_matrix(const Vector3d& v) {
  return (Eigen::Matrix3d() << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0).finished();
}

}  // namespace

SegmentNodes::~SegmentNodes() = default;

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

PathSegment::PathSegment(FloatingBase& base, SegmentStart start, FreeMotion motion,
                         std::optional<lanes::InstructionSet> set)
    : base_(base),
      start_(std::move(start)),
      motion_(motion),
      spline_(start_.knots),
      layout_(layout_of(base.tree().link_count, base.joints())) {
  const ServicerTree<double> tree = base.tree();
  lanes_.reset(nodes_of(set)({tree.links, tree.link_count, base.model().coordinates(), tree.joint_link, tree.link_joint,
                              tree.joints, spline_.knots(), layout_, collocation()}));
  // A spline's third derivatives jump at its knots: panels must not contain knots.
  for (int& panels : panels_) panels = spline_.knots() + 1;
  min_panels_ = spline_.knots() + 1;
}

JointPath PathSegment::path(int j, double position, double rate) const {
  return {start_.profile, start_.end - start_.begin, start_.position[j], position, start_.rate[j], rate};
}

std::vector<JointSegment> PathSegment::joint_segments(int j, double position, double rate,
                                                      std::span<const double> coefficients) const {
  std::vector<double> own;
  for (std::size_t k = static_cast<std::size_t>(j); k < coefficients.size(); k += start_.position.size()) {
    own.push_back(coefficients[k]);
  }
  return segments_of(start_.begin, path(j, position, rate), own);
}

// Number of panels => times, weights and basis functions of all nodes.
void PathSegment::lay_panels(int panels) {
  if (laid_ == panels) return;
  laid_ = 0;  // invalid until the setup is complete
  const std::size_t count = static_cast<std::size_t>(panels) * kStages,
                    knots = static_cast<std::size_t>(spline_.knots());
  nodes_.resize(count), N_.resize(count * knots);
  basis_.resize(2 * (3 + knots) * count), weights_.resize(count);
  const double T = start_.end - start_.begin, h = T / panels;
  for (std::size_t i = 0; i < count; ++i) {
    Node& node = nodes_[i];
    const int stage = static_cast<int>(i) % kStages;
    const double s = h * (static_cast<double>(i / kStages) + method().node(stage));
    node.time = start_.begin + s;
    weights_[i] = h * method().weight(stage);
    node.a = evaluate(JointPath{start_.profile, T, 0, 1, 0, 0}, s);
    node.b = evaluate(JointPath{start_.profile, T, 0, 0, 0, 1}, s);
    node.c = evaluate(JointPath{start_.profile, T, 0, 0, 1, 0}, s);
    const std::span<JointPoint> N = std::span(N_).subspan(i * knots, knots);
    spline_.evaluate(s / T, N);
    for (JointPoint& point : N) point.rate /= T, point.acceleration /= T * T;
    std::size_t row = i;
    const auto put = [&](const JointPoint& point) {
      basis_[row] = point.position, basis_[row + count] = point.rate;
      row += 2 * count;
    };
    put(node.a), put(node.b), put(node.c);
    for (const JointPoint& point : N) put(point);
  }
  lanes_->reserve(has_path_constraints_ ? nodes() : kStages);
  laid_ = panels;
}

NodePanel PathSegment::panel_of(std::span<const double> position, std::span<const double> rate,
                                std::span<const double> coefficients) const {
  NodePanel p{};
  p.floats = base_.floats(), p.turns = base_.turns(), p.driven = driven();
  p.L = motion_.h.angular;
  p.h = (start_.end - start_.begin) / laid_;
  p.nodes = nodes();
  p.start = start_.position.data(), p.start_rate = start_.rate.data();
  p.final = position.data(), p.final_rate = rate.data();
  p.coefficients = coefficients.data(), p.coefficient_count = static_cast<int>(coefficients.size());
  p.basis = basis_.data(), p.weight = weights_.data();
  return p;
}

// Panels and initial attitude => attitude at the end, by Gauss-Legendre collocation, and, with `sensitivities`, the
// sums of (6.7). Returns the largest last Legendre coefficient of w, times the panel length [rad]; infinite if a panel
// diverges.
double PathSegment::turn(NodePanel& panel, double tolerance, bool sensitivities, Quaterniond& q) {
  if (sensitivities) {
    phi_.setIdentity();
    sums_.assign(static_cast<std::size_t>(3 * kSumParts * unknowns()), 0.0);
    panel.sums = sums_.data();
    turned_.clear();
  }
  double worst = 0;
  for (panel.first = 0; panel.first < nodes(); panel.first += kStages) {
    panel.storage_index = has_path_constraints_ ? panel.first : 0;
    const Vector4 begin{q.w, q.x, q.y, q.z};
    for (int k = 0; k < 4; ++k) panel.q[k] = begin[static_cast<std::size_t>(k)];
    lanes_->place(panel);
    base_.count(kStages), evaluations_ += kStages;
    if (!lanes_->turn(panel)) return std::numeric_limits<double>::infinity();
    Vector3d last = Vector3d::zero(), last_but_one = Vector3d::zero();
    Vector4 end = begin;
    for (int i = 0; i < kStages; ++i) {
      for (int k = 0; k < 4; ++k) end[static_cast<std::size_t>(k)] += method().weight(i) * panel.q_rate[k][i];
      const Vector3d w{panel.w_B[0][i], panel.w_B[1][i], panel.w_B[2][i]};
      last += method().last(i) * w, last_but_one += method().last_but_one(i) * w;
    }
    q = normalized({end[0], end[1], end[2], end[3]});
    worst = std::max(worst, panel.h * std::max(norm(last), norm(last_but_one)));
    sensitivities = sensitivities && worst <= tolerance;  // otherwise panels are refined
    if (!sensitivities) continue;
    if (has_path_constraints_) turned_.push_back(summed());
    std::copy_n(phi_.data(), 9, panel.Phi);
    lanes_->sensitivities(panel);
    if (!panel.driven) continue;
    for (int k = 0; k < 9; ++k) {
      for (int i = 0; i < kStages; ++i) phi_.data()[k] += panel.h * method().weight(i) * panel.Phi_rate[k][i];
    }
  }
  return worst;
}

// Adds the partial sums in a fixed order.
Eigen::Matrix3Xd PathSegment::summed() const {
  Eigen::Matrix3Xd sum(3, unknowns());
  for (Eigen::Index i = 0; i < sum.size(); ++i) {
    const double* const part = sums_.data() + i * kSumParts;
    sum.data()[i] = ((part[0] + part[4]) + (part[2] + part[6])) + ((part[1] + part[5]) + (part[3] + part[7]));
  }
  return sum;
}

// Sums over the nodes => derivatives of the final base displacement (3) with respect to all unknowns.
void PathSegment::add_sensitivities(const Quaterniond& q, SegmentEnd& end) {
  const int n = joints();
  const Eigen::Matrix3d to_base = as_matrix(rotation_matrix(q)).transpose() * phi_;
  const Eigen::Vector3d c = column(base_.com());
  Matrix6Xd all(6, unknowns());
  all.topRows(3) = to_base * summed();
  for (int j = 0; j < unknowns(); ++j) {
    all.col(j).tail(3) = c.cross(all.col(j).head<3>());
    if (j < n) all.col(j).tail(3) -= column(base_.com_per_angle(j));
  }
  end.per_position = all.leftCols(n);
  end.per_rate = all.middleCols(n, n);
  end.per_coefficient = all.rightCols(spline_.knots() * n);
}

void PathSegment::forget_nodes() {
  placed_.resize(nodes_.size()), turning_.resize(nodes_.size());
  is_placed_.assign(nodes_.size(), false), has_turning_.assign(nodes_.size(), false);
  path_points_ = nodes();
}

// Node => its link poses, computed on first use.
const PlacedLinks& PathSegment::links_at(int node) const {
  const auto n = static_cast<std::size_t>(node);
  PlacedLinks& links = placed_[n];
  if (is_placed_[n]) return links;
  is_placed_[n] = true;
  const int count = base_.tree().link_count;
  links.resize(count, joints());
  const PlacedNumbers<double> to = links.numbers();
  const auto copy = [&](auto* values, int number_count, int from) {
    double* const numbers = reinterpret_cast<double*>(values);
    for (int i = 0; i < number_count; ++i) numbers[i] = number(node, from + i);
  };
  copy(to.X_BL, 12 * count, layout_.X_BL), copy(to.axis, 6 * count, layout_.axis);
  copy(to.composite, 10 * count, layout_.composite), copy(to.inertia, 10 * count, layout_.inertia);
  copy(to.com, 3, layout_.com), copy(to.mass, 1, layout_.mass);
  if (!base_.floats()) return links;
  copy(to.joint_momentum, 6 * joints(), layout_.joint_momentum), copy(to.k, 3 * joints(), layout_.k);
  copy(to.H_inverse, 6, layout_.H_inverse);
  return links;
}

void PathSegment::solve_with_path_constraints(int min_panels) {
  has_path_constraints_ = true;
  laid_ = 0;  // storage for all nodes
  const int parts = spline_.knots() + 1;
  min_panels_ = (std::max(min_panels, 1) + parts - 1) / parts * parts;
  for (int& panels : panels_) panels = std::max(panels, min_panels_);
}

// Node => state of joints and base there.
PathSegment::SegmentPoint PathSegment::path_point(int index) const {
  if (index < 0 || index >= path_points_) throw std::out_of_range("PathSegment::path_point: no such node");
  const auto i = static_cast<std::size_t>(index), n = start_.position.size();
  const Node& node = nodes_[i];
  const std::size_t knots = static_cast<std::size_t>(spline_.knots());
  SegmentPoint at;
  at.time = node.time, at.weight = weights_[i];
  at.a = node.a, at.b = node.b, at.N = std::span(N_).subspan(i * knots, knots);
  at.of = this, at.node = index;
  at.position.resize(n), at.rate.resize(n), at.acceleration.resize(n);
  for (std::size_t j = 0; j < n; ++j) {
    const double from = start_.position[j], travel = position_[j] - from, first = start_.rate[j];
    at.position[j] = from + travel * node.a.position + rate_[j] * node.b.position + first * node.c.position;
    at.rate[j] = number(index, layout_.rate + static_cast<int>(j));
    at.acceleration[j] = travel * node.a.acceleration + rate_[j] * node.b.acceleration + first * node.c.acceleration;
  }
  for (std::size_t k = 0; k < coefficients_.size(); ++k) {
    at.position[k % n] += coefficients_[k] * at.N[k / n].position;
    at.acceleration[k % n] += coefficients_[k] * at.N[k / n].acceleration;
  }
  at.X_WB = start_.X_WB;
  if (base_.floats()) {
    at.w_B = vector_at(index, layout_.w_B);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) at.X_WB.R(r, c) = number(index, layout_.R + 3 * r + c);
    }
    at.X_WB.p = motion_.com_at(node.time) - at.X_WB.R * vector_at(index, layout_.com);
  }
  return at;
}

template <class F>
void PathSegment::for_each_unknown(int node, F f) const {
  const int n = joints(), knots = spline_.knots();
  const Node& at = nodes_[static_cast<std::size_t>(node)];
  for (int j = 0; j < n; ++j) {
    f(j, at.a, j), f(n + j, at.b, j);
    for (int c = 0; c < knots; ++c) f((2 + c) * n + j, N_[static_cast<std::size_t>(node * knots + c)], j);
  }
}

const Eigen::Matrix3Xd& PathSegment::turning_at(int node) const {
  const auto i = static_cast<std::size_t>(node);
  Eigen::Matrix3Xd& turning = turning_[i];
  if (has_turning_[i]) return turning;
  has_turning_[i] = true;
  turning.resize(3, unknowns());
  for_each_unknown(node, [&](int unknown, const JointPoint& basis, int j) {
    const Vector3d g = vector_at(node, layout_.g_turned + 3 * j), k = vector_at(node, layout_.k_turned + 3 * j);
    turning.col(unknown) = column(basis.position * g + basis.rate * k);
  });
  return turning;
}

Eigen::Matrix3Xd PathSegment::turn_per_unknown(int index) const {
  if (!base_.floats()) return Eigen::Matrix3Xd::Zero(3, unknowns());
  const int panel = index / kStages;
  const double h = (start_.end - start_.begin) / laid_;
  Eigen::Matrix3Xd sum = turned_[static_cast<std::size_t>(panel)];
  for (int i = 0; i < kStages; ++i) sum += h * method().a(index % kStages, i) * turning_at(panel * kStages + i);
  Eigen::Matrix3d Phi;
  for (int i = 0; i < 9; ++i) Phi.data()[i] = number(index, layout_.Phi + i);
  return Phi * sum;
}

// Node => derivatives of the base's angular velocity with respect to all unknowns, by differentiating (1).
Eigen::Matrix3Xd PathSegment::w_per_unknown(int index) {
  Eigen::Matrix3Xd D = Eigen::Matrix3Xd::Zero(3, unknowns());
  if (!base_.floats()) return D;
  // (1): H dw = -g dtheta - k dtheta' + d(R^T L), and R^T L changes by (R^T L) x (R^T eta).
  for_each_unknown(index, [&](int unknown, const JointPoint& basis, int j) {
    const Vector3d g = vector_at(index, layout_.g + 3 * j), k = vector_at(index, layout_.k + 3 * j);
    D.col(unknown) = -column(basis.position * g + basis.rate * k);
  });
  if (driven()) {
    Rotationd R;
    for (int i = 0; i < 9; ++i) R.m[i / 3][i % 3] = number(index, layout_.R + i);
    D += cross_matrix(transposed_times(R, motion_.h.angular)) * as_matrix(R).transpose() * turn_per_unknown(index);
  }
  double H[6];
  for (int i = 0; i < 6; ++i) H[i] = number(index, layout_.H_inverse + i);
  return (Eigen::Matrix3d() << H[0], H[3], H[4], H[3], H[1], H[5], H[4], H[5], H[2]).finished() * D;
}

// Final values, rates and coefficients => final base pose (1) and its sensitivities (3); refines the panels until the
// nodes resolve the rotation.
SegmentEnd PathSegment::integrate(std::span<const double> position, std::span<const double> rate, bool sensitivities,
                                  SegmentAccuracy accuracy, std::span<const double> coefficients) {
  const int n = base_.joints();
  SegmentEnd end;
  path_points_ = 0;
  if (has_path_constraints_) {
    position_.assign(position.begin(), position.end()), rate_.assign(rate.begin(), rate.end());
    coefficients_.assign(coefficients.begin(), coefficients.end());
  }
  if (!base_.floats()) {
    end.finished = true;
    end.X_WB = start_.X_WB;
    end.per_position = end.per_rate = Matrix6Xd::Zero(6, n);
    end.per_coefficient = Matrix6Xd::Zero(6, spline_.knots() * n);
    if (has_path_constraints_) {
      lay_panels(min_panels_);
      NodePanel panel = panel_of(position, rate, coefficients);
      for (panel.first = 0; panel.first < nodes(); panel.first += kStages) {
        panel.storage_index = panel.first;
        lanes_->place(panel);
      }
      base_.count(nodes()), evaluations_ += nodes();
      forget_nodes();
    }
    base_.place(position);
    return end;
  }
  const double tolerance = kUnresolved[static_cast<int>(accuracy)];
  // If nodes are stored, both accuracies use the same number of panels, which never decreases.
  int& panels = panels_[has_path_constraints_ ? 0 : static_cast<int>(accuracy)];
  Quaterniond q;
  for (;; panels *= 2) {
    lay_panels(panels);
    NodePanel panel = panel_of(position, rate, coefficients);
    q = quaternion_from(start_.X_WB.R);
    const double unresolved = turn(panel, tolerance, sensitivities, q);
    if (unresolved <= tolerance) {
      // Whether panels of twice the length, with a resolution lower by 2^stages, would have been sufficient.
      for (double longer = unresolved; !has_path_constraints_ && panels > min_panels_; panels /= 2) {
        longer = std::ldexp(longer, kStages + 1);
        if (longer > tolerance) break;
      }
      break;
    }
    if (std::isnan(unresolved) || 2 * nodes_.size() > kMaxNodes[static_cast<int>(accuracy)]) {
      end.failure = fmt::format("the base's rotation is not resolved by {} nodes on a segment of {:.6g} s",
                                nodes_.size(), start_.end - start_.begin);
      panels = min_panels_;
      return end;
    }
  }
  if (has_path_constraints_) forget_nodes();
  base_.place(position);
  ++evaluations_;
  end.finished = true;
  end.X_WB.R = rotation_matrix(q);
  end.X_WB.p = motion_.com_at(start_.end) - end.X_WB.R * base_.com();
  if (sensitivities) add_sensitivities(q, end);
  return end;
}

}  // namespace grapnel
