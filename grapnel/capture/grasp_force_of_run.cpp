#include <algorithm>
#include <cmath>

#include "grapnel/capture/coordinated_law.hpp"
#include "grapnel/capture/internal_loads.hpp"
#include "grapnel/control/grasp_force.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

class GraspForceOfRun : public CoordinatedLaw {
 public:
  explicit GraspForceOfRun(const CaptureProblem& problem)
      : CoordinatedLaw(LawReport::Law::grasp_force),
        problem_(problem),
        setup_(*problem.post_impact->grasp_force),
        target_(held_target(problem, setup_.target)) {}

  void begin_post_impact(const CaptureSystem&, const State&) override { begins_ = true; }

  bool has_work(const CaptureSystem& system) const override { return holds_of(system).size() >= 2; }

  std::shared_ptr<JointLaw> begin_segment(const CaptureSystem& system, const Model& law_model, const State& state,
                                          const State& known, double time) override {
    if (begins_) begin_ = time, begins_ = false;
    system_ = &system;
    kinematics_ = Kinematics(system.model);
    forward_kinematics(system.model, state, kinematics_);
    GraspForceLaw law;
    law.base = system.base;
    law.brakes = setup_.motion == GraspForceSetup::Motion::brake;
    law.rate = setup_.rate, law.torque = setup_.torque, law.moment_length = setup_.moment_length;
    std::vector<std::string> names;
    places_ = holds_of(system);
    for (const std::size_t place : places_) {
      const HeldGrasp& held = system.grasps[place];
      law.target = held.frames.body_b;
      law.holds.push_back({held.closure, held.frames.X_BD, held.frames.model, held.frames.hinge_C});
      names.push_back(problem_.grasps[held.grasp].end_effector);
    }
    pairs_.clear();
    for (std::size_t p = 0; p < setup_.pairs.size(); ++p) {
      const GraspForceSetup::Pair& pair = setup_.pairs[p];
      const auto a = std::find(names.begin(), names.end(), pair.between[0]);
      const auto b = std::find(names.begin(), names.end(), pair.between[1]);
      if (a == names.end() || b == names.end()) continue;  // released
      law.pairs.push_back({static_cast<std::size_t>(a - names.begin()), static_cast<std::size_t>(b - names.begin()),
                           pair.force, begin_ + pair.after, pair.ramp});
      pairs_.push_back(p);
    }
    LawScope scope{{}, system.closures, problem_.gravity, steady_joints(system)};
    for (const std::size_t j : joints_that_carry(problem_, system, target_)) {
      scope.joints.push_back(system.robot_joints[j]);
      law.damping.push_back(problem_.post_impact->kd[j]);
    }
    if (!X_BT_) {
      const Kinematics k = forward_kinematics(system.model, known);
      X_BT_ = inverse(k.X_WB[system.base]) * k.X_WB[law.target] * own_frame(system, law.target);
    }
    law.X_BT = *X_BT_ * inverse(own_frame(system, law.target));
    law_ = std::make_shared<GraspForce>(law_model, std::move(law), std::move(scope));
    if (!report_) describe_start(state, time);
    describe(state, time);
    return law_;
  }

  void note(const PhaseSample& sample, const JointLawCommand& command) override {
    note_command(sample.time, command);
    forward_kinematics(system_->model, sample.state, kinematics_);
    note_forces(sample);
    if (law_->law().brakes) return;
    const HoldDeviation d = hold_deviation(law_->law(), system_->model, kinematics_);
    report_->largest_distance = std::max(report_->largest_distance, d.distance);
    report_->largest_angle = std::max(report_->largest_angle, d.angle);
  }

  void describe(const State&, double time) override { report_->end = time; }

 private:
  // Grasps of the target that transmit loads, as indices in CaptureSystem::grasps.
  std::vector<std::size_t> holds_of(const CaptureSystem& system) const {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < system.grasps.size(); ++i) {
      const HeldGrasp& held = system.grasps[i];
      if (problem_.grasps[held.grasp].target == target_ && held.closure != HeldGrasp::kRedundant) places.push_back(i);
    }
    return places;
  }

  void describe_start(const State& state, double time) {
    LawReport& report = begin_report(time);
    report.target = target_;
    for (const GraspForceSetup::Pair& pair : setup_.pairs) report.pairs.push_back({pair.between, 0, 0, 0, time});
    law_->at(time, state, {});
    report.rank = law_->internal_rank();
  }

  // Records the loads of the grasps, from the loop solver, and their references.
  void note_forces(const PhaseSample& sample) {
    const GraspForceLaw& law = law_->law();
    const std::vector<GraspWrench> wrenches = wrenches_of_grasps(*system_, kinematics_, sample);
    Eigen::VectorXd f(6 * static_cast<Eigen::Index>(places_.size()));
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Wrenchd& on_robot = wrenches[places_[i]].F_WC;
      for (int k = 0; k < 3; ++k) {
        f[static_cast<Eigen::Index>(6 * i) + k] = -on_robot.angular[k] / law.moment_length;
        f[static_cast<Eigen::Index>(6 * i) + 3 + k] = -on_robot.linear[k];
      }
    }
    const GraspMap map = grasp_map(law, system_->model, kinematics_);
    const Eigen::VectorXd inside = map.internal_part(f);
    Eigen::VectorXd reference = Eigen::VectorXd::Zero(inside.size());
    for (std::size_t p = 0; p < law.pairs.size(); ++p)
      reference += squeeze_at(law.pairs[p], sample.time) * map.pairs.col(p);
    report_->other_internal_force = std::max(report_->other_internal_force, (inside - reference).norm());
    if (law.pairs.empty()) return;
    const Eigen::VectorXd squeeze = least_norm_solution(map.pairs, inside);
    for (std::size_t p = 0; p < law.pairs.size(); ++p) {
      LawReport::Squeeze& pair = report_->pairs[pairs_[p]];
      pair.reference = squeeze_at(law.pairs[p], sample.time), pair.force = squeeze[p];
      raise_to(pair.largest_error, pair.largest_error_time, std::abs(pair.force - pair.reference), sample.time);
    }
  }

  const CaptureProblem& problem_;
  const GraspForceSetup& setup_;
  const std::string target_;
  bool begins_ = false;
  double begin_ = 0;           // of post_impact
  std::optional<Posed> X_BT_;  // of the target's own frame, to be held
  // The current piece:
  const CaptureSystem* system_ = nullptr;
  std::vector<std::size_t> places_;  // of holds, in CaptureSystem::grasps
  std::vector<std::size_t> pairs_;   // of the law's pairs, in the setup
  std::shared_ptr<GraspForce> law_;
  Kinematics kinematics_;
};

}  // namespace

std::unique_ptr<CoordinatedLaw> grasp_force_of_run(const CaptureProblem& problem) {
  if (!problem.post_impact->grasp_force) return {};
  return std::make_unique<GraspForceOfRun>(problem);
}

}  // namespace grapnel
