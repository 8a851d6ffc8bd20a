#pragma once

/// @file
/// An FMU for co-simulation: unpacked, read, its binary loaded. Its code runs in this process with all rights of it.

#include <filesystem>
#include <memory>
#include <string>

#include "grapnel/fmi/model_description.hpp"
#include "grapnel/fmi/unpacked_folder.hpp"

namespace grapnel::fmi {

/// Thread safety: any number of threads.
class Fmu {
 public:
  /// Unpacks into a folder among the system's temporary ones, which is gone with the object, and with the
  /// process if that ends before. `shown`: what messages
  /// call the file. @throws FmuError with a sentence that names it.
  Fmu(const std::filesystem::path& file, const std::string& shown);
  ~Fmu();
  Fmu(const Fmu&) = delete;
  Fmu& operator=(const Fmu&) = delete;

  /// "the FMU 'controller.fmu'"
  const std::string& named() const { return named_; }
  const ModelDescription& model() const { return model_; }
  std::filesystem::path resources() const { return folder_.path() / "resources"; }
  /// A function of the binary, "DoStep", with the prefix of its version. @throws FmuError if it has none.
  template <class Function>
  Function function(const char* name) const {
    return reinterpret_cast<Function>(symbol(name));
  }

  /// Waits where the FMU may be instantiated once per process and another thread has an instance; that of release()
  /// ends the wait. @throws FmuError where this thread has it, which would wait for itself.
  void acquire() const;
  void release() const;

 private:
  struct Turn;  // who has the only instance
  static std::shared_ptr<Turn> turn_of(const ModelDescription& model);
  void* symbol(const char* name) const;

  std::string named_;
  UnpackedFolder folder_;
  ModelDescription model_;
  void* library_ = nullptr;
  std::shared_ptr<Turn> turn_;
};

/// Writes a ZIP archive with the files of a folder, by their names in it: the same files make the same archive. @throws
/// FmuError.
void zip_folder(const std::filesystem::path& folder, const std::filesystem::path& archive);

}  // namespace grapnel::fmi
