#pragma once

/// @file
/// Interpretation of an MJCF model: bodies with masses and shapes, the selection of the robot, and actuators and
/// constraints of its joints.

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/import/mjcf_file.hpp"

namespace grapnel {

/// A mesh of `<asset>`. The pose of its shape is (frame of the geom) * X_GM, after scaling with `scale`.
struct MjcfMesh {
  std::string name;
  const MjcfElement* element = nullptr;
  std::string file;  // as MuJoCo resolves it from the model's folder; empty: the vertices are in the model
  Vector3d scale{1, 1, 1};
  Posed X_GM = Posed::identity();
  std::string unusable;       // why its triangles are not available; empty: they are
  bool is_exact = false;      // MuJoCo computes its inertia exactly
  std::string other_inertia;  // inertia that MuJoCo uses instead: "shell", "convex"; empty: its volume
};

/// Volume integrals of a closed surface at density 1, in the frame of its vertices.
struct MeshSolid {
  double volume = 0;                          // [m^3]
  Vector3d com = Vector3d::zero();            // [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass [m^5]
  // Every triangle is seen from inside, from the centre of the surface as well as from the centre of mass: the sum of
  // tetrahedra without signs, MuJoCo's default, is then exact.
  bool is_star = false;
};
/// Of a mesh whose vertices are multiplied with `scale`; empty if its triangles do not close a volume, all with the
/// same side outside.
std::optional<MeshSolid> solid_within(const TriangleMesh& mesh, const Vector3d& scale);

/// Context for reading all parts of a model.
struct MjcfContext {
  explicit MjcfContext(FaultList& fault_list) : faults(fault_list) {}

  FaultList& faults;
  MjcfCompiler compiler;
  MjcfDefaults defaults;
  MjcfPassedOver passed_over;
  std::map<std::string, MjcfMesh> meshes;
  std::filesystem::path folder;  // of the model's file
  MeshReader read_mesh;          // may be null
  std::vector<ImportDecision> decisions;

  void fault(const Mark& mark, std::string text) { faults.add(mark, std::move(text)); }
  /// `about`: the link or joint concerned; empty: the whole model.
  void decide(const Mark& mark, std::string text, std::string about = {}) {
    decisions.push_back({mark, std::move(text), std::move(about)});
  }
};

/// An element of a body, perhaps inside of `<frame>` elements.
struct MjcfPart {
  MjcfAttributes attributes;
  Posed X_BF = Posed::identity();  // of the innermost frame in the body's

  const MjcfElement& element() const { return attributes.element(); }
};

/// A body of the file. References into MjcfFiles.
struct MjcfBody {
  std::string name;  // unique
  const MjcfElement* element = nullptr;
  int parent = -1;                 // index; -1: the world
  Posed X_PB = Posed::identity();  // its frame in the parent's body frame
  std::vector<MjcfPart> inertials, joints, geoms, sites;
  bool moves = true;                        // false: fixed to the world, so that MuJoCo ignores its mass
  std::vector<const MjcfElement*> refused;  // unsupported elements, an error if this body is part of the robot
};

/// A mesh of `<asset>`.
MjcfMesh read_mjcf_mesh(const MjcfElement& element, MjcfContext& context);

/// Mass and inertia in the body's frame as MuJoCo takes them: from `<inertial>` or from geoms, within the compiler's
/// bounds. Empty if there are none. A mesh that gives none is a fault, but a decision on bodies that do not move.
std::optional<SourceInertia> read_mjcf_inertia(const MjcfBody& body, MjcfContext& context);

/// The shapes of a body, in its frame.
std::vector<SourceShape> read_mjcf_shapes(const MjcfBody& body, MjcfContext& context);

/// The place between two points ("fromto") with z along the line through them, or `pos` and an orientation.
Posed mjcf_place(const MjcfPart& part, MjcfContext& context);

// ---- The tree, and which part of it is the robot ----

struct MjcfTree {
  Mark world_mark;               // of <worldbody>
  std::vector<MjcfBody> bodies;  // parents first, in the order of the file; the world is none of them
};

/// Reads all `<worldbody>` sections.
MjcfTree read_mjcf_tree(const MjcfElement& root, MjcfContext& context);

/// The bodies of the robot.
struct MjcfRobot {
  std::vector<int> bodies;  // parents first
  // Whether joints connect the trees to the world, which is then a separate link. Otherwise there is one tree, whose
  // root is the base.
  bool hangs_on_world = false;
};

/// The tree below the free joint; of several the one that has joints; without a free joint all trees that have joints.
/// Omitted bodies are a decision; an ambiguous choice is an error with an empty result.
std::optional<MjcfRobot> choose_mjcf_robot(const MjcfTree& tree, MjcfContext& context);

// ---- Elements outside the body tree that act on joints: actuators, couplings, tendons ----

/// The range of an attribute that may be switched on and off by another ("limited", "ctrllimited"), in the file's
/// units; empty if it does not limit.
std::optional<std::pair<double, double>> mjcf_range(const MjcfAttributes& given, const char* switched,
                                                    const char* range, MjcfContext& context);

/// A joint's value in the initial pose of the file [rad or m].
double mjcf_joint_reference(const MjcfAttributes& joint, MjcfContext& context);

/// Effort limits of joints from their actuators, and couplings of joints; constraints and tendons that act on the
/// motion and have no counterpart are errors.
void read_mjcf_drives(const MjcfElement& root, const MjcfTree& tree, const MjcfRobot& robot, MjcfContext& context,
                      SourceModel& model);

}  // namespace grapnel
