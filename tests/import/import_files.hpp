#pragma once

/// @file
/// Files for the tests of imports: the corpus, and models that a test writes.

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace grapnel::testing {

/// A file of the corpus: "arm.urdf", "mjcf/geoms.xml".
inline std::filesystem::path corpus(const std::string& name) {
  return std::filesystem::path(GRAPNEL_SOURCE_DIR) / "tests/import/corpus" / name;
}

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A temporary folder, removed with its contents.
class ModelFolder {
 public:
  ModelFolder()
      : path_(std::filesystem::temp_directory_path() /
              ("grapnel_models_" + std::to_string(::getpid()) + "_" + std::to_string(next_++))) {
    std::filesystem::create_directories(path_);
  }
  ~ModelFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  ModelFolder(const ModelFolder&) = delete;
  ModelFolder& operator=(const ModelFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Writes a file, creates its folders and returns its path.
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

}  // namespace grapnel::testing
