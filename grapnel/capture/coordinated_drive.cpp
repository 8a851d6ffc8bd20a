#include "grapnel/capture/coordinated_drive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

// Times that differ by less are equal [s].
double resolution_at(double time) {
  return 64 * std::numeric_limits<double>::epsilon() * std::max(1.0, std::abs(time));
}

}  // namespace

CoordinatedDrive::CoordinatedDrive(std::shared_ptr<JointLaw> law, const CaptureSystem& system, double begin,
                                   std::shared_ptr<ControlClock> clock, SensorRun* sensors)
    : law_(std::move(law)), system_(system), begin_(begin), clock_(std::move(clock)), sensors_(sensors) {
  if (sensors_) sensors_->begin_segment(system_);
}

double CoordinatedDrive::next_break(double t) const {
  double next = std::numeric_limits<double>::infinity();
  if (!clock_) return next;
  const double now = begin_ + t, after = now + resolution_at(now);
  for (const double time : clock_->break_times(after, after + 2 * clock_->timing().period))
    next = std::min(next, time - begin_);
  return next;
}

// Time since the impact's start, state, contact wrenches => new held command (6.14) if this is a sample time; the law
// receives sensor readings and sensed wrenches. Nothing for a continuous law.
void CoordinatedDrive::begin_segment(double t, const State& state, std::span<const ExternalWrench> wrenches) {
  const double now = begin_ + t, same = resolution_at(now);
  if (!clock_ || !clock_->tick(now, same)) return;
  law_->sense(wrenches);
  State seen = state;
  if (sensors_) sensors_->read_motion(now, state, seen);
  const JointLawCommand law_command = law_->at(now, seen, {});
  ControlClock::Command command{std::vector<double>(clock_->channels()), Vector3d::zero()};
  for (std::size_t j = 0; j < law_->joints().size(); ++j) {
    const auto at = std::find(system_.robot_joints.begin(), system_.robot_joints.end(), law_->joints()[j]);
    command.effort[at - system_.robot_joints.begin()] = law_command.effort[j];
  }
  clock_->command(std::move(command), now, same);
}

// Time since the impact's start, state, contact wrenches => efforts [N m or N] per velocity: the held command (6.14) of
// a sampled law, otherwise the law's output at this state.
void CoordinatedDrive::efforts(double t, const State& state, std::span<const ExternalWrench> wrenches,
                               std::span<double> effort) {
  const Model& model = system_.model;
  const auto velocity_of = [&](int joint) { return static_cast<std::size_t>(model.joint_body(joint).v); };
  if (clock_) {
    for (std::size_t c = 0; c < system_.robot_joints.size(); ++c)
      effort[velocity_of(system_.robot_joints[c])] = clock_->held().effort[c];
    return;
  }
  law_->sense(wrenches);
  const Eigen::VectorXd law_efforts = law_->efforts(begin_ + t, state);
  for (std::size_t j = 0; j < law_->joints().size(); ++j) effort[velocity_of(law_->joints()[j])] = law_efforts[j];
}

}  // namespace grapnel
