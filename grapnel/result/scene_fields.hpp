#pragma once

/// @file
/// The description of scene.json, from which its text, schema, page and the viewer's types follow.

#include <string>

#include "grapnel/describe/type.hpp"
#include "grapnel/result/scene.hpp"

namespace grapnel {

/// The document: a scene, the scenario that it is of, and the version of Grapnel that made it. Refers to the scene.
struct SceneDocument {
  const Scene& scene;
  std::string scenario_name, scenario_sha256, version;
};
template <>
const Type& type_of<SceneDocument>();

}  // namespace grapnel
