#pragma once

/// @file
/// Export of a capture as an animated scene for Blender and other programs.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "grapnel/report/run_data.hpp"

namespace grapnel {

// Builds a binary glTF 2.0 file (.glb): a JSON document and one buffer.

class GltfFile {
 public:
  /// Adds data to the buffer and returns the index of its accessor. `width`: components of an element, 1, 3
  /// or 4.
  int add_floats(const std::vector<float>& values, int width);
  /// Purpose of the data (vertices and normals, or indices of triangles), for the buffer's views.
  int add_vertices(const std::vector<float>& values);
  int add_indices(const std::vector<std::uint32_t>& values);

  /// Appends to an array of the document, such as "nodes"; returns its number there.
  int add(const char* array, nlohmann::ordered_json entry);
  nlohmann::ordered_json& document() { return document_; }

  /// The file's bytes, the same on every machine. @throws std::runtime_error above 4 GB.
  std::string bytes() const;

 private:
  int add_accessor(const std::string& bytes, nlohmann::ordered_json accessor, int target);

  nlohmann::ordered_json document_ = nlohmann::ordered_json::object();
  std::string buffer_;
};

/// Target number of keyframes for decimate().
inline constexpr std::size_t kMostKeyframes = 2000;

/// A binary glTF 2.0 file: a root node converts z-up to glTF's y-up; below it a node per body (base, links, targets),
/// named as in the scenario, with its shape as a mesh and its pose in W as keyframes. Grasp points are marked on
/// targets. decimate() reduces the samples; `asset.extras` states their number, the largest errors of positions [m] and
/// angles [rad] between keyframes, and the separation of keyframes of equal times at an impact [s], which glTF
/// requires. Throws std::runtime_error naming missing files.
std::string glb_bytes(const RunSource& run, const std::string& version);

/// Reads a run's folder, writes capture.glb there (atomically) and returns its path. Throws std::runtime_error naming
/// the file and the error.
std::filesystem::path export_glb(const std::filesystem::path& folder, const std::string& version);

}  // namespace grapnel
