#include "grapnel/result/hdf5_file.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace grapnel {

namespace hdf5 {

namespace {

std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

bool is_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

/// What HDF5 allocated for variable-length strings goes back to it.
struct StringBuffer {
  const Handle& type;
  const Handle& space;
  std::vector<char*> strings;
  ~StringBuffer() { H5Dvlen_reclaim(type.id(), space.id(), H5P_DEFAULT, strings.data()); }
};

// HDF5 reports the system's message among times, addresses and sizes.
std::string system_reason(const std::string& reason) {
  const std::string before = "error message = '";
  const std::size_t begin = reason.find(before);
  if (begin == std::string::npos) return reason;
  const std::size_t end = reason.find('\'', begin + before.size());
  return end == std::string::npos ? reason : reason.substr(begin + before.size(), end - begin - before.size());
}

}  // namespace

Session::Session() : lock_(library_mutex()) {
  // Before any other call of the library. A file that could not be written, on a full disk, cannot be closed either:
  // HDF5 would retry when the program ends, and crash.
  [[maybe_unused]] static const herr_t no_second_try = H5dont_atexit();
  H5Eget_auto2(H5E_DEFAULT, &print_, &print_data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Session::~Session() { H5Eset_auto2(H5E_DEFAULT, print_, print_data_); }

void fail(const std::string& what) {
  std::string reason;  // of the innermost failure
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* error, void* data) -> herr_t {
        if (n == 0 && error->desc != nullptr) *static_cast<std::string*>(data) = error->desc;
        return 0;
      },
      &reason);
  reason = system_reason(reason);
  throw std::runtime_error(reason.empty() ? what : what + " (" + reason + ")");
}

Handle string_type(bool ascii) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "string type");
  check(H5Tset_size(type.id(), H5T_VARIABLE), "string type");
  check(H5Tset_cset(type.id(), ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8), "string type");
  return type;
}

void write_attribute(const Handle& object, const char* name, const std::string& value) {
  const Handle type = string_type(is_ascii(value));
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object.id(), name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  const char* text = value.c_str();
  check(H5Awrite(attribute.id(), type.id(), &text), name);
}

void write_attribute(const Handle& object, const char* name, const std::vector<std::string>& values) {
  const Handle type = string_type(std::all_of(values.begin(), values.end(), is_ascii));
  const hsize_t count = values.size();
  const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose, name);
  const Handle attribute(H5Acreate2(object.id(), name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  std::vector<const char*> texts;
  texts.reserve(values.size());
  for (const std::string& value : values) texts.push_back(value.c_str());
  check(H5Awrite(attribute.id(), type.id(), texts.data()), name);
}

void write_attribute(const Handle& object, const char* name, int value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object.id(), name, H5T_STD_I32LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  check(H5Awrite(attribute.id(), H5T_NATIVE_INT, &value), name);
}

std::vector<std::string> read_strings_attribute(const Handle& object, const char* name) {
  const std::string what = "attribute '" + std::string(name) + "'";
  const Handle attribute(H5Aopen(object.id(), name, H5P_DEFAULT), H5Aclose, what);
  const Handle stored(H5Aget_type(attribute.id()), H5Tclose, what);
  if (H5Tget_class(stored.id()) != H5T_STRING || H5Tis_variable_str(stored.id()) <= 0) {
    throw std::runtime_error(what + " is not a variable-length string");
  }
  const Handle space(H5Aget_space(attribute.id()), H5Sclose, what);
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  constexpr hssize_t kMaxBytes = 1 << 16;  // attributes hold at most 64 KiB
  if (count < 0 || count > kMaxBytes) throw std::runtime_error(what + " has an implausible size");
  const Handle type = string_type(H5Tget_cset(stored.id()) == H5T_CSET_ASCII);
  StringBuffer buffer{type, space, std::vector<char*>(static_cast<std::size_t>(count), nullptr)};
  if (count > 0) check(H5Aread(attribute.id(), type.id(), buffer.strings.data()), what);
  std::vector<std::string> values;
  for (const char* text : buffer.strings) values.emplace_back(text != nullptr ? text : "");
  return values;
}

std::string read_string_attribute(const Handle& object, const char* name) {
  const std::vector<std::string> values = read_strings_attribute(object, name);
  if (values.size() != 1) throw std::runtime_error("attribute '" + std::string(name) + "' is not one string");
  return values.front();
}

int read_int_attribute(const Handle& object, const char* name, int fallback) {
  if (H5Aexists(object.id(), name) <= 0) return fallback;
  const Handle attribute(H5Aopen(object.id(), name, H5P_DEFAULT), H5Aclose, name);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose, name);
  if (H5Sget_simple_extent_npoints(space.id()) != 1) return fallback;
  int value = fallback;
  check(H5Aread(attribute.id(), H5T_NATIVE_INT, &value), name);
  return value;
}

}  // namespace hdf5

namespace hdf5 {

namespace {

constexpr hsize_t kCompressAbove = 16 << 10;  // [bytes]; smaller datasets are not compressed
constexpr hsize_t kChunk = 256 << 10;         // [bytes]

// The oldest format that can hold it, so that MATLAB and old h5py read it.
Handle old_format() {
  Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file access");
  check(H5Pset_libver_bounds(access.id(), H5F_LIBVER_EARLIEST, H5F_LIBVER_V18), "format version");
  return access;
}

Handle dataset_layout(const std::vector<hsize_t>& extent, hsize_t item_size, bool may_compress) {
  Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "dataset layout");
  check(H5Pset_obj_track_times(layout.id(), false), "dataset layout");  // no time stamps: reproducible bytes
  const hsize_t row = item_size * (extent.size() > 1 ? extent[1] : 1);
  if (!may_compress || row * extent[0] <= kCompressAbove) return layout;
  std::vector<hsize_t> chunk = extent;
  chunk[0] = std::min(rows_of_chunk(row), extent[0]);
  check(H5Pset_chunk(layout.id(), static_cast<int>(chunk.size()), chunk.data()), "chunks");
  check(H5Pset_shuffle(layout.id()), "shuffle");
  check(H5Pset_deflate(layout.id(), kDeflateLevel), "deflate");
  return layout;
}

}  // namespace

hsize_t rows_of_chunk(hsize_t row_bytes) { return std::max<hsize_t>(kChunk / row_bytes, 1); }

Handle open_on_disk(const std::filesystem::path& path) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file access");
  check(H5Pset_file_locking(access.id(), false, true), "file access");
  return {H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose, "truncated or damaged"};
}

Handle create_on_disk(const std::filesystem::path& path) {
  const Handle access = old_format();
  return {H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose, "the file"};
}

Handle create_in_memory(const char* name) {
  const Handle access = old_format();
  check(H5Pset_fapl_core(access.id(), 1 << 20, false), "file in memory");
  return {H5Fcreate(name, H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose, "file in memory"};
}

std::string image_of(const Handle& file) {
  check(H5Fflush(file.id(), H5F_SCOPE_GLOBAL), "flushing");
  const ssize_t size = H5Fget_file_image(file.id(), nullptr, 0);
  if (size < 0) fail("file image");
  std::string image(static_cast<std::size_t>(size), '\0');
  if (H5Fget_file_image(file.id(), image.data(), image.size()) != size) fail("file image");
  return image;
}

Handle write_dataset(const Handle& file, const std::string& path, const DatasetValues& values, bool may_compress) {
  const auto& [file_type, memory_type, extent, data] = values;
  const Handle space(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose, path);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, path);
  check(H5Pset_create_intermediate_group(links.id(), 1), path);
  check(H5Pset_char_encoding(links.id(), H5T_CSET_UTF8), path);
  const Handle layout = dataset_layout(extent, H5Tget_size(file_type), may_compress);
  Handle dataset(H5Dcreate2(file.id(), path.c_str(), file_type, space.id(), links.id(), layout.id(), H5P_DEFAULT),
                 H5Dclose, path);
  if (extent[0] > 0) check(H5Dwrite(dataset.id(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), path);
  return dataset;
}

Handle write_strings(const Handle& file, const std::string& path, const std::vector<std::string>& texts) {
  bool ascii = true;
  std::vector<const char*> pointers;
  for (const std::string& text : texts) {
    ascii = ascii && std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
    pointers.push_back(text.c_str());
  }
  const Handle type = string_type(ascii);
  return write_dataset(file, path, {type.id(), type.id(), {texts.size()}, pointers.data()});
}

}  // namespace hdf5

namespace hdf5 {

namespace {

int dimensions(const GrowingShape& shape) { return shape.width > 1 ? 2 : 1; }

Handle layout_of(const GrowingShape& shape) {
  Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "dataset layout");
  check(H5Pset_obj_track_times(layout.id(), false), "dataset layout");  // no time stamps: reproducible bytes
  const std::array<hsize_t, 2> chunk{shape.chunk_rows, shape.width};
  check(H5Pset_chunk(layout.id(), dimensions(shape), chunk.data()), "chunks");
  check(H5Pset_shuffle(layout.id()), "shuffle");
  check(H5Pset_deflate(layout.id(), shape.deflate_level), "deflate");
  return layout;
}

hid_t create(const Handle& file, const std::string& path, hid_t type, const GrowingShape& shape) {
  const std::array<hsize_t, 2> none{0, shape.width}, without_end{H5S_UNLIMITED, shape.width};
  const Handle space(H5Screate_simple(dimensions(shape), none.data(), without_end.data()), H5Sclose, path);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, path);
  check(H5Pset_create_intermediate_group(links.id(), 1), path);
  check(H5Pset_char_encoding(links.id(), H5T_CSET_UTF8), path);
  // One chunk in memory per dataset: a chunk is written once.
  const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose, path);
  check(H5Pset_chunk_cache(access.id(), 3, shape.chunk_rows * shape.width * H5Tget_size(type), 1.0), path);
  const Handle layout = layout_of(shape);
  return H5Dcreate2(file.id(), path.c_str(), type, space.id(), links.id(), layout.id(), access.id());
}

Handle created(const Handle& file, const std::string& group, std::string name, hid_t type, const GrowingShape& shape) {
  const std::string folder = group.empty() ? "" : group + "/";
  hid_t id = create(file, folder + name, type, shape);
  if (id < 0) std::replace(name.begin(), name.end(), '/', '.');
  constexpr int kMaxTries = 4;
  for (int i = 0; i < kMaxTries && id < 0; ++i) {
    id = create(file, folder + name, type, shape);
    name += "_";
  }
  return {id, H5Dclose, folder + name};
}

}  // namespace

GrowingDataset::GrowingDataset(const Handle& file, const std::string& group, const std::string& name, hid_t file_type,
                               const GrowingShape& shape)
    : dataset_(created(file, group, name, file_type, shape)), width_(shape.width) {}

void GrowingDataset::append(hid_t memory_type, hsize_t count, const void* data) {
  if (count == 0) return;
  const int rank = width_ > 1 ? 2 : 1;
  const std::array<hsize_t, 2> begin{rows_, 0}, more{count, width_};
  rows_ += count;
  const std::array<hsize_t, 2> all{rows_, width_};
  check(H5Dset_extent(dataset_.id(), all.data()), "rows");
  const Handle on_disk(H5Dget_space(dataset_.id()), H5Sclose, "rows");
  check(H5Sselect_hyperslab(on_disk.id(), H5S_SELECT_SET, begin.data(), nullptr, more.data(), nullptr), "rows");
  const Handle in_memory(H5Screate_simple(rank, more.data(), nullptr), H5Sclose, "rows");
  check(H5Dwrite(dataset_.id(), memory_type, in_memory.id(), on_disk.id(), H5P_DEFAULT, data), "rows");
}

void describe_dataset(const Handle& dataset, const std::string& unit, const std::string& description) {
  write_attribute(dataset, "unit", unit);
  write_attribute(dataset, "description", description);
}

void write_attribute_u64(const Handle& object, const char* name, unsigned long long value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object.id(), name, H5T_STD_U64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  check(H5Awrite(attribute.id(), H5T_NATIVE_ULLONG, &value), name);
}

}  // namespace hdf5

}  // namespace grapnel
