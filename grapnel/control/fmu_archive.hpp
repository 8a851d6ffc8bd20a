#pragma once

/// @file
/// FMUs are ZIP archives.

#include <filesystem>

namespace grapnel::fmi {

/// Unpacks an archive into a folder. @throws FmuError.
void unpack_archive(const std::filesystem::path& archive, const std::filesystem::path& folder);

/// Writes a ZIP archive with the files of a folder, by their names in it. The same files give the same archive. @throws
/// FmuError.
void zip_folder(const std::filesystem::path& folder, const std::filesystem::path& archive);

}  // namespace grapnel::fmi
