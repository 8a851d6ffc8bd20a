#pragma once

/// @file
/// MuJoCo's steps of a Grapnel model under given joint efforts: what its `rollout` does with one case, on one thread.

#include <memory>
#include <span>
#include <vector>

#include "grapnel/model/model.hpp"

struct mjModel_;
struct mjData_;

namespace grapnel::testing {

class MujocoRollout {
 public:
  /// rk4: MuJoCo's integrator RK4, else Euler (semi-implicit). Contacts, constraints, actuators, passive forces,
  /// sensors and warm starts are off: its leanest honest form.
  MujocoRollout(const Model& model, double step, bool rk4);
  ~MujocoRollout();
  MujocoRollout(const MujocoRollout&) = delete;
  MujocoRollout& operator=(const MujocoRollout&) = delete;

  int state_size() const;    // of Grapnel's [q; v]
  int control_size() const;  // efforts per step

  /// One case: `initial` [q; v], `control` steps x joints; `states` steps x [q; v] after each step, in Grapnel's
  /// coordinates.
  void run(std::span<const double> initial, std::span<const double> control, std::span<double> states);
  /// As run(), with states in MuJoCo's format, as its own rollout returns them; used for timing.
  void run_as_it_is(std::span<const double> initial, std::span<const double> control, std::span<double> states);

 private:
  struct Place {
    int q, v;  // MuJoCo's numbers for each of Grapnel's bodies
  };
  void put(std::span<const double> initial);
  void get(double* state) const;
  void step(const double* control);

  const Model& grapnel_;
  mjModel_* model_ = nullptr;
  mjData_* data_ = nullptr;
  std::vector<Place> places_;
  std::vector<int> driven_;  // MuJoCo's velocities of the joints
};

}  // namespace grapnel::testing
