#include "grapnel/campaign/growing_dataset.hpp"

#include <algorithm>

namespace grapnel::hdf5 {
namespace {

constexpr unsigned kDeflateLevel = 1;  // numbers drawn at random hardly shrink whatever the level

Handle layout_of() {
  Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "dataset layout");
  check(H5Pset_obj_track_times(layout.id(), false), "dataset layout");  // the same bytes tomorrow
  check(H5Pset_chunk(layout.id(), 1, &kRowsOfChunk), "chunks");
  check(H5Pset_shuffle(layout.id()), "shuffle");
  check(H5Pset_deflate(layout.id(), kDeflateLevel), "deflate");
  return layout;
}

hid_t create(const Handle& file, const std::string& path, hid_t type) {
  const hsize_t none = 0, without_end = H5S_UNLIMITED;
  const Handle space(H5Screate_simple(1, &none, &without_end), H5Sclose, path);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, path);
  check(H5Pset_create_intermediate_group(links.id(), 1), path);
  check(H5Pset_char_encoding(links.id(), H5T_CSET_UTF8), path);
  // One chunk in memory per dataset: a chunk is written once.
  const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose, path);
  check(H5Pset_chunk_cache(access.id(), 3, kRowsOfChunk * H5Tget_size(type), 1.0), path);
  const Handle layout = layout_of();
  return H5Dcreate2(file.id(), path.c_str(), type, space.id(), links.id(), layout.id(), access.id());
}

Handle created(const Handle& file, const std::string& group, std::string name, hid_t type) {
  const std::string folder = group.empty() ? "" : group + "/";
  hid_t id = create(file, folder + name, type);
  if (id < 0) std::replace(name.begin(), name.end(), '/', '.');
  constexpr int kMostTries = 4;
  for (int i = 0; i < kMostTries && id < 0; ++i) {
    id = create(file, folder + name, type);
    name += "_";
  }
  return {id, H5Dclose, folder + name};
}

}  // namespace

GrowingDataset::GrowingDataset(const Handle& file, const std::string& group, const std::string& name, hid_t file_type)
    : dataset_(created(file, group, name, file_type)) {}

void GrowingDataset::append(hid_t memory_type, hsize_t count, const void* data) {
  if (count == 0) return;
  const hsize_t begin = rows_;
  rows_ += count;
  check(H5Dset_extent(dataset_.id(), &rows_), "rows");
  const Handle on_disk(H5Dget_space(dataset_.id()), H5Sclose, "rows");
  check(H5Sselect_hyperslab(on_disk.id(), H5S_SELECT_SET, &begin, nullptr, &count, nullptr), "rows");
  const Handle in_memory(H5Screate_simple(1, &count, nullptr), H5Sclose, "rows");
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

}  // namespace grapnel::hdf5
