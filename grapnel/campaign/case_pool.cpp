#include "grapnel/campaign/case_pool.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <limits>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
namespace {

constexpr std::chrono::milliseconds kReportInterval{100};  // interval of reports of the calling thread

// State shared by the threads.
class Pool {
 public:
  Pool(std::size_t jobs, std::size_t threads, const JobWork& work)
      : work_(work), jobs_(jobs), max_waiting_(threads + 1), working_(threads) {}

  // Main function of a computing thread.
  void compute() {
    try {
      for (std::size_t job = 0; take_job(job);) {
        const RowSink submit = [&](std::vector<CaseRow> rows) { wait_and_submit(job, std::move(rows)); };
        work_(job, submit, stop_.get_token());
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
      stop_.request_stop();
    }
    const std::lock_guard lock(mutex_);
    --working_;
    changed_.notify_all();
  }

  // The calling thread: takes rows and reports until all other threads have ended.
  void take_all(const PoolOptions& options, const TakeRows& take, CaseProgress& progress) {
    for (bool over = false; !over;) {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kReportInterval, [&] { return !waiting_.empty() || working_ == 0; });
      std::optional<std::pair<std::size_t, std::vector<CaseRow>>> next;
      if (!waiting_.empty()) {
        next = std::move(waiting_.front());
        waiting_.pop_front();
        changed_.notify_all();
      }
      over = waiting_.empty() && working_ == 0;
      lock.unlock();
      if (next) {
        progress.count(next->second);
        if (take) take(next->first, std::move(next->second));
      }
      if (options.progress) options.progress(progress);
    }
    if (error_) std::rethrow_exception(error_);
  }

  // No further rows are taken: the other threads must not wait for that.
  void abandon() {
    stop_.request_stop();
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
    changed_.notify_all();
  }

  void request_stop() { stop_.request_stop(); }

 private:
  bool take_job(std::size_t& job) {
    const std::lock_guard lock(mutex_);
    if (stop_.stop_requested() || next_ == jobs_) return false;
    job = next_++;
    return true;
  }

  void wait_and_submit(std::size_t job, std::vector<CaseRow> rows) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return waiting_.size() < max_waiting_ || abandoned_; });
    if (abandoned_) return;
    waiting_.emplace_back(job, std::move(rows));
    changed_.notify_all();
  }

  const JobWork& work_;
  const std::size_t jobs_;
  const std::size_t max_waiting_;
  std::stop_source stop_;
  std::mutex mutex_;  // guards the following members
  std::condition_variable changed_;
  std::deque<std::pair<std::size_t, std::vector<CaseRow>>> waiting_;  // for the calling thread, with their jobs
  std::size_t next_ = 0;                                              // job
  std::size_t working_;                                               // threads
  bool abandoned_ = false;
  std::exception_ptr error_;
};

}  // namespace

void CaseProgress::count(std::span<const CaseRow> rows) {
  done += rows.size();
  for (const CaseRow& row : rows) {
    if (row.success) ++successes;
    if (row.status != CaseStatus::ok) ++not_ok;
  }
}

CaseProgress run_jobs(std::size_t jobs, const PoolOptions& options, CaseProgress progress, const JobWork& work,
                      const TakeRows& take) {
  const std::size_t threads = std::min(jobs, static_cast<std::size_t>(std::max(options.threads, 1)));
  Pool pool(jobs, threads, work);
  const std::stop_callback forward(options.stop, [&pool] { pool.request_stop(); });
  std::vector<std::jthread> others;
  try {
    for (std::size_t i = 0; i < threads; ++i) others.emplace_back([&pool] { pool.compute(); });
    pool.take_all(options, take, progress);
  } catch (...) {
    pool.abandon();
    throw;
  }
  progress.stopped = progress.done < progress.total;
  return progress;
}

namespace {

// Tables have one line a case.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) text.replace(at, 1, "; ");
  std::replace(text.begin(), text.end(), '\r', ' ');
  return text;
}

}  // namespace

CaseRow failed_case(std::string reason, std::size_t columns) {
  return {0, CaseStatus::failed, one_line(std::move(reason)), std::vector<double>(columns, NAN)};
}

CaseRow case_row(const StudyCase& point, const CaptureResult& result, std::span<const Column> columns) {
  CaseRow row;
  if (const LedgerEntry* wrong = result.ledger.worst_failure(); wrong && result.status == CaptureStatus::completed) {
    row = failed_case(kNotConserved + failure_text(*wrong), columns.size());
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (columns[c].name == kConservationColumn) row.values[c] = 0;
    }
    return row;
  }
  if (result.status == CaptureStatus::completed) {
    row.status = CaseStatus::ok;
  } else {
    const bool unplanned = result.plan && result.plan->searched && !result.plan->found;
    row.status = unplanned ? CaseStatus::unreachable : CaseStatus::failed;
    row.reason = one_line(result.failure);
  }
  row.values.reserve(columns.size());
  for (const Column& column : columns) row.values.push_back(column.value(point, result));
  return row;
}

CaseRow run_case(const StudyCase& point, StudyMode mode, std::span<const Column> columns,
                 const CaptureProgress& progress) {
  try {
    const CaptureDetail detail = detail_of(columns);
    const CaptureResult result = mode == StudyMode::impact ? simulate_impact_only(point.problem, detail, progress)
                                                           : simulate_capture(point.problem, progress, detail);
    return case_row(point, result, columns);
  } catch (const std::exception& error) {
    return failed_case(error_text(error), columns.size());
  }
}

namespace {

struct Cost {
  long steps = 0, rejected = 0;
};

// Segments of a phase are named "post_impact", "post_impact_2".
bool is_segment_of(const std::string& phase, const std::string& segment) {
  return segment == phase || segment.starts_with(phase + "_");
}

// Over all segments of a phase.
Cost cost_of(const CaptureResult& result, const std::string& phase) {
  Cost cost;
  for (const PhaseCost& segment : result.cost) {
    if (!is_segment_of(phase, segment.phase)) continue;
    cost.steps += segment.steps;
    cost.rejected += segment.rejected;
  }
  return cost;
}

// The smallest transition rate of a joint with dry friction; infinite without one.
double sharpest_friction(const RobotSetup& robot) {
  double least = std::numeric_limits<double>::infinity();
  for (const BodyDescription& body : robot.bodies)
    if (body.joint.friction.coulomb > 0) least = std::min(least, body.joint.friction.transition_rate);
  return least;
}

double largest(const std::vector<double>& gains) {
  return gains.empty() ? 0 : *std::max_element(gains.begin(), gains.end());
}

void add_friction(const CaptureProblem& problem, std::vector<std::string>& causes) {
  const double rate = sharpest_friction(problem.robot);
  if (rate < std::numeric_limits<double>::infinity())
    causes.push_back(
        fmt::format("dry friction with a transition rate of {:.3g} rad/s or m/s (a larger "
                    "friction.transition_rate of the robot's joints)",
                    rate));
}

void add_general(const CaptureProblem& problem, std::vector<std::string>& causes) {
  if (problem.integration.method == IntegrationSetup::Method::rk4)
    causes.push_back(fmt::format("fixed steps of {:.3g} s (integration.step, or integration.method: automatic)",
                                 problem.integration.step));
  if (problem.control)
    causes.push_back(fmt::format("samples every {:.3g} s (a longer control.period)", problem.control->timing.period));
  if (problem.integration.max_step > 0)
    causes.push_back(fmt::format("steps of at most {:.3g} s (integration.max_step)", problem.integration.max_step));
  causes.push_back(fmt::format("a relative tolerance of {:.3g} (a larger integration.relative_tolerance)",
                               problem.integration.relative_tolerance));
}

// Integration resolves all vibrations of flexible bodies.
void add_bending(const CaptureProblem& problem, std::vector<std::string>& causes) {
  const bool panels = std::any_of(problem.targets.begin(), problem.targets.end(),
                                  [](const TargetSetup& t) { return !t.panels.empty(); });
  if (panels || is_flexible(problem.robot))
    causes.push_back(
        "flexible bodies (fewer segments, less stiffness where it has no influence; grapnel info shows the fastest "
        "mode)");
}

// Rotors cause nutation of the base, and loops of gimbals and rotors settle within 1/bandwidth.
void add_gyros(const CaptureProblem& problem, std::vector<std::string>& causes) {
  if (problem.robot.gyros.empty()) return;
  double momentum = 0, bandwidth = 0;
  for (const MomentGyroSetup& gyro : problem.robot.gyros) {
    momentum = std::max(momentum, std::abs(gyro.inertia * gyro.spin_rate));
    bandwidth = std::max(bandwidth, gyro.bandwidth);
  }
  causes.push_back(fmt::format(
      "control moment gyros of up to {:.3g} N m s each with loops of up to {:.3g} 1/s (smaller spin_rate or "
      "bandwidth of the robot's gyros, a larger gimbal_inertia)",
      momentum, bandwidth));
}

// The largest ratios to the apparent mass over all directions.
void add_impedance(const CaptureProblem& problem, std::vector<std::string>& causes) {
  if (!problem.impedance) return;
  const ImpedanceSetup& law = *problem.impedance;
  double frequency = 0, decay = 0;
  for (int k = 0; k < 3; ++k) {
    frequency = std::max({frequency, law.stiffness[k] / law.mass[k], law.angular_stiffness[k] / law.inertia[k]});
    decay = std::max({decay, law.damping[k] / law.mass[k], law.angular_damping[k] / law.inertia[k]});
  }
  causes.push_back(
      fmt::format("an impedance of {:.3g} rad/s and decay rates up to {:.3g} 1/s (smaller stiffness and damping of "
                  "impedance, a larger apparent mass or inertia)",
                  std::sqrt(frequency), decay));
}

std::vector<std::string> causes_of_approach(const CaptureProblem& problem) {
  std::vector<std::string> causes;
  add_bending(problem, causes);
  add_gyros(problem, causes);
  const TrackingSetup& tracking = problem.approach->tracking;
  if (tracking.mode == JointControl::impedance) add_impedance(problem, causes);
  if (tracking.mode != JointControl::prescribed) add_friction(problem, causes);
  if (has_gains(tracking.mode)) {
    causes.push_back(
        fmt::format("controllers with kp up to {:.3g} and kd up to {:.3g} (smaller gains of approach.tracking)",
                    largest(tracking.kp), largest(tracking.kd)));
  }
  if (tracking.noise && tracking.noise->position > 0)
    causes.push_back(
        fmt::format("noise up to {:.3g} Hz (a smaller approach.tracking.noise.bandwidth)", tracking.noise->bandwidth));
  add_general(problem, causes);
  return causes;
}

std::vector<std::string> causes_afterwards(const CaptureProblem& problem, const PostImpactSetup& after) {
  const std::string key = phases_key(problem);
  std::vector<std::string> causes;
  add_bending(problem, causes);
  add_gyros(problem, causes);
  add_impedance(problem, causes);
  if (after.joints != PostImpactSetup::Joints::braked) add_friction(problem, causes);
  if (has_gains(after.joints))
    causes.push_back(fmt::format("controllers with kp up to {:.3g} and kd up to {:.3g} (smaller gains of {})",
                                 largest(after.kp), largest(after.kd), key));
  if (after.base_control)
    causes.push_back(fmt::format("a base under attitude control (smaller gains of {}.base_control)", key));
  if (problem.grasps.size() > 1)
    causes.push_back(fmt::format("closed loops, which are projected after every step ({}.duration)", key));
  add_general(problem, causes);
  return causes;
}

std::string listed(const std::vector<std::string>& causes) {
  std::string list;
  for (const std::string& cause : causes) list += (list.empty() ? "" : "; ") + cause;
  return list;
}

void check_phase(const std::string& phase, const CaptureResult& result, double duration,
                 const std::vector<std::string>& causes, std::vector<std::string>& lines) {
  const Cost cost = cost_of(result, phase);
  if (cost.steps < kFewSteps || !(static_cast<double>(cost.steps) > kManySteps * duration)) return;
  const std::string list = listed(causes);
  lines.push_back(
      fmt::format("{} took {} steps for {:.4g} s of motion ({} more were rejected); most runs take less than {:g} per "
                  "second. Likely causes, the most likely first: {}",
                  phase, cost.steps, duration, cost.rejected, kManySteps, list));
}

}  // namespace

std::string causes_of_short_steps(const CaptureProblem& problem, const std::string& phase) {
  if (problem.approach && phase.starts_with("approach")) return listed(causes_of_approach(problem));
  for (std::size_t k = problem.post_impact.size(); k-- > 0;) {
    if (k == 0 || is_segment_of(phase_name(problem, k), phase))
      return listed(causes_afterwards(problem, problem.post_impact[k]));
  }
  std::vector<std::string> causes;
  add_general(problem, causes);
  return listed(causes);
}

std::vector<std::string> slow_phases(const CaptureProblem& problem, const CaptureResult& result) {
  std::vector<std::string> lines;
  if (problem.approach) {
    const double duration = result.approach_end ? result.approach_end->time : problem.approach->duration;
    check_phase("approach", result, duration, causes_of_approach(problem), lines);
  }
  for (std::size_t k = 0; k < problem.post_impact.size(); ++k) {
    const PostImpactSetup& phase = problem.post_impact[k];
    const double duration = k < result.phases.size() ? result.phases[k].duration() : phase.duration;
    check_phase(phase_name(problem, k), result, duration, causes_afterwards(problem, phase), lines);
  }
  return lines;
}

}  // namespace grapnel
