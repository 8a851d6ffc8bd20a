#pragma once

/// @file
/// A model that MuJoCo itself read from an MJCF or URDF file, and its answers in Grapnel's coordinates.

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "grapnel/dynamics/state.hpp"

struct mjModel_;
struct mjData_;

namespace grapnel::testing {

/// Joints of both are matched by their names, a floating base by that of its body.
class MujocoFile {
 public:
  /// @throws std::runtime_error with MuJoCo's message if it does not read the file.
  explicit MujocoFile(const std::filesystem::path& file);
  ~MujocoFile();
  MujocoFile(const MujocoFile&) = delete;
  MujocoFile& operator=(const MujocoFile&) = delete;

  /// Puts the robot into a state and computes, without gravity. `base`: MuJoCo's name of the floating base's body;
  /// `held`: values of joints that only MuJoCo moves.
  void set_state(const Model& model, const std::string& base, const State& state,
                 const std::map<std::string, double>& held = {});
  /// In Grapnel's velocities, after set_state().
  Eigen::MatrixXd mass_matrix() const;
  Eigen::VectorXd bias() const;
  Posed body_pose(const std::string& body) const;  // in the world
  Posed site_pose(const std::string& site) const;
  /// The number of velocities that the file has.
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
  std::vector<std::string> site_names() const;

 private:
  int body_id(const std::string& body) const;
  int joint_id(const std::string& joint) const;

  mjModel_* model_ = nullptr;
  mjData_* data_ = nullptr;
  Eigen::MatrixXd T_;       // v_mj = T v: rows of MuJoCo's velocities, columns of Grapnel's
  Eigen::VectorXd turned_;  // dT/dt v
};

}  // namespace grapnel::testing
