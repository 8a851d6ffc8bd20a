#include "engines/mujoco_rollout.hpp"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <string>

#include "engines/mujoco_engine.hpp"
#include "engines/mujoco_load.hpp"
#include "grapnel/dynamics/state.hpp"

namespace grapnel::testing {
namespace {

Rotationd rotation_at(const double* quaternion) {
  return rotation_matrix(Quaterniond{quaternion[0], quaternion[1], quaternion[2], quaternion[3]});
}

}  // namespace

MujocoRollout::MujocoRollout(const Model& model, double step, bool rk4)
    : grapnel_(model), model_(load_mjcf(mjcf(model))), data_(mj_makeData(model_)) {
  model_->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_PASSIVE | mjDSBL_ACTUATION | mjDSBL_SENSOR |
                              mjDSBL_WARMSTART | mjDSBL_GRAVITY;
  model_->opt.timestep = step;
  model_->opt.integrator = rk4 ? mjINT_RK4 : mjINT_EULER;
  for (const Body& body : model.bodies()) {
    const int own = mj_name2id(model_, mjOBJ_BODY, body.description.name.c_str());
    const bool moves = model_->body_jntnum[own] > 0;
    const int joint = model_->body_jntadr[own];
    places_.push_back({moves ? model_->jnt_qposadr[joint] : -1, moves ? model_->jnt_dofadr[joint] : -1});
  }
  for (const int body : model.joints()) driven_.push_back(places_[static_cast<std::size_t>(body)].v);
}

MujocoRollout::~MujocoRollout() {
  mj_deleteData(data_);
  mj_deleteModel(model_);
}

int MujocoRollout::state_size() const { return grapnel_.coordinates() + grapnel_.velocities(); }
int MujocoRollout::control_size() const { return static_cast<int>(driven_.size()); }

// A free joint's velocity is [linear in W; angular in B].
void MujocoRollout::put(std::span<const double> initial) {
  mj_resetData(model_, data_);
  const double *q = initial.data(), *v = q + grapnel_.coordinates();
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& body = grapnel_.bodies()[i];
    const JointType type = body.description.joint.type;
    const Place& at = places_[i];
    for (int k = 0; k < coordinate_count(type); ++k) data_->qpos[at.q + k] = q[body.q + k];
    if (type == JointType::free) {
      const Vector3d linear = rotation_at(q + body.q + 3) * Vector3d{v[body.v + 3], v[body.v + 4], v[body.v + 5]};
      for (int k = 0; k < 3; ++k) data_->qvel[at.v + k] = linear[k], data_->qvel[at.v + 3 + k] = v[body.v + k];
    } else {
      for (int k = 0; k < velocity_count(type); ++k) data_->qvel[at.v + k] = v[body.v + k];
    }
  }
}

void MujocoRollout::get(double* state) const {
  double *q = state, *v = state + grapnel_.coordinates();
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Body& body = grapnel_.bodies()[i];
    const JointType type = body.description.joint.type;
    const Place& at = places_[i];
    for (int k = 0; k < coordinate_count(type); ++k) q[body.q + k] = data_->qpos[at.q + k];
    if (type == JointType::free) {
      const double* linear = data_->qvel + at.v;
      const Vector3d in_B = transposed_times(rotation_at(q + body.q + 3), Vector3d{linear[0], linear[1], linear[2]});
      for (int k = 0; k < 3; ++k) v[body.v + k] = data_->qvel[at.v + 3 + k], v[body.v + 3 + k] = in_B[k];
    } else {
      for (int k = 0; k < velocity_count(type); ++k) v[body.v + k] = data_->qvel[at.v + k];
    }
  }
}

void MujocoRollout::step(const double* control) {
  for (std::size_t j = 0; j < driven_.size(); ++j) data_->qfrc_applied[driven_[j]] = control[j];
  mj_step(model_, data_);
}

void MujocoRollout::run(std::span<const double> initial, std::span<const double> control, std::span<double> states) {
  put(initial);
  const std::size_t controls = driven_.size(), size = static_cast<std::size_t>(state_size());
  for (std::size_t i = 0; i * size < states.size(); ++i) {
    step(control.data() + i * controls);
    get(states.data() + i * size);
  }
}

void MujocoRollout::run_as_it_is(std::span<const double> initial, std::span<const double> control,
                                 std::span<double> states) {
  put(initial);
  const std::size_t controls = driven_.size(), size = static_cast<std::size_t>(state_size());
  for (std::size_t i = 0; i * size < states.size(); ++i) {
    step(control.data() + i * controls);
    double* const out = states.data() + i * size;
    std::copy_n(data_->qpos, model_->nq, out);
    std::copy_n(data_->qvel, model_->nv, out + model_->nq);
  }
}

}  // namespace grapnel::testing
