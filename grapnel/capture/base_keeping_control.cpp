#include "grapnel/capture/coordinated_law.hpp"
#include "grapnel/control/base_keeping.hpp"

namespace grapnel {
namespace {

// Threshold of the joints' influence on the base's rotation at the start of the law; smaller values are rounding
// errors.
constexpr double kNoTurning = 1e-9;

class BaseKeepingControl : public CoordinatedLaw {
 public:
  explicit BaseKeepingControl(const CaptureProblem& problem)
      : CoordinatedLaw(LawReport::Law::base_keeping), problem_(problem) {}

  void begin_post_impact(const CaptureSystem& system, const State& known) override {
    R_WD_ = root_pose(system.model, known, system.base).R;
  }

  std::shared_ptr<JointLaw> begin_segment(const CaptureSystem& system, const Model& law_model, const State& state,
                                          const State&, double time) override {
    system_ = &system;
    const KeepBaseSetup setup = problem_.post_impact->keep_base_attitude.value_or(KeepBaseSetup{});
    law_ = BaseKeepingLaw{system.base, setup.R_WD.value_or(R_WD_), setup.rate, setup.posture, setup.posture_rate};
    if (!report_) describe_start(state, time);
    law_.rank = report_->rank;
    return std::make_shared<BaseKeeping>(law_model, law_,
                                         LawScope{system.robot_joints, {}, problem_.gravity, steady_joints(system)});
  }

  void note(const PhaseSample& sample, const JointLawCommand& command) override {
    note_command(sample.time, command);
    const Rotationd R_WB = root_pose(system_->model, sample.state, system_->base).R;
    raise_to(report_->largest_angle, report_->largest_angle_time, norm(attitude_deviation(law_, R_WB)), sample.time);
  }

  void describe(const State& state, double time) override {
    const Kinematics kinematics = forward_kinematics(system_->model, state);
    report_->end = time;
    report_->angle_after = norm(attitude_deviation(law_, kinematics.X_WB[system_->base].R));
    report_->angular_velocity_after = norm(kinematics.V_WB[system_->base].angular);
  }

 private:
  void describe_start(const State& state, double time) {
    EffortResponse response(system_->model, system_->robot_joints, {}, steady_joints(*system_));
    const BaseKeepingCommand first = base_keeping_command(law_, state, {}, problem_.gravity, response);
    LawReport& report = begin_report(time);
    for (int i = 0; i < 3; ++i) report.rank += first.singular_values[i] > kNoTurning * first.singular_values[0];
    describe(state, time);
  }

  const CaptureProblem& problem_;
  const CaptureSystem* system_ = nullptr;
  Rotationd R_WD_ = Rotationd::identity();
  BaseKeepingLaw law_;  // of the current piece
};

}  // namespace

std::unique_ptr<CoordinatedLaw> base_keeping_of_run(const CaptureProblem& problem) {
  return std::make_unique<BaseKeepingControl>(problem);
}

}  // namespace grapnel
