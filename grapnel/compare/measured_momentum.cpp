#include "grapnel/compare/measured_momentum.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/compare/impulse_estimate.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/result/text_table.hpp"

namespace grapnel {

const std::array<const char*, kMomentumComponents> kMomentumNames = {
    "linear x",  "linear y",       "linear z",       "angular x",      "angular y",
    "angular z", "about origin x", "about origin y", "about origin z", "kinetic energy"};
const std::array<const char*, kMomentumComponents> kMomentumUnits = {"N s",   "N s",   "N s",   "N m s", "N m s",
                                                                     "N m s", "N m s", "N m s", "N m s", "J"};

namespace {

constexpr double kUndetermined = std::numeric_limits<double>::quiet_NaN();
constexpr double kLongestGap = 3;  // median intervals

// A quantity between its samples.
class Interpolated {
 public:
  Interpolated(const MeasuredQuantity& one, double offset, std::span<const ContactTime> contacts)
      : one_(&one), offset_(offset), contacts_(contacts) {
    std::vector<double> intervals;
    const std::vector<double>& t = one.quantity->time;
    for (std::size_t i = 1; i < t.size(); ++i) intervals.push_back(t[i] - t[i - 1]);
    gap_ = kLongestGap * median_of(std::move(intervals));
  }

  const MeasuredQuantity& of() const { return *one_; }
  // False: there is no value. Orientations: the quaternion of the nearer sample.
  bool value(double time, Eigen::VectorXd& out) const {
    const ComparedQuantity& q = *one_->quantity;
    const double t = time - offset_ + 0.5 * q.average;
    const auto after = std::lower_bound(q.time.begin(), q.time.end(), t);
    if (after == q.time.end()) return false;
    const std::size_t j = static_cast<std::size_t>(after - q.time.begin()), i = j > 0 && q.time[j] > t ? j - 1 : j;
    if (q.time[i] > t || q.time[j] - q.time[i] > gap_ || crosses(q.time[i] - q.average, q.time[j])) return false;
    const std::size_t width = q.curve.width();
    double share = j > i && q.time[j] > q.time[i] ? (t - q.time[i]) / (q.time[j] - q.time[i]) : 0;
    if (q.is_orientation) share = share < 0.5 ? 0 : 1;
    out.resize(static_cast<Eigen::Index>(width));
    for (std::size_t c = 0; c < width; ++c) {
      const double a = q.measured[i * width + c], b = q.measured[j * width + c];
      out[static_cast<Eigen::Index>(c)] = share == 0 ? a : share == 1 ? b : a + share * (b - a);
    }
    return out.allFinite();
  }

 private:
  bool crosses(double from, double to) const {
    return std::any_of(contacts_.begin(), contacts_.end(), [&](const ContactTime& c) {
      return from + offset_ < c.end + 3 * c.deviation && to + offset_ > c.begin - 3 * c.deviation;
    });
  }
  const MeasuredQuantity* one_;
  double offset_, gap_ = 0;
  std::span<const ContactTime> contacts_;
};

// Momentum and energy of one tree: linear in the velocities, and half a square.
struct TreeMomentum {
  Eigen::MatrixXd linear;  // 9 x velocities: linear, about the centre of mass, about the origin
  Eigen::MatrixXd M;       // of the tree alone
};

// The first six rows of M for the tree's free root are its momentum about the root's origin, in its axes.
TreeMomentum tree_momentum(const Model& model, const Kinematics& kinematics, const Eigen::MatrixXd& M, int root) {
  const Eigen::Index nv = model.velocities();
  Eigen::VectorXd own = Eigen::VectorXd::Zero(nv);
  for (const Body& body : model.bodies()) {
    if (body.root == root) own.segment(body.v, velocity_count(body.description.joint.type)).setOnes();
  }
  TreeMomentum result;
  result.M = own.asDiagonal() * M * own.asDiagonal();
  const Posed& X_WB = kinematics.X_WB[static_cast<std::size_t>(root)];
  const std::array<int, 1> roots{root};
  const Vector3d com = center_of_mass(model, kinematics, roots);
  Eigen::Matrix3d R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = X_WB.R(i, j);
  }
  const Eigen::Index v = model.bodies()[static_cast<std::size_t>(root)].v;
  const Eigen::MatrixXd angular = R * result.M.middleRows(v, 3), linear = R * result.M.middleRows(v + 3, 3);
  const auto moment = [&](const Vector3d& p) {  // [p x] linear
    Eigen::Matrix3d cross;
    cross << 0, -p[2], p[1], p[2], 0, -p[0], -p[1], p[0], 0;
    return Eigen::MatrixXd(cross * linear);
  };
  result.linear.resize(9, nv);
  result.linear << linear, angular - moment(com - X_WB.p), angular + moment(X_WB.p);
  return result;
}

// Linear combinations of the estimated velocities, and the energy.
struct MomentumValue {
  std::array<double, kMomentumComponents> value{}, deviation{};
};

class MomentumOfLog {
 public:
  MomentumOfLog(const RunModel& run, const MeasuredQuantities& measured, double offset,
                std::span<const ContactTime> contacts)
      : run_(run) {
    for (const MeasuredQuantity& one : measured.used) {
      if (one.measures_rates()) rates_.emplace_back(one, offset, contacts);
      if (one.measures_places()) places_.emplace_back(one, offset, contacts);
    }
  }

  // Empty: a rate or place has no value at that time.
  std::optional<std::vector<MomentumValue>> at(double time, std::span<const int> roots) const {
    MeasuredConfiguration configuration(run_, run_.state_at(time));
    Eigen::VectorXd x;
    for (const Interpolated& one : places_) {
      if (!one.value(time, x)) return std::nullopt;
      const ComparedQuantity& q = *one.of().quantity;
      const double deviation = std::hypot(*q.uncertainty, q.bias_uncertainty.value_or(0));
      if (q.is_orientation) {
        const double n = x.norm();
        configuration.set(one.of(), Eigen::VectorXd::Zero(3), Eigen::VectorXd::Constant(3, deviation),
                          {x[0] / n, x[1] / n, x[2] / n, x[3] / n});
      } else {
        configuration.set(one.of(), x, Eigen::VectorXd::Constant(x.size(), deviation), Quaterniond::identity());
      }
    }
    std::vector<double> changes(configuration.parameters(), 0.0);
    auto values = evaluate(configuration.at(changes), time, roots);
    if (!values) return std::nullopt;
    std::vector<std::array<double, kMomentumComponents>> variance(roots.size());
    for (std::size_t r = 0; r < roots.size(); ++r) {
      for (std::size_t c = 0; c < kMomentumComponents; ++c)
        variance[r][c] = (*values)[r].deviation[c] * (*values)[r].deviation[c];
    }
    for (std::size_t k = 0; k < changes.size(); ++k) {
      changes[k] = 1;
      const auto other = evaluate(configuration.at(changes), time, roots);
      changes[k] = 0;
      for (std::size_t r = 0; r < roots.size(); ++r) {
        for (std::size_t c = 0; c < kMomentumComponents; ++c) {
          const double error = (*other)[r].value[c] - (*values)[r].value[c];
          variance[r][c] += error * error;
        }
      }
    }
    for (std::size_t r = 0; r < roots.size(); ++r) {
      for (std::size_t c = 0; c < kMomentumComponents; ++c) (*values)[r].deviation[c] = std::sqrt(variance[r][c]);
    }
    return values;
  }

 private:
  std::optional<std::vector<MomentumValue>> evaluate(const State& state, double time,
                                                     std::span<const int> roots) const {
    const Model& model = run_.model();
    const Kinematics kinematics = forward_kinematics(model, state);
    const Eigen::MatrixXd M = mass_matrix(model, state);
    const Eigen::Index nv = model.velocities();
    WeightedRows rows;
    std::vector<Eigen::MatrixXd> A;
    std::vector<Eigen::VectorXd> b;
    std::vector<double> variances;
    Eigen::Index count = 0;
    for (const Interpolated& one : rates_) {
      Eigen::VectorXd y;
      if (!one.value(time, y)) return std::nullopt;
      A.push_back(rate_rows(one.of(), model, kinematics)), b.push_back(y);
      const ComparedQuantity& q = *one.of().quantity;
      const double v = *q.uncertainty * *q.uncertainty + std::pow(q.bias_uncertainty.value_or(0), 2);
      variances.insert(variances.end(), static_cast<std::size_t>(y.size()), v);
      count += y.size();
    }
    rows.A.resize(count, nv), rows.b.resize(count);
    rows.covariance = Eigen::MatrixXd::Zero(count, count);
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < A.size(); ++i) {
      rows.A.middleRows(row, A[i].rows()) = A[i], rows.b.segment(row, A[i].rows()) = b[i];
      row += A[i].rows();
    }
    for (Eigen::Index i = 0; i < count; ++i) rows.covariance(i, i) = variances[static_cast<std::size_t>(i)];
    rows.scale = M.diagonal().cwiseSqrt().cwiseInverse();
    const WeightedSolution v = solve_weighted(rows);
    std::vector<MomentumValue> values;
    for (const int root : roots) {
      const TreeMomentum tree = tree_momentum(model, kinematics, M, root);
      MomentumValue one;
      for (Eigen::Index c = 0; c < 9; ++c) {
        const Eigen::VectorXd combination = tree.linear.row(c).transpose();
        const Combination found = combine(v, rows.scale, combination);
        one.value[static_cast<std::size_t>(c)] = found.determined ? found.value : kUndetermined;
        one.deviation[static_cast<std::size_t>(c)] = found.determined ? found.deviation : kUndetermined;
      }
      // Noise alone has the expected energy tr(M C)/2.
      const Eigen::VectorXd momentum = tree.M * v.value;
      const Eigen::MatrixXd unknown = tree.M * (rows.scale.asDiagonal() * v.null_space);
      const bool known = unknown.norm() <= kDeterminedTolerance * (tree.M * rows.scale.asDiagonal()).norm();
      const Eigen::MatrixXd MC = tree.M * v.covariance;
      one.value[9] = known ? 0.5 * momentum.dot(v.value) - 0.5 * MC.trace() : kUndetermined;
      const double variance = momentum.dot(v.covariance * momentum) + 0.5 * (MC * MC).trace();
      one.deviation[9] = known ? std::sqrt(std::max(variance, 0.0)) : kUndetermined;
      values.push_back(one);
    }
    return values;
  }

  const RunModel& run_;
  std::vector<Interpolated> rates_, places_;
};

// The times of the rate with most samples, thinned.
std::vector<double> times_of(const MeasuredQuantities& measured, double offset, std::size_t most) {
  const ComparedQuantity* longest = nullptr;
  for (const MeasuredQuantity& one : measured.used) {
    if (one.measures_rates() && (!longest || one.quantity->samples() > longest->samples())) longest = one.quantity;
  }
  std::vector<double> times;
  if (!longest) return times;
  const std::size_t every = (longest->samples() + most - 1) / most;
  for (std::size_t i = 0; i < longest->samples(); i += every)
    times.push_back(longest->time[i] + offset - 0.5 * longest->average);
  return times;
}

// Of the series of a curve's body. A robot on a fixed base has no curve.
std::string path_of(const std::string& body) { return body == "robot" ? "base" : "targets/" + body; }

std::vector<std::string> missing_of(const RunModel& run, const MeasuredQuantities& measured, const std::string& body) {
  const auto has = [&](MeasuredQuantity::Kind kind, bool angular, int place) {
    return std::any_of(measured.used.begin(), measured.used.end(), [&](const MeasuredQuantity& one) {
      return one.kind == kind && one.place.body == place && one.width() == 3 &&
             (kind != MeasuredQuantity::Kind::twist || one.is_angular == angular);
    });
  };
  std::vector<std::string> missing;
  const std::string path = path_of(body);
  const int place = run.find_frame(path)->body;
  if (!has(MeasuredQuantity::Kind::twist, true, place)) missing.push_back(path + "/angular_velocity");
  if (!has(MeasuredQuantity::Kind::twist, false, place)) missing.push_back(path + "/velocity");
  if (!has(MeasuredQuantity::Kind::orientation, false, place)) missing.push_back(path + "/quaternion_wxyz");
  if (!has(MeasuredQuantity::Kind::position, false, place)) missing.push_back(path + "/position");
  if (body != "robot") return missing;
  struct Needed {
    MeasuredQuantity::Kind kind;
    const char* series;
  };
  for (const Needed& needed : {Needed{MeasuredQuantity::Kind::joint_rate, "joints/velocity/"},
                               Needed{MeasuredQuantity::Kind::joint_position, "joints/position/"}}) {
    for (const int j : run.system().robot_joints) {
      const int joint = run.model().joints()[static_cast<std::size_t>(j)];
      const bool known = std::any_of(measured.used.begin(), measured.used.end(), [&](const MeasuredQuantity& one) {
        return one.kind == needed.kind && std::find(one.joints.begin(), one.joints.end(), joint) != one.joints.end();
      });
      if (!known)
        missing.push_back(needed.series + run.model().bodies()[static_cast<std::size_t>(joint)].description.joint.name);
    }
  }
  return missing;
}

}  // namespace

std::vector<MomentumCurve> measured_momentum(const RunModel& run, const MeasuredQuantities& measured, double offset,
                                             std::span<const ContactTime> contacts, std::size_t most) {
  std::vector<MomentumCurve> curves;
  std::vector<int> roots;
  const auto add = [&](const std::string& body, int root) {
    if (!run.model().has_free_root(root)) return;
    curves.emplace_back().body = body;
    curves.back().missing = missing_of(run, measured, body);
    roots.push_back(root);
  };
  add("robot", run.system().base);
  for (const TargetSetup& target : run.problem().targets) {
    if (target.panels.empty()) add(target.name, run.find_frame("targets/" + target.name)->body);
  }
  const MomentumOfLog of_log(run, measured, offset, contacts);
  // Joint positions decide on all momenta of the robot: without them there is no measured momentum.
  for (const double time : times_of(measured, offset, most)) {
    if (time < run.begin() || time > run.end()) continue;
    const auto values = of_log.at(time, roots);
    if (!values) continue;
    for (std::size_t i = 0; i < curves.size(); ++i) {
      MomentumCurve& curve = curves[i];
      const bool poses = std::none_of(curve.missing.begin(), curve.missing.end(),
                                      [](const std::string& one) { return one.starts_with("joints/position/"); });
      const bool placed = std::find(curve.missing.begin(), curve.missing.end(), path_of(curve.body) + "/position") ==
                          curve.missing.end();
      std::array<double, kMomentumComponents> value = (*values)[i].value;
      for (std::size_t c = 0; c < kMomentumComponents; ++c) {
        if (!poses || (!placed && c >= 6 && c < 9)) value[c] = kUndetermined;
      }
      curve.time.push_back(time), curve.value.push_back(value), curve.deviation.push_back((*values)[i].deviation);
    }
  }
  return curves;
}

std::string momentum_csv(std::span<const MomentumCurve> curves) {
  std::string csv = "body,time [s]";
  for (std::size_t c = 0; c < kMomentumComponents; ++c)
    csv += fmt::format(",{} [{}],uncertainty of {} [{}]", kMomentumNames[c], kMomentumUnits[c], kMomentumNames[c],
                       kMomentumUnits[c]);
  csv += "\n";
  for (const MomentumCurve& curve : curves) {
    for (std::size_t k = 0; k < curve.time.size(); ++k) {
      csv += csv_quoted(curve.body) + ",";
      append_csv_number(curve.time[k], csv);
      for (std::size_t c = 0; c < kMomentumComponents; ++c) {
        const bool known = std::isfinite(curve.value[k][c]);
        csv += ",";
        if (known) append_csv_number(curve.value[k][c], csv);
        csv += ",";
        if (known) append_csv_number(curve.deviation[k][c], csv);
      }
      csv += "\n";
    }
  }
  return csv;
}

}  // namespace grapnel
