#pragma once

/// @file
/// The mesh files that a scenario or a robot names: triangles from STL, OBJ and Collada files.

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/model/geometry.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/scenario_files.hpp"

namespace grapnel {

/// Limit on the size of mesh files; larger files are rejected without reading.
inline constexpr std::size_t kLargestMesh = 64u << 20;  // [bytes]
/// Limit on the number of triangles.
inline constexpr std::size_t kMostTriangles = 200'000;

/// Whether the file extension is supported: .stl, .obj or .dae, in any case.
bool is_mesh_file(const std::filesystem::path& path);

/// The mesh in the bytes of a file. STL: binary, or text with facets; normals are not read; bytes behind the counted
/// triangles are a warning. OBJ: v and f, polygons as fans of triangles; everything else is passed over. Collada: the
/// geometries of the scene with the transforms of its nodes, in metres with z upwards. Vertices at the same place
/// become one, triangles without an area are left out. Null after a fault, one per file, at its line in texts and
/// without a line in binary files.
std::shared_ptr<const TriangleMesh> read_mesh(std::string_view bytes, const std::filesystem::path& path,
                                              FaultList& faults);

/// The values of geometry.file in the tree of a robot, or of a scenario with an inline robot. Only those
/// that are texts and go with shape mesh.
std::vector<Node*> mesh_file_nodes(Node& tree);

/// Reads the files that a tree names, each once. `beside`: the file whose folder their paths begin at. A digest of
/// every file's bytes is added to `hashed`. What cannot be read is a fault at the place that names it, or in the mesh
/// file, and is not among the meshes.
Meshes read_mesh_files(Node& tree, const std::filesystem::path& beside, ScenarioFiles& files, std::string& hashed,
                       FaultList& faults);

}  // namespace grapnel
