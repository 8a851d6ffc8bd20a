#include "grapnel/compare/measured_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "grapnel/compare/local_fit.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

using Kind = MeasuredQuantity::Kind;

constexpr int kRateDegree = 2, kPlaceDegree = 3;
constexpr double kCurvatureWeight = 3;     // of the curvature against the noise in the choice of a window
constexpr std::size_t kMostFitted = 1000;  // samples per side
constexpr double kSpike = 6;               // standard uncertainties
constexpr double kMostSpikes = 0.02;       // share of the samples

std::size_t axis_index(const std::string& component) {
  return component == "x" ? 0 : component == "y" ? 1 : component == "z" ? 2 : 3;
}

Rotationd rotation_of(const Vector3d& v) {
  const double angle = norm(v);
  return angle > 0 ? rotation_about((1 / angle) * v, angle) : Rotationd::identity();
}

Quaterniond unit(const double* x) {
  const double n = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
  return {x[0] / n, x[1] / n, x[2] / n, x[3] / n};
}

// The rotation vector from a reference, in the body's axes.
Vector3d turned_from(const Quaterniond& reference, const double* x) {
  return rotation_vector(rotation_matrix(conjugate(reference) * unit(x)));
}

}  // namespace

MeasuredQuantities measured_quantities(std::span<const ComparedQuantity> quantities, const RunModel& run) {
  MeasuredQuantities result;
  for (const ComparedQuantity& q : quantities) {
    const auto leave_out = [&](const std::string& why) {
      result.unused.push_back(printable_line(q.name) + ": " + why);
    };
    MeasuredQuantity one;
    one.quantity = &q;
    const std::size_t slash = q.series.rfind('/');
    const std::string owner = slash == std::string::npos ? "" : q.series.substr(0, slash);
    const std::string what = slash == std::string::npos ? q.series : q.series.substr(slash + 1);
    const auto place = run.find_frame(owner);
    if (!q.frame.empty()) {
      one.frame = run.find_frame(q.frame);
      if (!one.frame) {
        leave_out("the model has no body " + in_quotes(q.frame));
        continue;
      }
    }
    bool known = true;
    if (place && (what == "angular_velocity" || what == "velocity")) {
      one.kind = Kind::twist, one.is_angular = what == "angular_velocity", one.place = *place;
    } else if (place && what == "position" && !one.frame) {
      one.kind = Kind::position, one.place = *place;
    } else if (place && q.is_orientation && !one.frame) {
      one.kind = Kind::orientation, one.place = *place;
    } else if (q.series == "joints/velocity" || q.series == "wheels/rate") {
      one.kind = Kind::joint_rate;
    } else if (q.series == "joints/position") {
      one.kind = Kind::joint_position;
    } else if (q.series == "joints/effort") {
      one.kind = Kind::effort;
    } else if (q.series.starts_with("grasps/") && (what == "force" || what == "moment")) {
      one.kind = Kind::grasp_force, one.is_angular = what == "moment", one.end_effector = owner.substr(7);
    } else {
      known = false;
    }
    if (!known) {
      leave_out(
          "not used, since impulses and momentum follow from rates, positions, orientations, efforts and grasp "
          "forces in W or along a body's axes");
      continue;
    }
    if (!q.uncertainty) {
      leave_out("not used without an uncertainty; state 'uncertainty' in the mapping");
      continue;
    }
    const bool of_joints = one.kind == Kind::joint_rate || one.kind == Kind::joint_position || one.kind == Kind::effort;
    for (const std::string& component : q.components) {
      if (of_joints) {
        const auto body = run.find_joint(q.series, component);
        if (body) one.joints.push_back(*body);
      } else {
        one.parts.push_back(axis_index(component));
      }
    }
    if (of_joints ? one.joints.size() != q.components.size()
                  : std::find(one.parts.begin(), one.parts.end(), 3u) != one.parts.end()) {
      leave_out("its components are unknown to the model");
      continue;
    }
    result.used.push_back(std::move(one));
  }
  return result;
}

Rotationd log_axes(const MeasuredQuantity& one, const Kinematics& kinematics) {
  const Rotationd axes = rotation_matrix(one.quantity->axes);
  if (!one.frame) return axes;
  return kinematics.X_WB[static_cast<std::size_t>(one.frame->body)].R * one.frame->X_BF.R * axes;
}

Eigen::MatrixXd rate_rows(const MeasuredQuantity& one, const Model& model, const Kinematics& kinematics) {
  const Eigen::Index nv = model.velocities();
  if (one.kind == Kind::joint_rate || one.kind == Kind::joint_position || one.kind == Kind::effort) {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(one.joints.size()), nv);
    for (std::size_t k = 0; k < one.joints.size(); ++k)
      rows(static_cast<Eigen::Index>(k), model.bodies()[static_cast<std::size_t>(one.joints[k])].v) = 1;
    return rows;
  }
  const Posed& X_WB = kinematics.X_WB[static_cast<std::size_t>(one.place.body)];
  Eigen::MatrixXd J(6, nv);
  point_jacobian(model, kinematics, one.place.body, X_WB * one.place.X_BF.p, J);
  const bool angular = one.kind == Kind::orientation || (one.kind == Kind::twist && one.is_angular);
  const Rotationd R_WL = one.kind == Kind::orientation ? X_WB.R * one.place.X_BF.R : log_axes(one, kinematics);
  Eigen::Matrix3d R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = R_WL(i, j);
  }
  const Eigen::MatrixXd turned = R.transpose() * (angular ? J.topRows(3) : J.bottomRows(3));
  if (one.kind == Kind::orientation) return turned;
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(one.parts.size()), nv);
  for (std::size_t k = 0; k < one.parts.size(); ++k)
    rows.row(static_cast<Eigen::Index>(k)) = turned.row(static_cast<Eigen::Index>(one.parts[k]));
  return rows;
}

namespace {

// Samples around a contact, in order, and the run's values at the same times around its contact.
struct FitSamples {
  SideTimes times;
  Eigen::MatrixXd measured, simulated;  // samples x components
};

class ChangeFit {
 public:
  ChangeFit(const MeasuredQuantity& one, double offset, const ContactTime& contact, const ContactTime& run_contact)
      : one_(one), q_(*one.quantity), offset_(offset), contact_(contact), run_(run_contact) {
    if (one.kind != Kind::orientation) return;
    std::size_t nearest = q_.samples();
    for (std::size_t i = 0; i < q_.samples(); ++i) {
      if (!is_complete(i)) continue;
      const auto distance = [&](std::size_t k) { return std::abs(q_.time[k] + offset_ - contact_.begin); };
      if (nearest == q_.samples() || distance(i) < distance(nearest)) nearest = i;
    }
    if (nearest < q_.samples()) reference_ = unit(q_.measured.data() + 4 * nearest);
    std::array<double, 4> x{};
    q_.curve.value(run_.begin, x);
    run_reference_ = unit(x.data());
  }

  const Quaterniond& reference() const { return reference_; }

  // Usable samples: their indices on both sides, the nearest to the contact first.
  void find(const FitRange& range) {
    const double guard = std::max(3 * contact_.deviation, 1e-9);
    for (std::size_t i = 0; i < q_.samples(); ++i) {
      const double t = q_.time[i] + offset_;
      if (!is_complete(i) || t < range.from || t > range.to) continue;
      if (t <= contact_.begin - guard) before_.push_back(i);
      if (t - q_.average >= contact_.end + guard) after_.push_back(i);
    }
    std::reverse(before_.begin(), before_.end());
  }
  double longest() const {
    double longest = 0;
    if (!before_.empty()) longest = std::max(longest, contact_.begin - time(before_[last(before_)]));
    if (!after_.empty()) longest = std::max(longest, time(after_[last(after_)]) - contact_.end);
    return longest;
  }
  // The window that contains so many samples on both sides.
  std::optional<double> window_of(std::size_t samples) const {
    if (before_.size() < samples || after_.size() < samples) return std::nullopt;
    const double b = contact_.begin - time(before_[samples - 1]), a = time(after_[samples - 1]) - contact_.end;
    return std::max(a, b) * (1 + 1e-12);
  }

  FitSamples samples(double window, const std::vector<bool>& left_out) const {
    FitSamples s;
    std::vector<std::size_t> chosen;
    for (const std::vector<std::size_t>* side : {&before_, &after_}) {
      for (std::size_t k = 0; k < std::min(side->size(), kMostFitted); ++k) {
        const std::size_t i = (*side)[k];
        const double s_k = side == &before_ ? time(i) - contact_.begin : time(i) - contact_.end;
        if (std::abs(s_k) > window) break;
        if (!left_out.empty() && left_out[i]) continue;
        (side == &before_ ? s.times.before : s.times.after).push_back(s_k);
        chosen.push_back(i);
      }
    }
    const Eigen::Index count = static_cast<Eigen::Index>(chosen.size()),
                       width = static_cast<Eigen::Index>(one_.width());
    s.measured.resize(count, width), s.simulated.resize(count, width);
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::size_t at = static_cast<std::size_t>(k);
      const bool is_before = at < s.times.before.size();
      const double run_time = is_before
                                  ? std::min(run_.begin + s.times.before[at], std::nextafter(run_.begin, -HUGE_VAL))
                                  : run_.end + s.times.after[at - s.times.before.size()];
      s.measured.row(k) = measured(chosen[at]);
      s.simulated.row(k) = simulated(run_time);
    }
    indices_ = std::move(chosen);
    return s;
  }
  const std::vector<std::size_t>& indices() const { return indices_; }

 private:
  static std::size_t last(const std::vector<std::size_t>& side) { return std::min(side.size(), kMostFitted) - 1; }
  double time(std::size_t i) const { return q_.time[i] + offset_; }
  bool is_complete(std::size_t i) const {
    const std::size_t width = q_.curve.width();
    return std::all_of(q_.measured.begin() + static_cast<std::ptrdiff_t>(i * width),
                       q_.measured.begin() + static_cast<std::ptrdiff_t>((i + 1) * width),
                       [](double x) { return std::isfinite(x); });
  }
  Eigen::RowVectorXd measured(std::size_t i) const {
    const double* x = q_.measured.data() + i * q_.curve.width();
    if (one_.kind != Kind::orientation)
      return Eigen::Map<const Eigen::RowVectorXd>(x, static_cast<Eigen::Index>(one_.width()));
    return as_row(turned_from(reference_, x));
  }
  Eigen::RowVectorXd simulated(double t) const {
    std::array<double, kMostComponents> x{};
    q_.curve.value(t, {x.data(), q_.curve.width()});
    if (one_.kind != Kind::orientation)
      return Eigen::Map<const Eigen::RowVectorXd>(x.data(), static_cast<Eigen::Index>(one_.width()));
    return as_row(turned_from(run_reference_, x.data()));
  }
  static Eigen::RowVectorXd as_row(const Vector3d& v) { return Eigen::RowVector3d(v[0], v[1], v[2]); }

  const MeasuredQuantity& one_;
  const ComparedQuantity& q_;
  double offset_;
  ContactTime contact_, run_;
  std::vector<std::size_t> before_, after_;
  mutable std::vector<std::size_t> indices_;  // of the last samples()
  Quaterniond reference_ = Quaterniond::identity(), run_reference_ = Quaterniond::identity();
};

// The weights of one fit whose results matter.
struct FitWeights {
  Eigen::VectorXd before, after, place;
};

FitWeights weights_of(const StepFit& fit, bool is_place) {
  if (!is_place) return {fit.value_before(), fit.value_after(), {}};
  return {fit.slope_before(), fit.slope_after(), 0.5 * (fit.value_before() + fit.value_after())};
}

}  // namespace

std::optional<MeasuredChange> measure_change(const MeasuredQuantity& one, double offset, const ContactTime& contact,
                                             const ContactTime& run_contact, const Eigen::VectorXd& run_change,
                                             const FitRange& range) {
  const bool is_place = one.measures_places();
  const int degree = is_place ? kPlaceDegree : kRateDegree;
  const bool continuous = is_place && contact.begin == contact.end;
  const double sigma = *one.quantity->uncertainty, average = one.quantity->average;
  ChangeFit data(one, offset, contact, run_contact);
  data.find(range);
  const auto fit_of = [&](const FitSamples& s) { return StepFit(s.times, degree, continuous, average); };

  // The window, from short to long: the curvature of a shorter one is a lower bound, since it may vanish by chance.
  double best = std::numeric_limits<double>::infinity(), chosen = 0;
  Eigen::VectorXd curvature = Eigen::VectorXd::Zero(run_change.size()), chosen_curvature = curvature;
  std::size_t count = static_cast<std::size_t>(degree) + 3;
  const double longest = data.longest();
  std::optional<double> window = range.window ? range.window : data.window_of(count);
  while (window) {
    const FitSamples s = data.samples(*window, {});
    if (!StepFit::can_fit(s.times, degree)) break;
    const StepFit fit = fit_of(s);
    const FitWeights w = weights_of(fit, is_place);
    const Eigen::VectorXd found = s.simulated.transpose() * (w.after - w.before);
    if (found.allFinite()) curvature = curvature.cwiseMax((found - run_change).cwiseAbs());
    const double noise = sigma * (w.after - w.before).norm();
    const double total = std::hypot(noise, kCurvatureWeight * curvature.maxCoeff());
    if (total < best) best = total, chosen = *window, chosen_curvature = curvature;
    if (range.window || *window >= longest) break;
    count = count + 1 + count / 4;
    const auto next = data.window_of(count);
    window = next ? *next : std::min(longest, *window * 1.25) * (1 + 1e-12);
    if (*window <= chosen && total > 4 * best) break;
    if (total > 10 * best) break;
  }
  if (!std::isfinite(best)) return std::nullopt;

  FitSamples s = data.samples(chosen, {});
  StepFit fit = fit_of(s);
  // Spikes, if they are few.
  std::vector<bool> left_out(one.quantity->samples(), false);
  std::size_t spikes = 0;
  for (Eigen::Index k = 0; k < s.measured.rows(); ++k) {
    bool is_spike = false;
    for (Eigen::Index c = 0; c < s.measured.cols(); ++c)
      is_spike = is_spike || std::abs(fit.residual(s.measured.col(c))[k]) > kSpike * sigma;
    if (is_spike) left_out[data.indices()[static_cast<std::size_t>(k)]] = true, ++spikes;
  }
  MeasuredChange result;
  if (spikes > 0 &&
      static_cast<double>(spikes) <= std::max(1.0, kMostSpikes * static_cast<double>(s.measured.rows()))) {
    FitSamples without = data.samples(chosen, left_out);
    if (StepFit::can_fit(without.times, degree)) {
      s = std::move(without), fit = fit_of(s), result.outliers = spikes;
    }
  }
  const FitWeights w = weights_of(fit, is_place);
  result.before = s.measured.transpose() * w.before, result.after = s.measured.transpose() * w.after;
  result.change = result.after - result.before;
  const double noise = sigma * (w.after - w.before).norm();
  result.curvature = chosen_curvature;
  result.deviation = (chosen_curvature.array().square() + noise * noise).sqrt();
  result.per_delay = Eigen::VectorXd::Zero(result.change.size());
  if (is_place) {
    result.place = s.measured.transpose() * w.place;
    const double bias = one.quantity->bias_uncertainty.value_or(0);
    result.place_deviation = Eigen::VectorXd::Constant(result.place.size(), std::hypot(sigma * w.place.norm(), bias));
    result.reference = data.reference();
    // A later kink lowers all samples after it by the change of slope times the delay.
    const Eigen::Index after = static_cast<Eigen::Index>(s.times.after.size());
    if (continuous) result.per_delay = -(w.after - w.before).tail(after).sum() * result.change;
  } else {
    result.per_delay = s.measured.transpose() * (fit.slope_before() - fit.slope_after());
  }
  result.window = chosen, result.samples = static_cast<std::size_t>(s.measured.rows());
  result.freedom = (static_cast<int>(s.measured.rows()) - fit.coefficients()) * static_cast<int>(s.measured.cols());
  for (Eigen::Index c = 0; c < s.measured.cols(); ++c)
    result.chi_square += fit.residual(s.measured.col(c)).squaredNorm() / (sigma * sigma * result.freedom);
  return result;
}

void MeasuredConfiguration::set(const MeasuredQuantity& one, const Eigen::VectorXd& place,
                                const Eigen::VectorXd& deviation, const Quaterniond& reference) {
  const Model& model = run_.model();
  if (one.kind == Kind::joint_position) {
    for (std::size_t k = 0; k < one.joints.size(); ++k) {
      const Body& body = model.bodies()[static_cast<std::size_t>(one.joints[k])];
      state_.q[static_cast<std::size_t>(body.q)] = place[static_cast<Eigen::Index>(k)];
      if (std::find(joints_.begin(), joints_.end(), one.joints[k]) == joints_.end()) {
        joints_.push_back(one.joints[k]);
        parameters_.push_back(
            {Parameter::Kind::joint, one.joints[k], Vector3d::zero(), deviation[static_cast<Eigen::Index>(k)]});
      }
    }
    return;
  }
  const int body = one.place.body;
  if (!model.has_free_root(body) || model.bodies()[static_cast<std::size_t>(body)].parent >= 0) return;
  const Posed X_BF = one.place.X_BF;
  const Posed X_WB = root_pose(model, state_, body);
  Posed X_WF = X_WB * X_BF;
  const Rotationd axes = rotation_matrix(one.quantity->axes);
  if (one.kind == Kind::orientation) {
    if (std::find(turned_.begin(), turned_.end(), body) != turned_.end()) return;
    turned_.push_back(body);
    X_WF.R = axes * rotation_matrix(reference) * rotation_of({place[0], place[1], place[2]});
    const Rotationd R_WB = X_WF.R * transpose(X_BF.R);
    const Vector3d p_BP = pivot_of(body);
    X_WF.p = X_WB.p + X_WB.R * p_BP + R_WB * (X_BF.p - p_BP);
    for (int k = 0; k < 3; ++k)
      parameters_.push_back({Parameter::Kind::rotation, body, X_BF.R.column(k), deviation[k]});
  } else if (one.kind == Kind::position) {
    Vector3d p_L = transposed_times(axes, X_WF.p - one.quantity->origin);
    for (std::size_t k = 0; k < one.parts.size(); ++k) {
      p_L[static_cast<int>(one.parts[k])] = place[static_cast<Eigen::Index>(k)];
      parameters_.push_back({Parameter::Kind::position, body, axes.column(static_cast<int>(one.parts[k])),
                             deviation[static_cast<Eigen::Index>(k)]});
    }
    if (one.parts.size() == 3) placed_.push_back(body);
    std::erase_if(pivots_, [&](const Placed& other) { return other.body == body; });
    pivots_.push_back({body, X_BF.p});
    X_WF.p = one.quantity->origin + axes * p_L;
  } else {
    return;
  }
  set_root_pose(model, body, X_WF * inverse(X_BF), state_);
}

Vector3d MeasuredConfiguration::pivot_of(int body) const {
  const auto found = std::find_if(pivots_.begin(), pivots_.end(), [&](const Placed& one) { return one.body == body; });
  return found == pivots_.end() ? Vector3d::zero() : found->p_BF;
}

void MeasuredConfiguration::attach(std::span<const RunContact::Grasp> grasps) {
  const Kinematics simulated = forward_kinematics(run_.model(), state_);
  for (const RunContact::Grasp& grasp : grasps) {
    const auto target = run_.find_frame("targets/" + grasp.target);
    const auto end_effector = run_.find_frame("end_effectors/" + grasp.end_effector);
    if (!target || !end_effector) continue;
    const bool is_known =
        std::any_of(attached_.begin(), attached_.end(), [&](const Attached& a) { return a.target == target->body; });
    if (is_known) continue;
    const Posed X_WE = simulated.X_WB[static_cast<std::size_t>(end_effector->body)] * end_effector->X_BF;
    attached_.push_back(
        {target->body, *end_effector, inverse(X_WE) * simulated.X_WB[static_cast<std::size_t>(target->body)]});
  }
}

State MeasuredConfiguration::at(std::span<const double> changes) const {
  const Model& model = run_.model();
  State state = state_;
  std::vector<Vector3d> turns(model.bodies().size(), Vector3d::zero()), moves = turns;
  for (std::size_t k = 0; k < parameters_.size() && k < changes.size(); ++k) {
    const Parameter& p = parameters_[k];
    const double size = changes[k] * p.deviation;
    const std::size_t body = static_cast<std::size_t>(p.body);
    if (p.kind == Parameter::Kind::joint) state.q[static_cast<std::size_t>(model.bodies()[body].q)] += size;
    if (p.kind == Parameter::Kind::rotation) turns[body] = turns[body] + size * p.axis;
    if (p.kind == Parameter::Kind::position) moves[body] = moves[body] + size * p.axis;
  }
  for (std::size_t b = 0; b < turns.size(); ++b) {
    if (norm(turns[b]) + norm(moves[b]) == 0) continue;
    Posed X_WB = root_pose(model, state, static_cast<int>(b));
    const Rotationd R = X_WB.R * rotation_of(turns[b]);
    const Vector3d p_BP = pivot_of(static_cast<int>(b));
    X_WB.p = X_WB.p + X_WB.R * p_BP - R * p_BP + moves[b], X_WB.R = R;
    set_root_pose(model, static_cast<int>(b), X_WB, state);
  }
  const auto has = [](const std::vector<int>& list, int body) {
    return std::find(list.begin(), list.end(), body) != list.end();
  };
  for (const Attached& one : attached_) {
    const bool is_placed = has(placed_, one.target), is_turned = has(turned_, one.target);
    if (is_placed && is_turned) continue;
    const Kinematics kinematics = forward_kinematics(model, state);
    const Posed X_WT =
        kinematics.X_WB[static_cast<std::size_t>(one.end_effector.body)] * one.end_effector.X_BF * one.X_ET;
    Posed placed = root_pose(model, state, one.target);
    if (!is_placed) placed.p = X_WT.p;
    if (!is_turned) placed.R = X_WT.R;
    set_root_pose(model, one.target, placed, state);
  }
  return state;
}

std::vector<std::string> MeasuredConfiguration::unmeasured() const {
  const Model& model = run_.model();
  const auto has = [](const std::vector<int>& list, int body) {
    return std::find(list.begin(), list.end(), body) != list.end();
  };
  std::vector<std::string> names;
  if (model.has_free_root(run_.system().base)) {
    if (!has(turned_, run_.system().base)) names.push_back("attitude of the base");
    if (!has(placed_, run_.system().base)) names.push_back("position of the base");
  }
  for (const int j : run_.system().robot_joints) {
    const int body = model.joints()[static_cast<std::size_t>(j)];
    if (!has(joints_, body))
      names.push_back("joint " + model.bodies()[static_cast<std::size_t>(body)].description.joint.name);
  }
  for (const TargetSetup& target : run_.problem().targets) {
    const auto frame = run_.find_frame("targets/" + target.name);
    if (!has(turned_, frame->body)) names.push_back("attitude of " + target.name);
    if (!has(placed_, frame->body)) names.push_back("position of " + target.name);
  }
  return names;
}

}  // namespace grapnel
