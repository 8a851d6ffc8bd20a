#pragma once

/// @file
/// A Grapnel model in MuJoCo, with MuJoCo's results in Grapnel's coordinates.

#include <Eigen/Core>
#include <string>

#include "grapnel/dynamics/forward_dynamics.hpp"

struct mjModel_;
struct mjData_;

namespace grapnel::testing {

/// MuJoCo counts a free joint's velocity as [linear in W; angular in B], so that its linear acceleration is that of the
/// body's origin: v_mj = T v with T = [0 R; 1 0] on a free root's rows. Everywhere else the coordinates agree.
class MujocoEngine {
 public:
  explicit MujocoEngine(const Model& model);
  ~MujocoEngine();
  MujocoEngine(const MujocoEngine&) = delete;
  MujocoEngine& operator=(const MujocoEngine&) = delete;

  /// Accelerations of Grapnel's velocities.
  std::vector<double> acceleration(const State& state, const Forces& forces);
  /// Mass matrix and bias (with gravity, without external wrenches) after `acceleration`, in Grapnel's coordinates.
  Eigen::MatrixXd mass_matrix() const;
  Eigen::VectorXd bias() const;

 private:
  struct Place {
    int body, q, v;  // MuJoCo's numbers for each of Grapnel's bodies
  };
  const Model& grapnel_;
  mjModel_* model_ = nullptr;
  mjData_* data_ = nullptr;
  std::vector<Place> places_;
  State state_;
};

/// The model as MJCF.
std::string mjcf(const Model& model);

}  // namespace grapnel::testing
