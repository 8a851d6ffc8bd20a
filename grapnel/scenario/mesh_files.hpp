#pragma once

/// @file
/// The mesh files that a scenario or a robot names.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/scenario_files.hpp"

namespace grapnel {

/// The values of geometry.file in the tree of a robot, or of a scenario with the robot that stands in it. Only those
/// that are texts and go with shape mesh.
std::vector<Node*> mesh_file_nodes(Node& tree);

/// Reads the files that a tree names, each once. `beside`: the file whose folder their paths begin at. A digest of
/// every file's bytes is added to `hashed`. What cannot be read is a fault at the place that names it, or in the mesh
/// file, and is not among the meshes.
Meshes read_mesh_files(Node& tree, const std::filesystem::path& beside, ScenarioFiles& files, std::string& hashed,
                       FaultList& faults);

}  // namespace grapnel
