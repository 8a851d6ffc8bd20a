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
  if (sensors_) sensors_->begin_piece(system_);
}

double CoordinatedDrive::next_break(double t) const {
  double next = std::numeric_limits<double>::infinity();
  if (!clock_) return next;
  const double now = begin_ + t, after = now + resolution_at(now);
  for (const double time : clock_->break_times(after, after + 2 * clock_->timing().period))
    next = std::min(next, time - begin_);
  return next;
}

void CoordinatedDrive::begin_piece(double t, const State& state, std::span<const ExternalWrench> wrenches) {
  const double now = begin_ + t, same = resolution_at(now);
  if (!clock_ || !clock_->tick(now, same)) return;
  law_->sense(wrenches);
  State seen = state;
  if (sensors_) sensors_->read_motion(now, state, seen);
  const JointLawCommand said = law_->at(now, seen, {});
  ControlClock::Command command{std::vector<double>(clock_->channels()), Vector3d::zero()};
  for (std::size_t j = 0; j < law_->joints().size(); ++j) {
    const auto at = std::find(system_.robot_joints.begin(), system_.robot_joints.end(), law_->joints()[j]);
    command.effort[static_cast<std::size_t>(at - system_.robot_joints.begin())] =
        said.effort[static_cast<Eigen::Index>(j)];
  }
  clock_->command(std::move(command), now, same);
}

void CoordinatedDrive::efforts(double t, const State& state, std::span<const ExternalWrench> wrenches,
                               std::span<double> effort) {
  const Model& model = system_.model;
  const auto velocity_of = [&](int joint) { return static_cast<std::size_t>(model.bodies()[model.joints()[joint]].v); };
  if (clock_) {
    for (std::size_t c = 0; c < system_.robot_joints.size(); ++c)
      effort[velocity_of(system_.robot_joints[c])] = clock_->held().effort[c];
    return;
  }
  law_->sense(wrenches);
  const Eigen::VectorXd said = law_->efforts(begin_ + t, state);
  for (std::size_t j = 0; j < law_->joints().size(); ++j)
    effort[velocity_of(law_->joints()[j])] = said[static_cast<Eigen::Index>(j)];
}

}  // namespace grapnel
