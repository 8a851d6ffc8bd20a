#include "grapnel/plant/plant_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cfenv>
#include <cmath>

#include "grapnel/capture/capture_steps.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/plant/plant_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/simulate/controller_source.hpp"
#include "grapnel/simulate/replay_controller.hpp"

namespace grapnel {
namespace {

// Times that differ by less than this part of a period are equal.
constexpr double kSame = 1e-6;

PlantOutputs::Motion motion_of(const Posed& X_WB, const Twistd& V_WB, const Vector3d& place, const Vector3d& velocity) {
  return {X_WB.p + place, quaternion_from(X_WB.R), V_WB.linear + velocity, transpose(X_WB.R) * V_WB.angular};
}
PlantOutputs::Motion motion_of(const BodyMotion& body) {
  const Rotationd R = rotation_matrix(body.quaternion_wxyz);
  return {body.position, body.quaternion_wxyz, body.velocity, transpose(R) * body.angular_velocity};
}

double row_of(const Ledger& ledger, const std::string& name) {
  for (const LedgerEntry& entry : ledger.entries) {
    if (entry.name == name) return entry.value;
  }
  return 0;
}

}  // namespace

// The controller of the run: passes its inputs to the caller and applies the caller's commands.
class PlantRun::CommandedController final : public Controller {
 public:
  CommandedController(PlantRun& run, ControlledRobot robot)
      : run_(run), sample_(std::move(robot)), command_(sample_.robot()) {}

  void begin_segment(const Model& model, double) override {
    sample_.begin_segment(model);
    frames_.clear();
    for (const ControlledRobot::Part& target : sample_.robot().targets)
      frames_.push_back(model.frame_index(target.in_model));
  }

  void update(const ControlInput& input, ControlCommand& command) override {
    sample_.read(input);
    run_.arrive(seen(input), input.time, inputs_);
    std::size_t next = 0;
    for (std::size_t c = 0; c < kCommandSignals; ++c) {
      if (!is_commanded(command_signals[c], sample_.robot())) continue;
      const bool is_flag = command_signals[c].about.kind == ControllerSignal::Kind::flag;
      for (double& value : command_[c]) {
        value = inputs_.at(next++);
        if (is_flag) value = value != 0 ? 1 : 0;
      }
    }
    command_.apply(sample_.robot(), sample_.joints(), command);
  }

 private:
  PlantOutputs seen(const ControlInput& input) const {
    PlantOutputs out;
    out.phase = run_.phase_;
    out.signals = sample_.values();
    const ControlledRobot& robot = sample_.robot();
    const Vector3d place = robot.origin + input.time * robot.velocity;
    const Kinematics kinematics = forward_kinematics(input.model, input.state);
    for (const int frame : frames_)
      out.targets.push_back(motion_of(frame_pose(input.model, kinematics, frame),
                                      frame_twist(input.model, kinematics, frame), place, robot.velocity));
    out.end.captured.assign(run_.plant_.grasps.size(), 0);
    return out;
  }

  PlantRun& run_;
  ControllerSample sample_;
  ControllerCommand command_;
  std::vector<int> frames_;  // of targets
  std::vector<double> inputs_;
};

class PlantRun::Source final : public ControllerSource {
 public:
  explicit Source(PlantRun& run) : run_(run) {}
  std::shared_ptr<Controller> make(const ControlTiming&, const std::string&, ControlledRobot robot,
                                   const Model&) const override {
    return std::make_shared<CommandedController>(run_, std::move(robot));
  }

 private:
  PlantRun& run_;
};

// --- The run, on its own thread ---

PlantRun::PlantRun(CaptureProblem plant, PlantVariables variables)
    : plant_(std::move(plant)), variables_(std::move(variables)) {
  plant_.control->source = std::make_shared<const Source>(*this);
}

PlantRun::~PlantRun() {
  {
    const std::lock_guard lock(mutex_);
    cancelled_ = true;
  }
  changed_.notify_all();
  if (worker_.joinable()) worker_.join();
}

double PlantRun::period() const { return plant_.control->timing.period; }

void PlantRun::work() {
  // The default floating-point environment, independent of the creating thread: rounding to nearest, no unmasked
  // exceptions, denormal numbers kept.
  std::fesetenv(FE_DFL_ENV);
  const CaptureProgress progress = [this](const std::string&, double, double) {
    const std::lock_guard lock(mutex_);
    if (cancelled_) throw Cancelled{};
  };
  std::string failure;
  try {
    CaptureSteps steps(plant_, CaptureDetail::columns, progress);
    while (const MotionTask* task = steps.next())
      phase_ = task->phase == "approach" || task->phase.starts_with("approach_") ? PlantOutputs::kApproach
                                                                                 : PlantOutputs::kAfterImpact;
    const CaptureResult result = steps.finish();
    if (result.status == CaptureStatus::completed) {
      conclude(result);
    } else {
      failure = result.failure.empty() ? "the run did not complete" : result.failure;
    }
  } catch (const Cancelled&) {
    failure = "the run was cancelled";
  } catch (const std::exception& error) {
    failure = error.what();
  }
  {
    const std::lock_guard lock(mutex_);
    failure_ = std::move(failure);
    at_ = At::end;
  }
  changed_.notify_all();
}

// At a sample: waits for the commands of the caller.
void PlantRun::arrive(const PlantOutputs& outputs, double time, std::vector<double>& inputs) {
  std::unique_lock lock(mutex_);
  event_outputs_ = outputs, event_time_ = time;
  at_ = At::sample;
  changed_.notify_all();
  changed_.wait(lock, [&] { return cancelled_ || at_ == At::work; });
  if (cancelled_) throw Cancelled{};
  inputs = inputs_;
}

// Collects the final results. The joints' references are those of the last sample.
void PlantRun::conclude(const CaptureResult& result) {
  const std::lock_guard lock(mutex_);
  PlantOutputs& out = event_outputs_;
  out.phase = PlantOutputs::kEnded;
  const std::optional<PhaseEnd>& end = result.post_impact_end ? result.post_impact_end : result.approach_end;
  if (end) {
    event_time_ = end->time;
    out["position"] = end->joints.position, out["rate"] = end->joints.velocity;
    const PlantOutputs::Motion base = motion_of(end->base);
    const Quaterniond& q = base.quaternion_wxyz;
    const auto set = [&](const char* signal, const Vector3d& x) { out[signal] = {x[0], x[1], x[2]}; };
    set("base_position", base.position), set("base_velocity", base.velocity);
    set("base_angular_velocity", base.angular_velocity);
    out["base_quaternion_wxyz"] = {q.w, q.x, q.y, q.z};
    out.targets.clear();
    for (const BodyMotion& target : end->targets) out.targets.push_back(motion_of(target));
  }
  std::vector<double>&wheels = out["wheel_rate"], &angles = out["gimbal_angle"], &held = out["target_held"];
  for (std::size_t w = 0; w < std::min(wheels.size(), result.wheels.size()); ++w)
    wheels[w] = result.wheels[w].rate_after;
  for (std::size_t g = 0; result.gyros && g < std::min(angles.size(), result.gyros->each.size()); ++g)
    angles[g] = result.gyros->each[g].angle_after;
  held.assign(plant_.targets.size(), 0);
  out.end = {};
  for (const GraspOutcome& grasp : result.grasps) {
    out.end.captured.push_back(grasp.captured);
    if (plant_.impact && grasp.captured && !grasp.released) held[target_index(plant_, grasp.target)] = 1;
  }
  out.end.captured.resize(plant_.grasps.size());
  out.end.ended = out.end.completed = true;
  out.end.conserved = result.ledger.pass();
  out.end.feasible = result.ledger.feasibility() == Verdict::yes;
  out.end.capture_time = result.capture_time;
  out.end.linear_momentum_drift = row_of(result.ledger, "linear_momentum_drift");
  out.end.angular_momentum_drift = row_of(result.ledger, "angular_momentum_drift");
  out.end.work_energy_residual = row_of(result.ledger, "work_energy_residual");
  out.end.energy_drift = row_of(result.ledger, "energy_drift");
  if (const ImpactReport* impact = result.impact())
    out.end.impact_energy_lost = impact->kinetic_energy_before - impact->kinetic_energy_after;
}

// --- The caller's thread ---

void PlantRun::await() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return at_ == At::sample || at_ == At::end; });
}

void PlantRun::begin() {
  if (at_ != At::nothing) throw std::logic_error("PlantRun: begun twice");
  at_ = At::work;
  worker_ = std::thread([this] { work(); });
  await();
  time_ = 0;
  take_events(0);
}

// Takes over the events up to this time.
void PlantRun::take_events(double until) {
  const std::lock_guard lock(mutex_);
  if (at_ == At::end && !failure_.empty()) throw PlantError(failure_);
  // Before the first sample, as in a compliant impact at t = 0, the first sample is shown.
  if (outputs_["time"].empty() || event_time_ <= until + kSame * period()) outputs_ = event_outputs_;
}

void PlantRun::step(double until, const std::vector<double>& inputs) {
  const double same = kSame * period();
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (at_ != At::sample || event_time_ >= until - same) break;
      inputs_ = inputs;
      at_ = At::work;
    }
    changed_.notify_all();
    await();
  }
  take_events(until);
  time_ = has_ended() ? event_time_ : until;
}

}  // namespace grapnel
