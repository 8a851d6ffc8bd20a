#pragma once

/// @file
/// What a body of an MJCF model weighs and looks like.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/import/mjcf_file.hpp"

namespace grapnel {

/// A mesh of `<asset>`. Its shape stands at (frame of the geom) * X_GM, multiplied with `scale` before.
struct MjcfMesh {
  std::string name;
  const MjcfElement* element = nullptr;
  std::string file;  // as MuJoCo resolves it from the model's folder; empty: the vertices are in the model
  Vector3d scale{1, 1, 1};
  Posed X_GM = Posed::identity();
  std::string unusable;  // why its triangles cannot be had; empty: they can
};

/// What all of a model's parts are read with.
struct MjcfContext {
  explicit MjcfContext(FaultList& fault_list) : faults(fault_list) {}

  FaultList& faults;
  MjcfCompiler compiler;
  MjcfDefaults defaults;
  MjcfPassedOver passed_over;
  std::map<std::string, MjcfMesh> meshes;
  std::vector<ImportDecision> decisions;

  void fault(const Mark& mark, std::string text) { faults.add(mark, std::move(text)); }
  /// `about`: the link or joint that it concerns; empty: the whole.
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

/// A body as it stands in the file. References into MjcfFiles.
struct MjcfBody {
  std::string name;  // unique
  const MjcfElement* element = nullptr;
  int parent = -1;                 // index; -1: the world
  Posed X_PB = Posed::identity();  // its frame in the parent's body frame
  std::vector<MjcfPart> inertials, joints, geoms, sites;
  bool moves = true;                        // false: fixed to the world, so that its mass is nothing to MuJoCo
  std::vector<const MjcfElement*> refused;  // what cannot be read, if this body is part of the robot
};

/// A mesh of `<asset>`.
MjcfMesh read_mjcf_mesh(const MjcfElement& element, MjcfContext& context);

/// Mass and inertia in the body's frame as MuJoCo takes them: from `<inertial>` or from geoms, within the compiler's
/// bounds. Empty if there are none. Those of a mesh are a fault, but a decision on bodies that do not move.
std::optional<SourceInertia> read_mjcf_inertia(const MjcfBody& body, MjcfContext& context);

/// The shapes of a body, in its frame.
std::vector<SourceShape> read_mjcf_shapes(const MjcfBody& body, MjcfContext& context);

/// The place between two points ("fromto") with z along the line through them, or `pos` and an orientation.
Posed mjcf_place(const MjcfPart& part, MjcfContext& context);

}  // namespace grapnel
