#pragma once

/// @file
/// The data of the equations of a compliant impact (compliant_kernel.hpp): plain data, which files compiled for an
/// instruction set may include.

#include <cstdint>

#include "grapnel/impact/impact_setup.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {

/// apart: no deformation. pressing: the force law applies. relaxing: the surface is deformed, but not in contact.
enum class ContactPhase { apart, pressing, relaxing };

// Displacements of bodies since an instant, without cancellation: a deformation of micrometres is the difference of two
// displacements, not of two positions of several metres.

/// The motion x -> x + (turn - 1)(x - o) + move of all points of a body in W, o a reference point common to all bodies.
template <class S>
struct BasicDisplacement {
  Quaternion<S> turn;  // in W, unit; its vector part is accurate near zero
  Vector3<S> move;     // of the point at o
};

/// A body at the beginning, in W.
struct StartBody {
  JointType type;
  int parent, root, q;
  Vector3d axis;  // of the joint
  Vector3d arm;   // from o to the body's origin
  Vector3d com;   // from o to the centre of mass
  Rotationd R_WB;
  double share;  // mass relative to that of its tree
};

/// A free tree, in the order of the links.
struct StartTree {
  int body;          // its root
  int q, v;          // of the root
  bool by_momentum;  // otherwise the root is held
  Momentumd h;       // about its centre of mass
  Vector3d com;      // in W
  double mass;
};

/// One side of a contact or a grasp.
struct InterfaceSide {
  int body, link;
  int tree;  // index of the free tree; -1: none
};

enum class GraspTurns { free, about_hinge, none };

/// A contact, or a grasp, for which the contact members are unused.
struct InterfaceTable {
  InterfaceSide robot, target;
  Vector3d point;  // in W, at the start
  Vector3d arm;    // from o to it

  // Contacts:
  Vector3d normal = Vector3d::zero();
  ContactForceModel model = ContactForceModel::kelvin_voigt;
  double stiffness = 0, damping = 0, exponent = 0;
  double friction = 0, slip_speed = 1;

  // Grasps: also with `stiffness` and `damping` of the points' distance.
  GraspTurns turns = GraspTurns::free;
  Vector3d hinge = Vector3d::zero();
  double angular_stiffness = 0, angular_damping = 0;
};

/// A joint's spring (JointSpring).
struct SpringTable {
  int q, v;
  double stiffness, damping, rest, backlash;
  bool counted;  // the tree participates in the impact
};

/// The impulse that a loop closure, or contacts between shapes (compliant_shapes.hpp), have transmitted to the free
/// tree `first`; its opposite went to `second`. Index of a free tree; -1: a body that is fixed or held; kInside: both
/// bodies of a closure are in one tree, whose momentum does not change.
struct ImpulseChannel {
  int first, second;
  static constexpr int kInside = -2;
};

/// All data of an impact. Numbers y as in CompliantSystem.
struct CompliantTables {
  int coordinates, velocities;
  const double *q, *v;  // at the start
  const int* quaternions;
  int quaternion_count;
  const StartBody* bodies;
  int body_count;
  const StartTree* trees;
  int tree_count;
  const InterfaceTable* interfaces;  // contacts, then grasps
  int contact_count, grasp_count;
  const ContactPhase* phase;  // per contact; changes between steps
  const SpringTable* springs;
  int spring_count;
  const int* rates;  // velocities in y
  int rate_count;
  const int* held;  // velocities
  int held_count;
  const std::uint8_t* prescribed;  // per velocity
  Vector3d drift;                  // velocity common to all, excluded from displacements
  bool driven;
  const ImpulseChannel* channels;
  int channel_count;
  Vector3d channel_point;                                                // in W: the channels' impulses are about it
  int rate_at, impulse_at, channel_at, loss_at, held_at, work_at, size;  // offsets in y; of y

  int interface_count() const { return contact_count + grasp_count; }
  int drive_at() const { return work_at + 1; }                  // with a drive
  int spring_at() const { return work_at + (driven ? 2 : 1); }  // with springs
};

/// Loads of one contact or grasp at an instant, in W, on the robot's body at `point`.
template <class S>
struct BasicInterfaceLoad {
  Vector3<S> point;  // on the robot's body: point of action and reaction
  Wrench<S> F;       // about `point`
  Twist<S> u;        // of the robot's body relative to the target's, at `point`
  Twist<S> u_T;      // of a grasp, in the initial axes of its target
  S deformation;     // [m]
  S rate;            // of it, for contacts [m/s]
  S signed_force;    // force of a contact's law if it could pull [N]
  S angle;           // of a grasp's rotational spring [rad]
  S energy;          // of springs [J]
  S loss;            // power of dampers and friction, >= 0 [W]
};
using InterfaceLoad = BasicInterfaceLoad<double>;

/// Points (t, y) and the requested results, row by row; null: not requested.
struct CompliantPoints {
  int count = 0;
  const double *t = nullptr, *y = nullptr;
  InterfaceLoad* loads = nullptr;     // per interface
  double *q = nullptr, *v = nullptr;  // State's
  double* acceleration = nullptr;     // per velocity
  double* dydt = nullptr;
  /// With a drive, wherever accelerations are needed: efforts per velocity, zero on call. Requires q, v and loads.
  void (*efforts)(void* drive, double t, const double* q, const double* v, const InterfaceLoad* loads,
                  double* effort) = nullptr;
  void* drive = nullptr;
};

/// The equations at many points, in the packs of an instruction set. Results are bit-identical for all sets with fused
/// products, and independent of the other points.
class CompliantPacks {
 public:
  CompliantPacks() = default;
  CompliantPacks(const CompliantPacks&) = delete;
  CompliantPacks& operator=(const CompliantPacks&) = delete;
  virtual ~CompliantPacks();
  virtual void evaluate(const CompliantPoints& points) = 0;
};

/// The factory of an instruction set, defined in compliant_packs_set.cpp. `tables` must outlive the object, which the
/// caller deletes.
template <class Set>
CompliantPacks* make_compliant_packs_of(const CompliantTables& tables, const TreeLink<double>* links, int count);

}  // namespace grapnel
