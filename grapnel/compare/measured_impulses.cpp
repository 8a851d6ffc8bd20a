#include "grapnel/compare/measured_impulses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "grapnel/compare/chi_square.hpp"
#include "grapnel/compare/impulse_estimate.hpp"
#include "grapnel/compare/step_detection.hpp"
#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/workspace.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

using Kind = MeasuredQuantity::Kind;

[[noreturn]] void refuse_log(const std::string& message) {
  FaultList faults;
  faults.add(Mark{}, message);
  faults.throw_if_any();
  throw std::logic_error("unreachable");
}

// ---- Detection ----

// Measured rates without missing values, one per component, and the run's at the same times.
struct DetectionRates {
  std::vector<RateSamples> measured, simulated;
};

DetectionRates detection_rates(const MeasuredQuantities& measured, double offset, const ComparedTimes& times) {
  DetectionRates rates;
  std::array<double, kMostComponents> x{};
  for (const MeasuredQuantity& one : measured.used) {
    if (!one.measures_rates()) continue;
    const ComparedQuantity& q = *one.quantity;
    const std::size_t width = q.curve.width(), first = rates.measured.size();
    rates.measured.resize(first + width), rates.simulated.resize(first + width);
    for (std::size_t i = 0; i < q.samples(); ++i) {
      const double t = q.time[i] + offset;
      if (t < times.from || t > times.to) continue;
      q.curve.value(t, {x.data(), width});
      for (std::size_t c = 0; c < width; ++c) {
        const double y = q.measured[i * width + c];
        RateSamples& m = rates.measured[first + c];
        RateSamples& s = rates.simulated[first + c];
        if (!std::isfinite(y) || (!m.time.empty() && !(t > m.time.back()))) continue;
        m.time.push_back(t), m.value.push_back(y), m.deviation = *q.uncertainty;
        if (!std::isfinite(x[c])) continue;
        s.time.push_back(t), s.value.push_back(x[c]), s.deviation = *q.uncertainty;
      }
    }
  }
  return rates;
}

// The window with the largest margin of the run's weakest contact above the threshold. The curvature is the largest
// statistic of the run's motion apart from its contacts.
StepTest choose_test(const DetectionRates& rates, const std::vector<RunContact>& contacts, double false_alarms) {
  const std::vector<double> times = step_candidates(rates.simulated);
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times.size(); ++i) intervals.push_back(times[i] - times[i - 1]);
  const double interval = median_of(intervals);
  StepTest best;
  double margin = -std::numeric_limits<double>::infinity();
  for (const double samples : {6.0, 10.0, 16.0, 26.0, 42.0, 68.0, 110.0}) {
    StepTest test;
    test.window = samples * interval, test.false_alarms = false_alarms;
    for (const double t : times) {
      const bool is_near = std::any_of(contacts.begin(), contacts.end(), [&](const RunContact& c) {
        return t > c.time - test.window - interval && t < c.end + test.window + interval;
      });
      if (!is_near)
        test.curvature =
            std::max(test.curvature, std::sqrt(step_statistic(rates.simulated, t, test.window).chi_square));
    }
    double weakest = std::numeric_limits<double>::infinity();
    for (const RunContact& c : contacts) {
      const auto after = std::lower_bound(times.begin(), times.end(), c.time);
      if (after == times.end()) continue;
      const StepStatistic s = step_statistic(rates.simulated, c.end > c.time ? c.time : *after, test.window);
      if (s.rates > 0)
        weakest = std::min(weakest, std::sqrt(s.chi_square) - step_threshold(test, times.size(), s.rates));
    }
    if (weakest > margin) margin = weakest, best = test;
  }
  if (best.window == 0) best.window = 16 * interval, best.false_alarms = false_alarms;
  return best;
}

// ---- One contact ----

class ContactEstimate {
 public:
  ContactEstimate(const RunModel& run, const MeasuredQuantities& measured, double offset)
      : run_(run), measured_(measured), offset_(offset) {}

  ImpulseReport::Contact estimate(const ContactTime& contact, const RunContact& simulated, const FitRange& range,
                                  std::vector<std::string>& warnings) {
    report_ = {};
    report_.time = contact.begin, report_.end = contact.end, report_.simulated_time = simulated.time;
    contact_ = contact, simulated_ = &simulated;
    const State before = run_.state_at(simulated.time, true), after = run_.state_at(simulated.end);
    run_change_ = as_vector(after.v) - as_vector(before.v);
    mean_rate_ = 0.5 * (as_vector(after.v) + as_vector(before.v));
    measure(after, range, warnings);
    find_efforts();
    const MeasuredConfiguration& configuration = *configuration_;
    const ImpulseEstimate found =
        estimate_impulses([&](std::span<const double> changes) { return task_at(configuration.at(changes)); },
                          configuration.parameters());
    describe(found);
    report_.assumed = configuration.unmeasured();
    report_.zero_efforts = zero_efforts();
    if (!report_.zero_efforts.empty())
      report_.reason +=
          fmt::format("; the effort of {} is not measured and counts as zero", some_of(report_.zero_efforts));
    return report_;
  }

 private:
  static Eigen::VectorXd as_vector(const std::vector<double>& v) {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  }

  // Fits of all rates and places.
  void measure(const State& state, const FitRange& range, std::vector<std::string>& warnings) {
    const Kinematics kinematics = forward_kinematics(run_.model(), state);
    const ContactTime run_contact{simulated_->time, simulated_->end, 0};
    configuration_.emplace(run_, state);
    configuration_->attach(simulated_->grasps);
    changes_.clear(), changed_.clear(), scattered_.clear();
    std::vector<std::string> too_few;
    for (const MeasuredQuantity& one : measured_.used) {
      if (!one.measures_rates() && !one.measures_places()) continue;
      const Eigen::VectorXd run_change = rate_rows(one, run_.model(), kinematics) * run_change_;
      auto change = measure_change(one, offset_, contact_, run_contact, run_change, range);
      const std::string name = printable_line(one.quantity->name);
      if (!change) {
        too_few.push_back(name);
        continue;
      }
      if (one.measures_places()) configuration_->set(one, change->place, change->place_deviation, change->reference);
      const double bound = chi_square_bound(change->freedom);
      if (change->chi_square > bound) {
        scattered_.push_back(name);
        warnings.push_back(
            fmt::format("{}: samples around t = {:.6g} s scatter about their polynomials with chi-square {}, "
                        "above {}: a shorter --window, or a larger uncertainty",
                        name, contact_.begin, small_number(change->chi_square), small_number(bound)));
      }
      changes_.push_back(std::move(*change)), changed_.push_back(&one);
    }
    if (changes_.empty())
      refuse_log(
          fmt::format("no rate has enough samples on both sides of the contact at t = {:.6g} s: at least 5 are "
                      "needed; measured are {}",
                      contact_.begin, too_few.empty() ? "none" : some_of(too_few)));
    for (const std::string& name : too_few)
      warnings.push_back(fmt::format("{}: too few samples around t = {:.6g} s", name, contact_.begin));
  }

  // The integral of a quantity over a contact with a duration, by its samples; empty: they do not cover it.
  struct Integral {
    Eigen::VectorXd value, deviation;
  };
  std::optional<Integral> integral_of(const MeasuredQuantity& one) const {
    const ComparedQuantity& q = *one.quantity;
    const std::size_t width = q.curve.width();
    std::vector<double> time;
    std::vector<std::size_t> index;
    for (std::size_t i = 0; i < q.samples(); ++i) {
      const double t = q.time[i] + offset_ - 0.5 * q.average;
      bool is_complete = true;
      for (std::size_t c = 0; c < width; ++c) is_complete = is_complete && std::isfinite(q.measured[i * width + c]);
      if (is_complete) time.push_back(t), index.push_back(i);
    }
    // Straight lines between samples; of several at one time each counts on its side.
    Integral result;
    result.value = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(width));
    Eigen::VectorXd sampling = -integral_of_run(q);  // error of the same sum of the run's values, (25.3a)
    double squares = 0;
    std::vector<double> simulated(width);
    if (time.size() < 2 || time.front() > contact_.begin || time.back() < contact_.end) return std::nullopt;
    std::vector<double> weights(time.size(), 0.0);
    for (std::size_t k = 1; k < time.size(); ++k) {
      const double from = std::max(time[k - 1], contact_.begin), to = std::min(time[k], contact_.end);
      if (!(to > from)) continue;
      const double share = (0.5 * (from + to) - time[k - 1]) / (time[k] - time[k - 1]);
      weights[k - 1] += (to - from) * (1 - share), weights[k] += (to - from) * share;
    }
    for (std::size_t k = 0; k < time.size(); ++k) {
      if (weights[k] == 0) continue;
      q.curve.value(time[k] + 0.5 * q.average - delay(), simulated);
      for (std::size_t c = 0; c < width; ++c) {
        result.value[static_cast<Eigen::Index>(c)] += weights[k] * q.measured[index[k] * width + c];
        sampling[static_cast<Eigen::Index>(c)] += weights[k] * simulated[c];
      }
      squares += weights[k] * weights[k];
    }
    const double noise = std::hypot(*q.uncertainty * std::sqrt(squares),
                                    q.bias_uncertainty.value_or(0) * (contact_.end - contact_.begin));
    result.deviation = sampling.unaryExpr([&](double e) { return std::isfinite(e) ? std::hypot(noise, e) : noise; });
    return result;
  }

  // Of the contact after that of the run [s].
  double delay() const { return contact_.begin - simulated_->time; }

  // The run's integral of a quantity over the contact, by fine steps.
  Eigen::VectorXd integral_of_run(const ComparedQuantity& q) const {
    constexpr int kSteps = 2000;
    const double step = (contact_.end - contact_.begin) / kSteps;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(q.curve.width()));
    std::vector<double> value(q.curve.width());
    for (int i = 0; i < kSteps; ++i) {
      q.curve.value(contact_.begin + (i + 0.5) * step - delay() + 0.5 * q.average, value);
      sum += step * Eigen::Map<const Eigen::VectorXd>(value.data(), sum.size());
    }
    return sum;
  }

  // Impulses of drives over a contact with a duration, and directly measured ones of grasps.
  void find_efforts() {
    const Eigen::Index nv = run_.model().velocities();
    effort_ = Eigen::VectorXd::Zero(nv), effort_deviation_ = Eigen::VectorXd::Zero(nv);
    known_drives_.clear(), forces_.clear();
    if (!(contact_.end > contact_.begin)) return;
    for (const MeasuredQuantity& one : measured_.used) {
      if (one.kind != Kind::effort && one.kind != Kind::grasp_force) continue;
      const auto integral = integral_of(one);
      if (!integral) continue;
      if (one.kind == Kind::grasp_force) {
        forces_.emplace_back(&one, *integral);
        continue;
      }
      for (std::size_t k = 0; k < one.joints.size(); ++k) {
        const int body = one.joints[k], v = run_.model().bodies()[static_cast<std::size_t>(body)].v;
        effort_[v] = integral->value[static_cast<Eigen::Index>(k)];
        effort_deviation_[v] = integral->deviation[static_cast<Eigen::Index>(k)];
        known_drives_.push_back(body);
      }
    }
  }

  // Bodies of the joints whose drives or brakes kept a rate, and whose impulses are not measured.
  std::vector<int> unknown_drives() const {
    std::vector<int> bodies;
    for (const std::string& name : simulated_->held_joints) {
      const auto body = run_.find_joint("joints/effort", name);
      if (body && !is_known_drive(*body)) bodies.push_back(*body);
    }
    return bodies;
  }
  bool is_known_drive(int body) const {
    return std::find(known_drives_.begin(), known_drives_.end(), body) != known_drives_.end();
  }

  // Joints and wheels whose impulse over a contact with a duration is neither measured nor estimated.
  std::vector<std::string> zero_efforts() const {
    if (!(contact_.end > contact_.begin)) return {};
    const std::vector<int> unknown = unknown_drives();
    std::vector<std::string> names;
    const auto add = [&](int body, const std::string& name) {
      const bool is_unknown = std::find(unknown.begin(), unknown.end(), body) != unknown.end();
      if (!is_unknown && !is_known_drive(body)) names.push_back(name);
    };
    for (const int j : run_.system().robot_joints) {
      const int body = run_.model().joints()[static_cast<std::size_t>(j)];
      add(body, run_.model().bodies()[static_cast<std::size_t>(body)].description.joint.name);
    }
    for (const WheelSetup& wheel : run_.problem().robot.wheels) {
      if (const auto body = run_.find_joint("wheels/rate", wheel.name)) add(*body, "wheel " + wheel.name);
    }
    return names;
  }

  std::vector<Grasp> grasps_at(const Kinematics& kinematics) const {
    std::vector<Grasp> grasps;
    for (const RunContact::Grasp& one : simulated_->grasps) {
      const auto end_effector = run_.find_frame("end_effectors/" + one.end_effector);
      const auto target = run_.find_frame("targets/" + one.target);
      if (!end_effector || !target)
        refuse_log(fmt::format("the scenario has no grasp of {} with {}, as the run has", in_quotes(one.target),
                               in_quotes(one.end_effector)));
      Grasp grasp{end_effector->body, target->body, GraspModel::rigid, Vector3d::zero(), {0, 0, 1}};
      const Posed X_WE = kinematics.X_WB[static_cast<std::size_t>(end_effector->body)] * end_effector->X_BF;
      for (const GraspSetup& setup : run_.problem().grasps) {
        if (setup.end_effector != one.end_effector || setup.target != one.target) continue;
        grasp.model = setup.contact ? GraspModel::point : setup.model;
        grasp.hinge_W = X_WE.R * setup.hinge_axis;
      }
      grasp.p_WC = X_WE.p;
      grasps.push_back(grasp);
    }
    return grasps;
  }

  ImpulseTask task_at(const State& state) const {
    const Model& model = run_.model();
    const Kinematics kinematics = forward_kinematics(model, state);
    const std::vector<Grasp> grasps = grasps_at(kinematics);
    ImpulseTask task;
    task.M = mass_matrix(model, state);
    task.J = grasp_jacobian(model, kinematics, grasps);
    for (const int body : unknown_drives())
      task.unknown_drives.push_back(model.bodies()[static_cast<std::size_t>(body)].v);
    task.known = effort_, task.known_deviation = effort_deviation_;
    const double duration = contact_.end - contact_.begin;
    if (duration > 0) {
      State moving = state;
      moving.v.assign(mean_rate_.data(), mean_rate_.data() + mean_rate_.size());
      std::vector<double> forces;
      Workspace workspace(model);
      bias(model, moving, run_.problem().gravity, workspace, forces);
      task.known -= duration * as_vector(forces);
    }
    Eigen::Index rows = 0;
    for (const MeasuredChange& change : changes_) rows += change.change.size();
    task.H.resize(rows, model.velocities()), task.change.resize(rows);
    task.covariance = Eigen::MatrixXd::Zero(rows, rows);
    Eigen::VectorXd timing(rows);
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < changes_.size(); ++i) {
      const MeasuredChange& change = changes_[i];
      const Eigen::Index width = change.change.size();
      task.H.middleRows(row, width) = rate_rows(*changed_[i], model, kinematics);
      task.change.segment(row, width) = change.change;
      task.covariance.diagonal().segment(row, width) = change.deviation.cwiseAbs2();
      timing.segment(row, width) = contact_.deviation * change.per_delay;
      row += width;
    }
    task.covariance += timing * timing.transpose();
    add_forces(kinematics, grasps, task);
    return task;
  }

  // Rows of force sensors: components of A^T P along the log's axes.
  void add_forces(const Kinematics& kinematics, const std::vector<Grasp>& grasps, ImpulseTask& task) const {
    Eigen::Index rows = 0;
    for (const auto& [one, integral] : forces_) rows += static_cast<Eigen::Index>(one->parts.size());
    task.D = Eigen::MatrixXd::Zero(rows, task.J.rows());
    task.direct.resize(rows), task.direct_deviation.resize(rows);
    Eigen::Index row = 0;
    for (const auto& [one, integral] : forces_) {
      Eigen::Index first = 0;
      const Rotationd R = log_axes(*one, kinematics);
      for (std::size_t g = 0; g < grasps.size(); ++g) {
        const Eigen::MatrixXd A = constrained_directions(grasps[g]);
        if (simulated_->grasps[g].end_effector == one->end_effector) {
          for (std::size_t k = 0; k < one->parts.size(); ++k) {
            const Vector3d axis = R.column(static_cast<int>(one->parts[k]));
            Eigen::Matrix<double, 6, 1> direction = Eigen::Matrix<double, 6, 1>::Zero();
            for (int i = 0; i < 3; ++i) direction[(one->is_angular ? 0 : 3) + i] = axis[i];
            task.D.block(row + static_cast<Eigen::Index>(k), first, 1, A.rows()) = (A * direction).transpose();
          }
        }
        first += A.rows();
      }
      for (std::size_t k = 0; k < one->parts.size(); ++k, ++row)
        task.direct[row] = integral.value[static_cast<Eigen::Index>(k)],
        task.direct_deviation[row] = integral.deviation[static_cast<Eigen::Index>(k)];
    }
  }

  void describe(const ImpulseEstimate& found) {
    const WeightedSolution& s = found.solution;
    std::vector<double> none(configuration_->parameters(), 0.0);
    const State state = configuration_->at(none);
    const Kinematics kinematics = forward_kinematics(run_.model(), state);
    const std::vector<Grasp> grasps = grasps_at(kinematics);
    Eigen::Index first = 0;
    for (std::size_t g = 0; g < grasps.size(); ++g) {
      const Eigen::MatrixXd A = constrained_directions(grasps[g]);
      report_.grasps.push_back(describe_grasp(simulated_->grasps[g], A, first, found));
      first += A.rows();
    }
    for (const int body : unknown_drives()) report_.drives.push_back(describe_drive(found, first++, body));
    for (Eigen::Index k = 0; k < s.null_space.cols(); ++k) {
      Eigen::VectorXd n = found.scale.cwiseProduct(s.null_space.col(k));
      n /= n.cwiseAbs().maxCoeff();
      report_.null_space.emplace_back(n.data(), n.data() + n.size());
    }
    describe_rates(s);
    report_.unknowns = static_cast<std::size_t>(s.value.size()), report_.rank = static_cast<std::size_t>(s.rank);
    report_.rows = static_cast<std::size_t>(s.rank + s.freedom), report_.freedom = static_cast<std::size_t>(s.freedom);
    judge_balance(s);
  }

  ImpulseReport::Grasp describe_grasp(const RunContact::Grasp& simulated, const Eigen::MatrixXd& A, Eigen::Index first,
                                      const ImpulseEstimate& found) const {
    static constexpr const char* kNames[] = {"linear x", "linear y", "linear z", "angular x", "angular y", "angular z"};
    const WeightedSolution& s = found.solution;
    ImpulseReport::Grasp report;
    report.end_effector = simulated.end_effector, report.target = simulated.target;
    std::vector<Eigen::VectorXd> determined;
    for (int k = 0; k < 6; ++k) {
      const int twist = (k + 3) % 6;  // [angular; linear]
      Eigen::VectorXd c = Eigen::VectorXd::Zero(s.value.size());
      c.segment(first, A.rows()) = A.col(twist);
      if (c.norm() < 1e-12) continue;  // the grasp transmits none
      ImpulseReport::Component component;
      component.name = kNames[k], component.unit = k < 3 ? "N s" : "N m s";
      const Combination combined = combine(s, found.scale, c);
      component.determined = combined.determined;
      if (combined.determined) {
        component.value = combined.value, component.uncertainty = combined.deviation;
        determined.push_back(c);
      }
      const double expected = k < 3 ? simulated.impulse[k] : simulated.angular_impulse[k - 3];
      if (std::isfinite(expected)) component.simulated = expected;
      report.components.push_back(std::move(component));
    }
    for (const Eigen::VectorXd& a : determined) {
      for (const Eigen::VectorXd& b : determined) report.covariance.push_back(a.dot(s.covariance * b));
    }
    return report;
  }

  ImpulseReport::Component describe_drive(const ImpulseEstimate& found, Eigen::Index i, int body) const {
    const WeightedSolution& s = found.solution;
    const auto& joint = run_.model().bodies()[static_cast<std::size_t>(body)].description.joint;
    ImpulseReport::Component component;
    component.name = joint.name, component.unit = axis_units(joint.type).impulse;
    const Eigen::VectorXd c = Eigen::VectorXd::Unit(s.value.size(), i);
    const Combination combined = combine(s, found.scale, c);
    component.determined = combined.determined;
    if (combined.determined) component.value = combined.value, component.uncertainty = combined.deviation;
    return component;
  }

  void describe_rates(const WeightedSolution& s) {
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < changes_.size(); ++i) {
      const MeasuredChange& change = changes_[i];
      const ComparedQuantity& q = *changed_[i]->quantity;
      for (Eigen::Index k = 0; k < change.change.size(); ++k, ++row) {
        ImpulseReport::Rate rate;
        rate.quantity = q.name, rate.component = q.components[static_cast<std::size_t>(k)];
        rate.unit = changed_[i]->measures_places() ? q.unit + "/s" : q.unit;
        rate.before = change.before[k], rate.after = change.after[k], rate.change = change.change[k];
        rate.uncertainty = change.deviation[k], rate.curvature = change.curvature[k], rate.window = change.window;
        rate.samples = change.samples, rate.outliers = change.outliers, rate.chi_square = change.chi_square;
        rate.residual = s.whitened_residual[row];
        report_.rates.push_back(std::move(rate));
      }
    }
  }

  void judge_balance(const WeightedSolution& s) {
    if (s.freedom <= 0) {
      report_.reason = "the momentum balance is not checked, since no measurement is redundant";
      return;
    }
    const double value = s.chi_square / s.freedom, bound = chi_square_bound(s.freedom);
    report_.chi_square = value, report_.chi_square_bound = bound;
    report_.verdict = value <= bound ? Verdict::yes : Verdict::no;
    report_.reason = fmt::format("the momentum balance has chi-square {} with {}, {} {}", small_number(value),
                                 counted(static_cast<std::size_t>(s.freedom), "redundant measurement"),
                                 value <= bound ? "within" : "above the bound", small_number(bound));
    if (scattered_.empty()) return;
    report_.verdict = Verdict::not_checked;  // the uncertainties of the changes do not hold
    report_.reason += "; not checked, since samples scatter more than stated: " + some_of(scattered_);
  }

  const RunModel& run_;
  const MeasuredQuantities& measured_;
  double offset_;
  // Of the current contact:
  ContactTime contact_;
  const RunContact* simulated_ = nullptr;
  ImpulseReport::Contact report_;
  Eigen::VectorXd run_change_, mean_rate_;
  std::optional<MeasuredConfiguration> configuration_;
  std::vector<MeasuredChange> changes_;
  std::vector<const MeasuredQuantity*> changed_;
  std::vector<std::string> scattered_;  // quantities whose samples the polynomials do not describe
  Eigen::VectorXd effort_, effort_deviation_;
  std::vector<int> known_drives_;  // bodies
  std::vector<std::pair<const MeasuredQuantity*, Integral>> forces_;
};

// Of stated contacts, in order: inside the log, and one after the other.
void check_contacts(const std::vector<ContactTime>& contacts, const MeasuredQuantities& measured, double offset,
                    const ComparedTimes& stated) {
  FaultList faults;
  ComparedTimes times{HUGE_VAL, -HUGE_VAL};
  for (const MeasuredQuantity& one : measured.used) {
    for (const double t : one.quantity->time)
      times.from = std::min(times.from, t + offset), times.to = std::max(times.to, t + offset);
  }
  times.from = std::max(times.from, stated.from), times.to = std::min(times.to, stated.to);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactTime& one = contacts[i];
    if (!(one.begin > times.from && one.end < times.to))
      faults.add(Mark{}, fmt::format("the contact stated from t = {:.6g} to {:.6g} s is not within the samples, which "
                                     "are from {:.6g} to {:.6g} s of the run's clock",
                                     one.begin, one.end, times.from, times.to));
    if (i > 0 && !(one.begin > contacts[i - 1].end))
      faults.add(Mark{}, fmt::format("the contacts stated at t = {:.6g} s and {:.6g} s coincide or overlap",
                                     contacts[i - 1].begin, one.begin));
  }
  faults.throw_if_any();
}

const RunContact& nearest_contact(const std::vector<RunContact>& contacts, double time) {
  return *std::min_element(contacts.begin(), contacts.end(), [&](const RunContact& a, const RunContact& b) {
    return std::abs(a.time - time) < std::abs(b.time - time);
  });
}

}  // namespace

MeasuredImpulses measured_impulses(const RunModel& run, const AlignedLog& log, const ImpulseOptions& options) {
  MeasuredImpulses result;
  ImpulseReport& report = result.report;
  report.version = log.head.version, report.scenario = log.head.run.scenario, report.sha256 = log.head.run.sha256;
  report.log = log.head.log.file, report.log_sha256 = log.head.log.sha256;
  report.offset = log.head.clock.offset, report.offset_uncertainty = log.head.clock.uncertainty;
  report.warnings = log.head.warnings, report.false_alarms = options.false_alarms;
  const MeasuredQuantities measured = measured_quantities(log.quantities, run);
  report.unused = measured.unused;
  const bool has_rates = std::any_of(measured.used.begin(), measured.used.end(), [](const MeasuredQuantity& one) {
    return one.measures_rates() || one.measures_places();
  });
  if (!has_rates)
    refuse_log(
        fmt::format("no quantity of the mapping measures a rate: needed are series such as base/angular_velocity, "
                    "base/velocity, joints/velocity/NAME or targets/NAME/angular_velocity with 'uncertainty'{}",
                    measured.unused.empty() ? "" : "; unused are " + some_of(measured.unused)));
  if (run.contacts().empty()) refuse_log("the run has no impact of grasps: there is nothing to relate impulses to");

  std::vector<ContactTime> contacts = options.contacts;
  std::vector<DetectedStep> steps;
  if (contacts.empty()) {
    const DetectionRates rates = detection_rates(measured, report.offset, log.times);
    if (rates.measured.empty())
      refuse_log("contacts can be detected in measured rates only, and the mapping has none; state them with --at");
    const StepTest test = choose_test(rates, run.contacts(), options.false_alarms);
    report.detection_window = test.window;
    steps = detect_steps(rates.measured, test);
    for (const DetectedStep& step : steps) contacts.push_back({step.time, step.time, step.deviation});
    if (contacts.empty())
      refuse_log(
          fmt::format("no contact was detected in the measured rates with {} expected false alarms; state the "
                      "times with --at, or more false alarms with --false-alarms",
                      options.false_alarms));
  } else {
    std::sort(contacts.begin(), contacts.end(), [](const auto& a, const auto& b) { return a.begin < b.begin; });
    for (ContactTime& one : contacts) {
      const RunContact& simulated = nearest_contact(run.contacts(), one.begin);
      if (one.end == one.begin) one.end += simulated.end - simulated.time;
    }
    check_contacts(contacts, measured, report.offset, log.times);
  }
  ContactEstimate estimator(run, measured, report.offset);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    ContactTime& contact = contacts[i];
    const RunContact& simulated = nearest_contact(run.contacts(), contact.begin);
    if (contact.end == contact.begin && simulated.end > simulated.time) contact.end += simulated.end - simulated.time;
    FitRange range{std::max(log.times.from, i > 0 ? contacts[i - 1].end : -HUGE_VAL),
                   std::min(log.times.to, i + 1 < contacts.size() ? contacts[i + 1].begin : HUGE_VAL), options.window};
    report.contacts.push_back(estimator.estimate(contact, simulated, range, report.warnings));
    if (steps.empty()) continue;
    report.contacts.back().detected = true, report.contacts.back().time_uncertainty = steps[i].deviation;
    report.contacts.back().statistic = steps[i].statistic, report.contacts.back().threshold = steps[i].threshold;
    constexpr double kFar = 5;  // standard uncertainties
    const double apart = contact.begin - simulated.time;
    const double deviation = std::hypot(steps[i].deviation, report.offset_uncertainty.value_or(0));
    if (std::abs(apart) > kFar * deviation)
      report.warnings.push_back(
          fmt::format("the contact detected at t = {:.6g} s is {:.3g} s {} that of the run, {:.3g} standard "
                      "uncertainties; a contact with a duration needs --at TIME:DURATION",
                      contact.begin, std::abs(apart), apart > 0 ? "after" : "before", std::abs(apart) / deviation));
  }
  if (report.count(Verdict::no) > 0)
    report.verdict = Verdict::no;
  else if (report.count(Verdict::yes) > 0)
    report.verdict = Verdict::yes;

  if (!options.momentum) return result;
  result.momentum = measured_momentum(run, measured, report.offset, contacts, kMostMomenta);
  report.momentum = momentum_report(result.momentum);
  return result;
}

MeasuredImpulses measured_impulses(const std::filesystem::path& run_folder, const std::filesystem::path& log,
                                   const std::filesystem::path& mapping, const ImpulseOptions& options) {
  AlignedLog mapped = read_aligned_log(run_folder, log, mapping);
  apply_drift(mapped);
  const RunModel model(run_folder, options.scenario, options.overrides);
  try {
    return measured_impulses(model, mapped, options);
  } catch (const InputError& error) {
    std::vector<Fault> faults(error.faults().begin(), error.faults().end());
    for (Fault& fault : faults) {
      if (fault.file.empty()) fault.file = log.string();
    }
    throw InputError(std::move(faults));
  }
}

}  // namespace grapnel
