#include "grapnel/scenario/mesh_files.hpp"

#include <fmt/format.h>

#include "grapnel/result/sha256.hpp"
#include "grapnel/scenario/read_mesh.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

void add_file_of(Node& body, std::vector<Node*>& files) {
  Node* geometry = body.find("geometry");
  if (!geometry || text_at(*geometry, "shape") != "mesh") return;
  Node* file = geometry->find("file");
  if (file && is_text(*file) && !file->text.empty()) files.push_back(file);
}

void add_files_of_list(Node& tree, const char* key, std::vector<Node*>& files) {
  Node* list = tree.find(key);
  if (!list || !list->is_sequence()) return;
  for (Node& body : list->items) add_file_of(body, files);
}

std::shared_ptr<const ScenarioFiles::File> mesh_file(const std::filesystem::path& path, const Node& named,
                                                     ScenarioFiles& files, FaultList& faults) {
  if (auto kept = files.find(path); kept && kept->mesh) return kept;
  if (!is_mesh_file(path)) {
    faults.add(named.mark, fmt::format("mesh file {} must end in .stl or .obj", in_quotes(named.text)));
    return nullptr;
  }
  const auto bytes = read_file(path, named.mark, faults, kLargestMesh, named.text);
  if (!bytes) return nullptr;
  auto mesh = read_mesh(*bytes, path, faults);
  if (!mesh) return nullptr;
  // Its digest instead of its bytes: a study hashes its inputs once per point.
  const ScenarioFiles::File file{sha256(*bytes) + "\n", {}, {}, std::move(mesh)};
  files.keep(path, file);
  return std::make_shared<const ScenarioFiles::File>(file);
}

}  // namespace

std::vector<Node*> mesh_file_nodes(Node& tree) {
  std::vector<Node*> files;
  for (Node* robot : {&tree, tree.find("robot")}) {
    if (!robot) continue;
    if (Node* base = robot->find("base")) add_file_of(*base, files);
    add_files_of_list(*robot, "links", files);
  }
  add_files_of_list(tree, "targets", files);
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
