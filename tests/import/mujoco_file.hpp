#pragma once

/// @file
/// A model that MuJoCo reads from an MJCF or URDF file, with results in Grapnel's coordinates.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/dynamics/state.hpp"
#include "support/worst.hpp"

struct mjModel_;
struct mjData_;

namespace grapnel::testing {

/// Joints are matched by name, a floating base by the name of its body.
class MujocoFile {
 public:
  /// @throws std::runtime_error with MuJoCo's message if it does not read the file.
  explicit MujocoFile(const std::filesystem::path& file);
  ~MujocoFile();
  MujocoFile(const MujocoFile&) = delete;
  MujocoFile& operator=(const MujocoFile&) = delete;

  /// Sets the state and evaluates MuJoCo's model without gravity. `base`: MuJoCo's name of the floating base's body.
  void set_state(const Model& model, const std::string& base, const State& state);
  /// The mass matrix in Grapnel's velocities, after set_state().
  Eigen::MatrixXd mass_matrix() const;
  Eigen::VectorXd bias() const;
  /// Jacobian of the equality constraints in Grapnel's velocities, and their defects.
  Eigen::MatrixXd equality_rows() const;
  Eigen::VectorXd equality_defects() const;
  Posed body_pose(const std::string& body) const;  // in the world
  Posed site_pose(const std::string& site) const;
  /// The number of velocities of MuJoCo's model.
  int velocities() const;

  struct JointData {
    double damping, frictionloss, armature;
    bool limited;
    double lower, upper;
  };
  JointData joint_of(const std::string& body) const;

  struct GeomData {
    int type;  // mjtGeom
    Vector3d size;
    Posed X_BG;
    std::vector<Vector3d> vertices;  // of a mesh, in the body's frame
  };
  std::vector<GeomData> geoms_of(const std::string& body) const;
  struct MassData {
    double mass;
    Vector3d com;         // in the body's frame
    Symmetric3d inertia;  // about the centre of mass, in the axes of the body's frame
  };
  MassData mass_of(const std::string& body) const;
  std::vector<std::string> site_names() const;

 private:
  int body_id(const std::string& body) const;
  int joint_id(const std::string& joint) const;

  mjModel_* model_ = nullptr;
  mjData_* data_ = nullptr;
  Eigen::MatrixXd T_;       // v_mj = T v: rows of MuJoCo's velocities, columns of Grapnel's
  Eigen::VectorXd turned_;  // dT/dt v
};

/// MuJoCo stores inertias as principal moments and axes. For bodies with products of inertia, several geoms or fused
/// links it computes the axes by Jacobi rotations, and stops at a rotation below 1.4e-6 rad. The relative error of
/// these tensors is up to this value; masses and centres of mass agree to rounding error.
constexpr double kTurnedAxes = 1e-6;

/// The model with MuJoCo's inertias of moving bodies, so that all other values can be compared to rounding error.
/// `difference` records the difference of each inertia.
Model with_inertias_of(const MujocoFile& theirs, const Model& ours, Worst& difference);

}  // namespace grapnel::testing
