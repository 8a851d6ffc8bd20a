#pragma once

/// @file
/// URDF files as they are found in the wild. What the file says is taken as it stands and judged by assemble_robot();
/// what Grapnel has no use for is left out, with a line per kind that says so.

#include "grapnel/import/source_model.hpp"
#include "grapnel/import/xml_file.hpp"

namespace grapnel {

/// The links, joints and transmissions of a `<robot>`. Faults, at their places: what is no URDF or still a xacro file,
/// names that lack or occur twice, values that are no numbers, types of joints that do not exist. Whether links and
/// joints form a tree is not looked at.
SourceModel read_urdf(const XmlFile& file, FaultList& faults);

}  // namespace grapnel
