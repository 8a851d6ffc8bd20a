#pragma once

/// @file
/// Builds a binary glTF 2.0 file (.glb): a JSON document and one buffer. Inside this module only.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace grapnel {

class GltfFile {
 public:
  /// What is put into the buffer; each returns the number of its accessor. `width`: components of an element, 1, 3
  /// or 4.
  int add_floats(const std::vector<float>& values, int width);
  /// Vertices and normals of meshes, indices of triangles: the buffer's views then say so.
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

}  // namespace grapnel
