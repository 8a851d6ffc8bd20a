#pragma once

/// @file
/// A model that MuJoCo itself read from an MJCF or URDF file, and its answers in Grapnel's coordinates.

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "grapnel/dynamics/state.hpp"
#include "support/worst.hpp"

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

/// MuJoCo keeps inertias as principal moments and axes. It seeks the axes of bodies with products of inertia, with
/// several geoms, or fused from several, by Jacobi rotations, and stops when one turns by less than 1.4e-6 rad: by up
/// to so much of their size such tensors differ from the exact ones, while masses and centres of mass agree to
/// rounding.
constexpr double kTurnedAxes = 1e-6;

/// The model with MuJoCo's inertias of moving bodies, so that all other values can be compared to rounding error.
/// `difference` notes by how much each differed.
Model with_inertias_of(const MujocoFile& theirs, const Model& ours, Worst& difference);

}  // namespace grapnel::testing
