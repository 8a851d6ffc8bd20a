// MuJoCo on the same robots and states in its fastest comparable configuration: no contacts, constraints, actuators,
// passive forces or sensors, one thread, no warm start.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "bench/dynamics_bench.hpp"
#include "bench/flexible_workload.hpp"
#include "bench/loop_workload.hpp"
#include "engines/mujoco_engine.hpp"
#include "engines/mujoco_load.hpp"
#include "grapnel/constraint/constrained_dynamics.hpp"

namespace grapnel::bench {
namespace {

// The closures as soft welds, nearly as stiff as MuJoCo allows (its default leaves a tenth of the relative
// acceleration).
std::string welds(const Model& model, const std::vector<LoopClosure>& closures) {
  std::string xml = "<equality>\n";
  for (const LoopClosure& c : closures) {
    const Posed X_AB = c.X_AC * inverse(c.X_BD);
    const Quaterniond r = quaternion_from(X_AB.R);
    xml += fmt::format(
        "<weld body1='{}' body2='{}' relpose='{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}' "
        "solimp='0.9999 0.9999 0.001'/>\n",
        model.bodies()[c.body_a].description.name, model.bodies()[c.body_b].description.name, X_AB.p[0], X_AB.p[1],
        X_AB.p[2], r.w, r.x, r.y, r.z);
  }
  return xml + "</equality>\n";
}
std::string described(const Model& model, const std::vector<LoopClosure>& closures) {
  std::string xml = testing::mjcf(model);
  if (!closures.empty()) xml.insert(xml.rfind("</mujoco>"), welds(model, closures));
  return xml;
}

// A workload in MuJoCo's coordinates: a free joint's velocity is [linear in W; angular in B], forces likewise. The
// robots here are one tree whose bodies Grapnel and MuJoCo list in the same order.
class Peer {
 public:
  explicit Peer(const Workload& workload, const std::vector<LoopClosure>& closures = {})
      : model_(testing::load_mjcf(described(workload.model, closures)), mj_deleteModel),
        data_(mj_makeData(model_.get()), mj_deleteData) {
    model_->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_PASSIVE | mjDSBL_ACTUATION | mjDSBL_SENSOR |
                                mjDSBL_WARMSTART | mjDSBL_GRAVITY;
    if (!closures.empty()) model_->opt.disableflags &= ~mjDSBL_CONSTRAINT;
    for (int i = 0; i < Workload::kCases; ++i) {
      const State& state = workload.states[i];
      const Rotationd R = root_pose(workload.model, state, 0).R;
      cases_.push_back({state.q, in_mujoco(R, state.v), in_mujoco(R, workload.forces[i].generalized)});
    }
    if (closures.empty()) {
      check(workload);
    } else {
      check_closed(workload, closures);
    }
  }

  void load_case(int i) {
    std::copy(cases_[i].q.begin(), cases_[i].q.end(), data_->qpos);
    std::copy(cases_[i].v.begin(), cases_[i].v.end(), data_->qvel);
    std::copy(cases_[i].force.begin(), cases_[i].force.end(), data_->qfrc_applied);
  }
  const mjModel* model() const { return model_.get(); }
  mjData* data() { return data_.get(); }

 private:
  struct Case {
    std::vector<double> q, v, force;
  };
  static std::vector<double> in_mujoco(const Rotationd& R, std::vector<double> v) {
    const Vector3d linear = R * Vector3d{v[3], v[4], v[5]};
    for (int k = 0; k < 3; ++k) v[3 + k] = v[k];
    for (int k = 0; k < 3; ++k) v[k] = linear[k];
    return v;
  }
  // Both must give the same result before they are timed.
  void check(const Workload& workload) {
    for (int i = 0; i < Workload::kCases; ++i) {
      load_case(i);
      mj_forward(model(), data());
      const std::vector<double> ours = forward_dynamics(workload.model, workload.states[i], workload.forces[i]);
      double difference = 0, size = 0;
      for (int v = 6; v < model()->nv; ++v) {
        difference = std::max(difference, std::abs(ours[v] - data_->qacc[v]));
        size = std::max(size, std::abs(ours[v]));
      }
      if (!(difference <= 1e-8 * size)) {
        throw std::runtime_error(fmt::format("{}: MuJoCo's joint accelerations differ by {:.3g} of {:.3g}",
                                             workload.name, difference, size));
      }
    }
  }

  // From rest, because MuJoCo omits the rate of the closures' Jacobian. Its welds are soft, so the comparison is
  // approximate.
  void check_closed(const Workload& workload, const std::vector<LoopClosure>& closures) {
    LoopSolver solver(workload.model, closures);
    Workspace workspace(workload.model);
    const std::vector<double> rest(workload.model.velocities());
    std::vector<double> ours(rest), force(rest);
    for (int i = 0; i < Workload::kCases; ++i) {
      load_case(i);
      std::fill_n(data_->qvel, model_->nv, 0.0);
      mj_forward(model(), data());
      DynamicsInput<double> in;
      in.q = workload.states[i].q, in.v = rest, in.force = workload.forces[i].generalized;
      solver.accelerations(in, 0, workspace, ours, force);
      double difference = 0, size = 0;
      for (int v = 6; v < model_->nv; ++v) {
        difference = std::max(difference, std::abs(ours[v] - data_->qacc[v]));
        size = std::max(size, std::abs(ours[v]));
      }
      if (!(difference <= 0.05 * size)) {
        throw std::runtime_error(fmt::format("{} welded: MuJoCo's joint accelerations differ by {:.3g} of {:.3g}",
                                             workload.name, difference, size));
      }
    }
  }

  std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model_;
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data_;
  std::vector<Case> cases_;
};

using Call = void (*)(const mjModel*, mjData*);

void mass_matrix(const mjModel* m, mjData* d) {
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_crb(m, d);
}
void bias(const mjModel* m, mjData* d) {
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_comVel(m, d);
  mj_rne(m, d, 0, d->qfrc_bias);
}

void add(const std::string& function, const std::shared_ptr<Peer>& peer, const std::string& workload, Call call) {
  benchmark::RegisterBenchmark(("mujoco:" + function + "/" + workload).c_str(), [=](benchmark::State& loop) {
    int i = 0;
    for (auto _ : loop) {
      peer->load_case(i);
      call(peer->model(), peer->data());
      benchmark::ClobberMemory();
      i = (i + 1) % Workload::kCases;
    }
  });
}

}  // namespace

void register_mujoco() {
  for (const Workload& workload : targets()) {
    const auto peer = std::make_shared<Peer>(workload);
    add("forward_dynamics", peer, workload.name, mj_forward);
    add("mass_matrix", peer, workload.name, mass_matrix);
    add("bias", peer, workload.name, bias);
  }
  for (const FlexibleWorkload& flexible : flexible_targets(Cut::middles)) {
    benchmark::AddCustomContext("mujoco:" + flexible.workload.name, flexible.description());
    add("forward_dynamics", std::make_shared<Peer>(flexible.workload), flexible.workload.name, mj_forward);
  }
  for (const Workload& workload : chains()) {
    if (workload.model.bodies().size() > 90) break;  // MuJoCo's XML parser refuses elements nested deeper than 100
    add("forward_dynamics", std::make_shared<Peer>(workload), workload.name, mj_forward);
  }
}

void register_mujoco_loops() {
  for (const LoopWorkload& loops : loop_targets()) {
    add("loop_dynamics", std::make_shared<Peer>(loops.base, loops.closures), loops.base.name, mj_forward);
  }
  for (const LoopWorkload& loops : more_loops()) {
    add("loop_dynamics", std::make_shared<Peer>(loops.base, loops.closures), loops.base.name, mj_forward);
  }
}

}  // namespace grapnel::bench
