#include "grapnel/scenario/mesh_files.hpp"

#include <fmt/format.h>

#include <cmath>

#include "grapnel/result/file_seal.hpp"
#include "grapnel/scenario/mesh_formats.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {

bool is_mesh_file(const std::filesystem::path& path) {
  const std::string ending = mesh_formats::lower_case(path.extension().string());
  return ending == ".stl" || ending == ".obj" || ending == ".dae";
}

std::shared_ptr<const TriangleMesh> read_mesh(std::string_view bytes, const std::filesystem::path& path,
                                              FaultList& faults) {
  using namespace mesh_formats;
  const std::string ending = lower_case(path.extension().string());
  try {
    MeshCollector mesh;
    if (ending == ".obj")
      read_obj(bytes, mesh);
    else if (ending == ".dae")
      read_collada(bytes, path, mesh);
    else
      read_stl(bytes, mesh);
    auto read = mesh.finish(path.filename().string());
    if (!mesh.warning.empty()) faults.warn(Fault{path.string(), 0, 0, mesh.warning});
    return read;
  } catch (const MeshFault& fault) {
    faults.add(Fault{path.string(), fault.line, fault.column, fault.message});
    return nullptr;
  }
}

// --- The files that a tree names ---

namespace {

void add_file_of_shape(Node& shape, std::vector<Node*>& files) {
  if (text_at(shape, "shape") != "mesh") return;
  Node* file = shape.find("file");
  if (file && is_text(*file) && !file->text.empty()) files.push_back(file);
}

void add_files_of(Node& body, std::vector<Node*>& files) {
  Node* geometry = body.find("geometry");
  if (!geometry) return;
  add_file_of_shape(*geometry, files);
  for (Node& shape : geometry->items) add_file_of_shape(shape, files);
}

void add_files_of_list(Node& tree, const char* key, std::vector<Node*>& files) {
  Node* list = tree.find(key);
  if (!list || !list->is_sequence()) return;
  for (Node& body : list->items) add_files_of(body, files);
}

std::shared_ptr<const ScenarioFiles::File> mesh_file(const std::filesystem::path& path, const Node& named,
                                                     ScenarioFiles& files, FaultList& faults) {
  if (auto stored = files.find(path); stored && stored->mesh) return stored;
  if (!is_mesh_file(path)) {
    faults.add(named.mark, fmt::format("mesh file {} must end in .stl, .obj or .dae", in_quotes(named.text)));
    return nullptr;
  }
  const auto bytes = read_file(path, named.mark, faults, kLargestMesh, named.text);
  if (!bytes) return nullptr;
  auto mesh = read_mesh(*bytes, path, faults);
  if (!mesh) return nullptr;
  // The digest replaces the bytes: a study hashes its inputs once per point.
  const ScenarioFiles::File file{sha256(*bytes) + "\n", {}, {}, std::move(mesh)};
  files.store(path, file);
  return std::make_shared<const ScenarioFiles::File>(file);
}

}  // namespace

std::vector<Node*> mesh_file_nodes(Node& tree) {
  std::vector<Node*> files;
  for (Node* robot : {&tree, tree.find("robot")}) {
    if (!robot) continue;
    if (Node* base = robot->find("base")) add_files_of(*base, files);
    add_files_of_list(*robot, "links", files);
  }
  add_files_of_list(tree, "targets", files);
  add_files_of_list(tree, "obstacles", files);
  return files;
}

Meshes read_mesh_files(Node& tree, const std::filesystem::path& beside, ScenarioFiles& files, std::string& hashed,
                       FaultList& faults) {
  Meshes meshes;
  for (const Node* named : mesh_file_nodes(tree)) {
    if (faults.full()) break;
    if (!meshes.emplace(named->text, nullptr).second) continue;
    const auto file = mesh_file(path_beside(beside, named->text), *named, files, faults);
    if (!file) continue;
    hashed += file->bytes;
    meshes[named->text] = file->mesh;
  }
  return meshes;
}

}  // namespace grapnel
