#pragma once

/// @file
/// HDF5 files made in memory, and their datasets; for .cpp files that write tables. Thread safety: within one Session.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/result/hdf5_handle.hpp"

namespace grapnel::hdf5 {

/// A file in memory: nothing that HDF5 does can then half-write the disk. `name` is for HDF5's messages.
Handle create_in_memory(const char* name);

/// A file on disk that grows while it is written: a temporary, to be renamed once it is complete.
Handle create_on_disk(const std::filesystem::path& path);

/// Rows of a chunk of a compressed dataset whose rows have so many bytes.
hsize_t rows_of_chunk(hsize_t row_bytes);
/// How much large datasets are compressed.
inline constexpr unsigned kDeflateLevel = 4;

/// The bytes of the file as they would be on disk.
std::string image_of(const Handle& file);

/// A dataset with its data, groups on the way made; large ones are compressed, if they may be.
Handle write_dataset(const Handle& file, const std::string& path, hid_t file_type, hid_t memory_type,
                     const std::vector<hsize_t>& extent, const void* data, bool may_compress = true);
/// A dataset of texts.
Handle write_strings(const Handle& file, const std::string& path, const std::vector<std::string>& texts);

}  // namespace grapnel::hdf5
