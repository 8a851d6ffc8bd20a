#pragma once

/// @file
/// MJCF models as texts, for tests of messages.

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "grapnel/import/source_model.hpp"
#include "import/import_files.hpp"

namespace grapnel::testing {

struct ReadMjcf {
  SourceModel model;
  std::vector<std::string> faults;  // "line:column: message", sorted

  const SourceJoint& joint(const std::string& name) const {
    for (const SourceJoint& joint : model.joints) {
      if (joint.name == name) return joint;
    }
    throw std::out_of_range("no joint " + name);
  }
  const SourceLink& link(const std::string& name) const {
    for (const SourceLink& link : model.links) {
      if (link.name == name) return link;
    }
    throw std::out_of_range("no link " + name);
  }
  /// "line:column: text" of the decisions that contain `words`.
  std::vector<std::string> decisions(const std::string& words) const {
    std::vector<std::string> texts;
    for (const ImportDecision& decision : model.decisions) {
      if (decision.text.find(words) != std::string::npos)
        texts.push_back(std::to_string(decision.mark.line) + ":" + std::to_string(decision.mark.column) + ": " +
                        decision.text);
    }
    return texts;
  }
};

inline ReadMjcf read_mjcf_at(const std::filesystem::path& file, const MeshReader& read_mesh = {}) {
  FaultList list;
  ReadMjcf result{read_mjcf(file, bytes_of(file), list, read_mesh), {}};
  for (const Fault& fault : sorted_faults(list.all())) {
    const std::string place = std::filesystem::path(fault.file).filename() == file.filename()
                                  ? ""
                                  : std::filesystem::path(fault.file).filename().string() + ":";
    result.faults.push_back(place + std::to_string(fault.line) + ":" + std::to_string(fault.column) + ": " +
                            fault.message);
  }
  return result;
}

inline ReadMjcf read_mjcf_text(const std::string& text) {
  const ModelFolder folder;
  return read_mjcf_at(folder.write("robot.xml", text));
}

}  // namespace grapnel::testing
