#pragma once

/// @file
/// A Grapnel model with contacts in MuJoCo: MuJoCo's multibody dynamics and its collision detection, with the force law
/// of one depth per pair (23.4, 23.4a, 23.5) as user forces, or with MuJoCo's own constraint solver.

#include <memory>
#include <vector>

#include "grapnel/contact/contact_set.hpp"
#include "grapnel/dynamics/state.hpp"

struct mjModel_;
struct mjData_;
struct mjContact_;

namespace grapnel::testing {

/// A shape on a body of the model; body -1: fixed in W.
struct EngineSurface {
  int body = -1;
  Geometry geometry = {};
  bool half_space = false;  // z <= 0 of geometry.X_BG

  ContactSurface grapnel() const {
    return {body, half_space ? ContactShape::half_space(geometry.X_BG) : ContactShape(geometry)};
  }
};

class MujocoContacts {
 public:
  enum class Route {
    /// MuJoCo provides distances, normals and points of contact. The laws are evaluated here at its contacts. For a
    /// sphere and a mesh, whose depth MuJoCo only approximates (Minkowski portal refinement), they are replaced by
    /// those
    /// of the nearest triangle of any three vertices of the mesh.
    user_forces,
    /// MuJoCo's solver of soft constraints, for linear laws without dissipation. Its constraint force is
    ///   f = max(0, (a_ref - a_0)/(A + R)),   R = A' (1 - d)/d,   a_ref = k depth/d
    /// with the impedance d, the inverse effective mass A, its approximation A' by `body_invweight0`, the acceleration
    /// a_0 without the contact, and k of a negative `solref`. With k = K A' it tends to K depth for d -> 0; the
    /// difference is proportional to d, of which MuJoCo's minimum is 1e-4.
    solver
  };

  struct Settings {
    Route route = Route::user_forces;
    double step = 1e-4;       // of MuJoCo's Runge-Kutta method [s]
    double impedance = 1e-4;  // d, for Route::solver
    int side_spheres = 200;   // spheres for the side of a capsule, whose law is an integral along its axis
  };
  /// The first surface of each pair is a sphere or a capsule. Friction and damping are not supported.
  MujocoContacts(const Model& model, const std::vector<EngineSurface>& surfaces, const std::vector<SurfacePair>& pairs,
                 const Settings& settings);
  ~MujocoContacts();
  MujocoContacts(const MujocoContacts&) = delete;
  MujocoContacts& operator=(const MujocoContacts&) = delete;

  void start(const State& state);
  /// Steps of MuJoCo's Runge-Kutta method over a multiple of the step.
  void run(double duration);
  State state() const;
  /// Time integral of the magnitude of a pair's force since start() [N s].
  double impulse(std::size_t pair) const { return impulses_[pair]; }
  /// Largest error of MuJoCo's depths of spheres in meshes since start() [m].
  double mesh_depth_error() const { return mesh_depth_error_; }
  /// Evaluations of the dynamics since start().
  long evaluations() const { return evaluations_; }

 private:
  struct Place {
    int q, v;  // MuJoCo's indices for each of Grapnel's bodies
  };
  struct Link {
    std::size_t pair;
    double share;  // of the pair's stiffness
  };
  static void apply(const mjModel_* model, mjData_* data);
  void set_solver_parameters();
  const Link* link_of(int geom_1, int geom_2) const;
  double force(const Link& link, double depth, double approach_speed) const;
  void measure();
  void refine(mjContact_& contact);

  const Model& grapnel_;
  std::vector<EngineSurface> surfaces_;
  std::vector<SurfacePair> pairs_;
  Settings settings_;
  mjModel_* model_ = nullptr;
  mjData_* data_ = nullptr;
  std::vector<Place> places_;
  std::vector<Link> links_;         // of MuJoCo's pairs of geoms
  std::vector<double> radius_;      // effective, of Hertz's law
  std::vector<int> link_of_geoms_;  // per pair of geoms: index in links_, or -1
  std::vector<Vector3d> forces_;    // per pair, in W
  std::vector<double> impulses_;
  double mesh_depth_error_ = 0;
  long evaluations_ = 0;
};

/// The vector from a point to the nearest point of a triangle.
Vector3d to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c);
/// The vector from a point outside to the nearest point of a hull: of the triangles of all vertices.
Vector3d to_hull(const Vector3d& p, const std::vector<Vector3d>& vertices);

}  // namespace grapnel::testing
