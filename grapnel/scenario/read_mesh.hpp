#pragma once

/// @file
/// Triangles from STL and OBJ files.

#include <filesystem>
#include <memory>
#include <string_view>

#include "grapnel/model/triangle_mesh.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Mesh files above this size are refused unread.
inline constexpr std::size_t kLargestMesh = 64u << 20;  // [bytes]
/// And above this number of triangles when read.
inline constexpr std::size_t kMostTriangles = 200'000;

/// Whether the file's ending says a format that can be read: .stl or .obj, in any case.
bool is_mesh_file(const std::filesystem::path& path);

/// The mesh in the bytes of a file. STL: binary, or text with facets; normals are not read. OBJ: v and f, polygons as
/// fans of triangles; everything else is passed over. Vertices at the same place become one, triangles without an area
/// are left out. Null after a fault, one per file, at its line in texts and without a line in binary files.
std::shared_ptr<const TriangleMesh> read_mesh(std::string_view bytes, const std::filesystem::path& path,
                                              FaultList& faults);

}  // namespace grapnel
