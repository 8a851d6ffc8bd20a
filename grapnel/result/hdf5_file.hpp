#pragma once

/// @file
/// HDF5 files created in memory, and their datasets; for .cpp files that write tables. Thread safety: within one
/// Session.

#include <hdf5.h>
#include <filesystem>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace grapnel {

// HDF5's C API with owners and exceptions; for .cpp files that write or read tables, not for headers of others.

namespace hdf5 {

/// During its lifetime only this thread uses HDF5 (the library may not be thread-safe), and HDF5 prints nothing.
class Session {
 public:
  Session();
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

 private:
  std::lock_guard<std::mutex> lock_;
  H5E_auto2_t print_ = nullptr;
  void* print_data_ = nullptr;
};

/// Throws std::runtime_error with `what` and the innermost entry of HDF5's error stack.
[[noreturn]] void fail(const std::string& what);

/// Owns one HDF5 identifier. Thread safety: within one Session.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  /// Throws fail(what) if `id` is invalid.
  Handle(hid_t id, Close close, const std::string& what) : id_(id), close_(close) {
    if (id < 0) fail(what);
  }
  ~Handle() { reset(); }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  hid_t id() const { return id_; }

 private:
  void reset() noexcept {
    if (id_ >= 0) close_(id_);
    id_ = H5I_INVALID_HID;
  }

  hid_t id_;
  Close close_;
};

inline void check(herr_t status, const std::string& what) {
  if (status < 0) fail(what);
}

/// The type of variable-length strings; marked UTF-8 only if needed, because old readers support only ASCII.
Handle string_type(bool ascii);

void write_attribute(const Handle& object, const char* name, const std::string& value);
void write_attribute(const Handle& object, const char* name, const std::vector<std::string>& values);
void write_attribute(const Handle& object, const char* name, int value);

std::string read_string_attribute(const Handle& object, const char* name);
std::vector<std::string> read_strings_attribute(const Handle& object, const char* name);
/// `fallback` where the attribute is absent.
int read_int_attribute(const Handle& object, const char* name, int fallback);

}  // namespace hdf5

namespace hdf5 {

/// A file in memory, so that HDF5 cannot leave a partial file on disk. `name` is for HDF5's messages.
Handle create_in_memory(const char* name);

/// Opens a complete file for reading, without a lock: files are replaced atomically, and a forked child of another
/// thread may still hold the writer's lock.
Handle open_on_disk(const std::filesystem::path& path);
/// A file on disk that grows while it is written: a temporary, renamed when it is complete.
Handle create_on_disk(const std::filesystem::path& path);

/// Rows of a chunk of a compressed dataset whose rows have so many bytes.
hsize_t rows_of_chunk(hsize_t row_bytes);
/// Compression level of large datasets.
inline constexpr unsigned kDeflateLevel = 4;

/// The bytes of the file as they would be on disk.
std::string image_of(const Handle& file);

/// Numbers in memory and their representation in files.
struct DatasetValues {
  hid_t file_type, memory_type;
  std::vector<hsize_t> extent;
  const void* data;
};
/// Writes a dataset and creates its groups; large datasets are compressed if allowed.
Handle write_dataset(const Handle& file, const std::string& path, const DatasetValues& values,
                     bool may_compress = true);
/// A dataset of texts.
Handle write_strings(const Handle& file, const std::string& path, const std::vector<std::string>& texts);

}  // namespace hdf5

// A dataset that is written row by row from front to back, so that memory does not grow with the rows; for .cpp files
// that write tables.

namespace hdf5 {

/// Rows of a chunk: the most efficient number of rows to append.
inline constexpr hsize_t kRowsOfChunk = 8192;

struct GrowingShape {
  hsize_t width = 1;  // numbers of a row; 1: the dataset has one dimension
  hsize_t chunk_rows = kRowsOfChunk;
  unsigned deflate_level = 1;  // random numbers barely compress at any level
};

class GrowingDataset {
 public:
  /// Creates the dataset in `group` (empty: in the root), with missing groups. An invalid name, such as "b/x" when a
  /// dataset "b" exists, gets dots for slashes, and a trailing `_` if necessary. Chunks are compressed (shuffle,
  /// deflate).
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

}  // namespace hdf5

}  // namespace grapnel
