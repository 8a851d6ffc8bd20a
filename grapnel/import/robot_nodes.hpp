#pragma once

/// @file
/// Values of robot files (docs/formats/robot.md) as trees.

#include <string>
#include <string_view>

#include "grapnel/model/geometry.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

Node mapping_node(const Mark& mark = {});
Node sequence_node(const Mark& mark = {});
/// A text, in quotes if it would read as something else.
Node text_node(const std::string& text, const Mark& mark = {});
/// Without the sign of zero, which nobody means.
Node vector_node_of(const Vector3d& v, const Mark& mark);

/// Sets a key of a mapping.
void put(Node& mapping, std::string_view key, Node value);

bool is_identity(const Posed& X);
/// position and quaternion_wxyz, what is not zero of them, into a mapping in place of what it says of a pose.
void put_pose(Node& mapping, const Posed& X, const Mark& mark);
Node pose_node(const Posed& X, const Mark& mark);
/// The pose that a mapping says; identity where it says none that can be read.
Posed pose_in(const Node& mapping);

/// A shape of a body in whose frame that of the shape's owner is X_BL; `file` is a mesh's path.
Node shape_node(const Geometry& shape, const Posed& X_BL, const std::string& file, const Mark& mark);

}  // namespace grapnel
