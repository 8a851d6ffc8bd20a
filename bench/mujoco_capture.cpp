// The thesis's capture with MuJoCo's Runge-Kutta method: the same robot, targets, references and torques. For the
// second phase, the targets are welded to the arms, with Grapnel's post-impact velocities, because MuJoCo does not
// compute them. Only the stepping is timed, at the largest step of a sequence that meets the end-state error.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include "bench/capture_workload.hpp"
#include "bench/dynamics_bench.hpp"
#include "engines/mujoco_engine.hpp"
#include "engines/mujoco_load.hpp"

namespace grapnel::bench {
namespace {

using ModelPointer = std::unique_ptr<mjModel, decltype(&mj_deleteModel)>;

// PD torques along references (4.1).
struct Controller {
  struct Joint {
    int q, v;
    double kp, kd;
    JointTrajectory reference;
  };
  std::vector<Joint> joints;
};
const Controller* controller = nullptr;  // of the model that is stepped
void control(const mjModel*, mjData* data) {
  if (!controller) return;
  for (const Controller::Joint& joint : controller->joints) {
    const JointPoint to = evaluate(joint.reference, data->time);
    data->qfrc_applied[joint.v] =
        joint.kp * (to.position - data->qpos[joint.q]) + joint.kd * (to.rate - data->qvel[joint.v]);
  }
}

// One phase of motion. In MuJoCo a free joint's velocity is [linear in W; angular in B].
class Phase {
 public:
  explicit Phase(const Model& model)
      : grapnel_(model),
        model_(testing::load_mjcf(testing::mjcf(model)), mj_deleteModel),
        data_(mj_makeData(model_.get()), mj_deleteData) {
    model_->opt.integrator = mjINT_RK4;
    // Actuation stays enabled: it calls the controller.
    model_->opt.disableflags |=
        mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_PASSIVE | mjDSBL_SENSOR | mjDSBL_WARMSTART | mjDSBL_GRAVITY;
    for (const Body& b : model.bodies()) {
      const int body = mj_name2id(model_.get(), mjOBJ_BODY, b.description.name.c_str());
      const bool moves = model_->body_jntnum[body] > 0;
      const int joint = model_->body_jntadr[body];
      places_.push_back({moves ? model_->jnt_qposadr[joint] : -1, moves ? model_->jnt_dofadr[joint] : -1});
    }
  }

  void drive(const CaptureWorkload& workload) {
    for (std::size_t j = 0; j < workload.joints.size(); ++j) {
      const Place& at = places_[grapnel_.joints()[workload.free.robot_joints[j]]];
      const TrackingSetup& tracking = workload.problem.approach->tracking;
      controller_.joints.push_back({at.q, at.v, tracking.kp[j], tracking.kd[j], workload.joints[j]});
    }
  }

  void start_at(const State& state) {
    q_.assign(model_->nq, 0), v_.assign(model_->nv, 0);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Body& b = grapnel_.bodies()[i];
      const Place& at = places_[i];
      const JointType type = b.description.joint.type;
      std::copy_n(state.q.begin() + b.q, coordinate_count(type), q_.begin() + std::max(at.q, 0));
      if (type != JointType::free) {
        std::copy_n(state.v.begin() + b.v, velocity_count(type), v_.begin() + std::max(at.v, 0));
        continue;
      }
      const Vector3d velocity = root_twist(grapnel_, state, static_cast<int>(i)).linear;
      for (int k = 0; k < 3; ++k) v_[at.v + k] = velocity[k], v_[at.v + 3 + k] = state.v[b.v + k];
    }
  }

  // Steps from the start over a time that is a multiple of the step.
  void run(double duration, double step) {
    mjData* data = data_.get();
    data->time = 0;
    std::copy(q_.begin(), q_.end(), data->qpos);
    std::copy(v_.begin(), v_.end(), data->qvel);
    controller = controller_.joints.empty() ? nullptr : &controller_;
    model_->opt.timestep = step;
    for (long k = std::lround(duration / step); k > 0; --k) mj_step(model_.get(), data);
  }

  State state() const {
    State state = zero_state(grapnel_);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Body& b = grapnel_.bodies()[i];
      const Place& at = places_[i];
      const JointType type = b.description.joint.type;
      if (at.q < 0) continue;
      std::copy_n(data_->qpos + at.q, coordinate_count(type), state.q.begin() + b.q);
      std::copy_n(data_->qvel + at.v, velocity_count(type), state.v.begin() + b.v);
      if (type != JointType::free) continue;
      const Rotationd R = root_pose(grapnel_, state, static_cast<int>(i)).R;
      const double* v = data_->qvel + at.v;
      set_root_twist(grapnel_, static_cast<int>(i), {R * Vector3d{v[3], v[4], v[5]}, {v[0], v[1], v[2]}}, state);
    }
    return state;
  }

 private:
  struct Place {
    int q, v;
  };
  const Model& grapnel_;
  ModelPointer model_;
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data_;
  std::vector<Place> places_;
  std::vector<double> q_, v_;
  Controller controller_;
};

// Both phases with one step size.
class CapturePeer {
 public:
  CapturePeer(const CaptureWorkload& workload, double step)
      : before_(workload.problem.approach->duration),
        after_(workload.problem.post_impact->duration),
        step_(step),
        approach_(workload.free.model) {
    approach_.drive(workload);
    approach_.start_at(workload.start);
    approach_.run(before_, step_);
    joined_ = std::make_unique<CapturedSystem>(weld(workload, approach_.state()));
    post_impact_ = std::make_unique<Phase>(joined_->system.model);
    post_impact_->start_at(joined_->state);
    post_impact_->run(after_, step_);
    error_ = end_error(workload, end_numbers(joined_->system, post_impact_->state()));
  }
  void run() {
    approach_.run(before_, step_);
    post_impact_->run(after_, step_);
  }
  double error() const { return error_; }

 private:
  double before_, after_, step_;
  Phase approach_;
  std::unique_ptr<CapturedSystem> joined_;
  std::unique_ptr<Phase> post_impact_;
  double error_ = 0;
};

}  // namespace

void register_mujoco_capture() {
  mjcb_control = control;
  const CaptureWorkload workload = thesis_capture();
  std::shared_ptr<CapturePeer> peer;
  // Steps that divide the durations of both phases, each about 5 % shorter than the previous one.
  for (int steps = 400; steps < 20000; steps += steps / 20) {
    peer = std::make_shared<CapturePeer>(workload, 10.0 / steps);
    if (peer->error() <= kEndError) {
      fmt::print(stderr, "mujoco:capture/thesis1: step {:.4g} s, end-state error {:.2g}\n", 10.0 / steps,
                 peer->error());
      break;
    }
  }
  if (!(peer->error() <= kEndError)) throw std::runtime_error("MuJoCo does not reach the end state");
  benchmark::RegisterBenchmark("mujoco:capture/thesis1", [peer](benchmark::State& state) {
    for (auto _ : state) peer->run();
  });
}

}  // namespace grapnel::bench
