#include "grapnel/result/hdf5_file.hpp"

#include <algorithm>

namespace grapnel::hdf5 {
namespace {

constexpr hsize_t kCompressAbove = 16 << 10;  // [bytes]; smaller datasets are stored as they are
constexpr hsize_t kChunk = 256 << 10;         // [bytes]

// The oldest format that can hold it, so that MATLAB and old h5py read it.
Handle old_format() {
  Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file access");
  check(H5Pset_libver_bounds(access.id(), H5F_LIBVER_EARLIEST, H5F_LIBVER_V18), "format version");
  return access;
}

Handle dataset_layout(const std::vector<hsize_t>& extent, hsize_t item_size, bool may_compress) {
  Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "dataset layout");
  check(H5Pset_obj_track_times(layout.id(), false), "dataset layout");  // the same bytes tomorrow
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

Handle write_dataset(const Handle& file, const std::string& path, hid_t file_type, hid_t memory_type,
                     const std::vector<hsize_t>& extent, const void* data, bool may_compress) {
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
  return write_dataset(file, path, type.id(), type.id(), {texts.size()}, pointers.data());
}

}  // namespace grapnel::hdf5
