#pragma once

/// @file
/// HDF5 files made in memory, and their datasets; for .cpp files that write tables. Thread safety: within one Session.

#include <string>
#include <vector>

#include "grapnel/result/hdf5_handle.hpp"

namespace grapnel::hdf5 {

/// A file in memory: nothing that HDF5 does can then half-write the disk. `name` is for HDF5's messages.
Handle create_in_memory(const char* name);

/// The bytes of the file as they would be on disk.
std::string image_of(const Handle& file);

/// A dataset with its data, groups on the way made; large ones are compressed, if they may be.
Handle write_dataset(const Handle& file, const std::string& path, hid_t file_type, hid_t memory_type,
                     const std::vector<hsize_t>& extent, const void* data, bool may_compress = true);
/// A dataset of texts.
Handle write_strings(const Handle& file, const std::string& path, const std::vector<std::string>& texts);

}  // namespace grapnel::hdf5
