#include "grapnel/capture/identification_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {
namespace {

std::size_t named_or_only(const CaptureProblem& problem, const std::string& name) {
  for (const GraspSetup& grasp : problem.grasps) {
    if (!grasp.contact && (name.empty() || grasp.target == name)) return target_index(problem, grasp.target);
  }
  return 0;
}

const char* word(Identified how) {
  return how == Identified::determined ? "determined" : how == Identified::ratio_only ? "ratio_only" : "not_determined";
}

}  // namespace

// System, target, inertia in the target's axes about its centre of mass => copy of the model with these values for the
// target's body; frames and other bodies are unchanged.
std::shared_ptr<const Model> with_inertia(const CaptureSystem& system, std::size_t target,
                                          const TargetInertia& inertia) {
  const Model& model = system.model;
  const int body = model.frames()[system.target_frames[target]].body;
  const Posed X_BT = own_frame(system, body);  // the target's frame in the body's
  ModelBuilder builder;
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    BodyDescription description = model.bodies()[i].description;
    if (static_cast<int>(i) == body) {
      description.mass = inertia.mass;
      description.com = X_BT * inertia.com;
      description.inertia = rotate(X_BT.R, inertia.inertia);
    }
    builder.add(std::move(description));
  }
  for (const Frame& frame : model.frames())
    builder.add(FrameDescription{frame.name, model.bodies()[frame.body].description.name, frame.X_BE});
  return std::make_shared<const Model>(std::move(builder).build());
}

// Sensor setup => standard deviations of angular velocity and joint rates [rad/s], with quantization q as variance
// q^2/12 (20.8) and differences of positions by (20.2); zero without sensors.
RateNoise rate_noise_of(const CaptureProblem& problem) {
  RateNoise noise;
  if (!problem.sensors || !problem.control) return noise;
  const double period = problem.control->timing.period;
  // Adds rounding as noise of the same variance.
  const auto with_rounding = [](double deviation, double quantum) {
    return std::sqrt(deviation * deviation + quantum * quantum / 12);
  };
  if (const auto& gyro = problem.sensors->gyro)
    noise.angular_velocity = with_rounding(gyro->deviation(period), gyro->quantum);
  if (const auto& wheels = problem.sensors->wheels) noise.joint_rate = with_rounding(wheels->noise, wheels->quantum);
  if (const auto& joints = problem.sensors->joints) {
    double rate = 0;
    if (joints->rate == JointSensors::Rate::sensor) rate = with_rounding(joints->rate_noise, joints->rate_quantum);
    if (joints->rate == JointSensors::Rate::difference)
      rate = std::sqrt(2.0) * with_rounding(joints->noise, joints->position_quantum()) /
             (joints->sample_time > 0 ? joints->sample_time : period);
    noise.joint_rate = std::max(noise.joint_rate, rate);
  }
  return noise;
}

// Problem => assumed inertia (unspecified values are the true ones), target, sampling interval in control periods, and
// the model that control laws use.
IdentificationRun::IdentificationRun(const CaptureProblem& problem) : problem_(problem) {
  if (!problem.post_impact) return;
  const PostImpactSetup& post = *problem.post_impact;
  if (post.assumed) {
    assumed_target_ = named_or_only(problem, post.assumed->target);
    const TargetSetup& truth = problem.targets[assumed_target_];
    assumed_ = TargetInertia{post.assumed->mass.value_or(truth.mass), post.assumed->com.value_or(truth.com),
                             post.assumed->inertia.value_or(truth.inertia)};
  }
  setup_ = post.identify;
  if (setup_) {
    target_ = named_or_only(problem, post.identify->target);
    const double sample_time = post.identify->sample_time;
    if (problem.control && sample_time > 0)
      every_ = std::max(1L, std::lround(sample_time / problem.control->timing.period));
  }
  model_ = post.model.value_or(post.identify  ? LawModel::estimated
                               : post.assumed ? LawModel::assumed
                                              : LawModel::truth);
}

void IdentificationRun::begin_post_impact(double time) {
  if (!problem_.post_impact->identify) return;  // it belongs to a later phase
  begin_ = time + setup_->from;
  end_ = begin_ + setup_->duration;
}

bool IdentificationRun::is_held(const CaptureSystem& system) const {
  return std::any_of(system.grasps.begin(), system.grasps.end(), [&](const HeldGrasp& g) {
    return problem_.grasps[g.grasp].target == problem_.targets[target_].name;
  });
}

void IdentificationRun::begin_segment(const CaptureSystem& system, double time) {
  std::vector<std::size_t> grasps;
  for (const HeldGrasp& grasp : system.grasps) grasps.push_back(grasp.grasp);
  if (grasps == grasps_) return;
  grasps_ = std::move(grasps);
  if (report_ && report_->ended == IdentificationEnd::running && !is_held(system)) {
    report_->ended = IdentificationEnd::released, report_->end = time;
    begin_ = end_ = std::numeric_limits<double>::infinity();
  }
  if (report_ && report_->ended == IdentificationEnd::running) report_.reset();
  samples_.clear();
}

std::shared_ptr<const Model> IdentificationRun::law_model(const CaptureSystem& system) const {
  if (system.grasps.empty() || model_ == LawModel::truth) return nullptr;
  if (model_ == LawModel::estimated && estimated_) return with_inertia(system, target_, *estimated_);
  return assumed_ ? with_inertia(system, assumed_target_, *assumed_) : nullptr;
}

// Sensor readings at a control sample => one measurement [seen state; external impulse since the first] within the
// identification window while the target is held; the first one also sets the servicer's initial momentum (16.4).
void IdentificationRun::take(const CaptureSystem& system, const PhaseSample& sample, const State& seen) {
  const double period = problem_.control->timing.period, rounding = 1e-6 * period;
  if (sample.time < begin_ - rounding || sample.time >= end_ - rounding || !is_held(system)) return;
  if (std::lround(sample.time / period) % every_ != 0) return;
  const Momentumd impulse = finished_impulse_ + sample.integrals.external_impulse;
  if (samples_.empty()) {
    first_impulse_ = impulse;
    report_.emplace();
    report_->target = problem_.targets[target_].name;
    report_->begin = sample.time;
    const std::array<int, 1> root = {system.base};
    const Kinematics k = forward_kinematics(system.model, sample.state);
    const bool turning = setup_->base == IdentifySetup::Base::rotation;
    first_momentum_ =
        momentum_about(system.model, k, turning ? center_of_mass(system.model, k, root) : Vector3d::zero(), root);
  }
  report_->end = sample.time;
  samples_.push_back({seen, {impulse.angular - first_impulse_.angular, impulse.linear - first_impulse_.linear}});
  report_->samples = static_cast<long>(samples_.size());
}

void IdentificationRun::end_segment(const PhaseIntegrals& integrals) {
  finished_impulse_ += integrals.external_impulse;
}

double IdentificationRun::next_event() const {
  return report_ && report_->ended != IdentificationEnd::running ? std::numeric_limits<double>::infinity() : end_;
}

IdentificationTask IdentificationRun::task(const CaptureSystem& system) const {
  IdentificationTask task{system.model, system.target_frames[target_], samples_};
  if (setup_->base == IdentifySetup::Base::rotation) task.base = MeasuredBase::rotation;
  if (setup_->momentum_known) task.momentum = first_momentum_;
  task.noise = rate_noise_of(problem_);
  return task;
}

void IdentificationRun::conclude(const CaptureSystem& system, double time) {
  if (time < end_ - 1e-9 * std::max(1.0, time) || samples_.empty()) return;
  begin_ = end_ = std::numeric_limits<double>::infinity();
  const IdentifiedBody found = identify_target(task(system));
  samples_.clear();
  samples_.shrink_to_fit();
  report(found);
  if (!found.all_determined() || !found.impossible.empty()) return;
  const auto at = [&](int i) { return *found.value[i]; };
  estimated_ = TargetInertia{at(0), {at(1), at(2), at(3)}, {at(4), at(5), at(6), at(7), at(8), at(9)}};
  if (model_ == LawModel::estimated) report_->used_from = time;
}

// Estimate => report: rank, condition, residual, determined parameters with deviation and true value [kg, m, kg m^2],
// and causes of undetermined ones.
void IdentificationRun::report(const IdentifiedBody& found) {
  IdentificationReport& r = *report_;
  r.ended = IdentificationEnd::done;
  r.converged = found.converged, r.rank = found.rank;
  r.condition = found.condition, r.residual = found.residual;
  r.mass = word(found.mass), r.com = word(found.com), r.inertia = word(found.inertia);
  r.impossible = found.impossible;
  const TargetSetup& truth = problem_.targets[target_];
  const Symmetric3d& I = truth.inertia;
  const InertialParameters values{truth.mass, truth.com[0], truth.com[1], truth.com[2], I.xx,
                                  I.yy,       I.zz,         I.xy,         I.xz,         I.yz};
  for (int i = 0; i < kInertialParameters; ++i) {
    const auto k = static_cast<std::size_t>(i);
    r.parameters.push_back({std::string(inertial_parameter_name(i)),
                            i == 0  ? "kg"
                            : i < 4 ? "m"
                                    : "kg m^2",
                            found.value[k], found.deviation[k], values[k]});
  }
  for (const UnseenChange& unseen : found.unseen) r.unseen.push_back(unseen_text(unseen));
}

void IdentificationRun::write(CaptureResult& result) const { result.identification = report_; }

}  // namespace grapnel
