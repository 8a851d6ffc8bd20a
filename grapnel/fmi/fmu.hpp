#pragma once

/// @file
/// An FMU for co-simulation: unpacked, parsed, its binary loaded. Its code runs in this process with all its rights.

#include <filesystem>
#include <memory>
#include <string>

#include "grapnel/fmi/model_description.hpp"
#include "grapnel/fmi/unpacked_folder.hpp"

namespace grapnel::fmi {

/// Thread safety: any number of threads.
class Fmu {
 public:
  /// Unpacks into a temporary folder, which is removed with the object, or at the end of the process. `shown`: the
  /// file's name in messages. @throws FmuError with a sentence that names it.
  Fmu(const std::filesystem::path& file, const std::string& shown);
  ~Fmu();
  Fmu(const Fmu&) = delete;
  Fmu& operator=(const Fmu&) = delete;

  /// "the FMU 'controller.fmu'"
  const std::string& named() const { return named_; }
  const ModelDescription& model() const { return model_; }
  std::filesystem::path resources() const { return folder_.path() / "resources"; }
  /// A function of the binary, e.g. "DoStep", with the prefix of its version. @throws FmuError if it is missing.
  template <class Function>
  Function function(const char* name) const {
    return reinterpret_cast<Function>(symbol(name));
  }

  /// For FMUs that may be instantiated only once per process: waits while another thread holds the instance, until
  /// release(). @throws FmuError if this thread holds it, which would be a deadlock.
  void acquire() const;
  void release() const;

 private:
  struct Turn;  // the holder of the only instance
  static std::shared_ptr<Turn> turn_of(const ModelDescription& model);
  void* symbol(const char* name) const;

  std::string named_;
  UnpackedFolder folder_;
  ModelDescription model_;
  void* library_ = nullptr;
  std::shared_ptr<Turn> turn_;
};

/// Writes a ZIP archive with the files of a folder, by their names in it. The same files give the same archive. @throws
/// FmuError.
void zip_folder(const std::filesystem::path& folder, const std::filesystem::path& archive);

}  // namespace grapnel::fmi
