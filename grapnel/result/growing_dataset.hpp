#pragma once

/// @file
/// A dataset that is written row by row from front to back, so that memory does not grow with the rows; for
/// .cpp files that write tables. Thread safety: within one hdf5::Session.

#include <string>

#include "grapnel/result/hdf5_handle.hpp"

namespace grapnel::hdf5 {

/// Rows that a chunk holds, and best are appended at once.
inline constexpr hsize_t kRowsOfChunk = 8192;

struct GrowingShape {
  hsize_t width = 1;  // numbers of a row; 1: the dataset has one dimension
  hsize_t chunk_rows = kRowsOfChunk;
  unsigned deflate_level = 1;  // numbers drawn at random hardly shrink whatever the level
};

class GrowingDataset {
 public:
  /// Makes it in `group` (empty: in the root), with the groups on the way. A name that cannot be, as "b/x" beside a
  /// dataset "b", gets dots for slashes, and a `_` behind if need be. Chunks are compressed (shuffle, deflate).
  GrowingDataset(const Handle& file, const std::string& group, const std::string& name, hid_t file_type,
                 const GrowingShape& shape = {});
  /// `count` rows.
  void append(hid_t memory_type, hsize_t count, const void* data);
  const Handle& handle() const { return dataset_; }

 private:
  Handle dataset_;
  hsize_t width_;
  hsize_t rows_ = 0;
};

/// Attributes `unit`, `description`.
void describe_dataset(const Handle& dataset, const std::string& unit, const std::string& description);
void write_attribute_u64(const Handle& object, const char* name, unsigned long long value);

}  // namespace grapnel::hdf5
