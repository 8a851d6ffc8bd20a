#pragma once

/// @file
/// MJCF models as texts, for tests of what is said about them.

#include <unistd.h>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "grapnel/import/read_mjcf.hpp"

namespace grapnel::testing {

/// A folder that is removed with what is in it.
class MjcfFolder {
 public:
  MjcfFolder()
      : path_(std::filesystem::temp_directory_path() /
              ("grapnel_mjcf_" + std::to_string(::getpid()) + "_" + std::to_string(next_++))) {
    std::filesystem::create_directories(path_);
  }
  ~MjcfFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  MjcfFolder(const MjcfFolder&) = delete;
  MjcfFolder& operator=(const MjcfFolder&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

 private:
  inline static int next_ = 0;
  std::filesystem::path path_;
};

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

inline ReadMjcf read_mjcf_at(const std::filesystem::path& file) {
  FaultList list;
  ReadMjcf result{read_mjcf(file, list), {}};
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
  const MjcfFolder folder;
  return read_mjcf_at(folder.write("robot.xml", text));
}

}  // namespace grapnel::testing
