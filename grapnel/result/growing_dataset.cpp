#include "grapnel/result/growing_dataset.hpp"

#include <algorithm>
#include <array>

namespace grapnel::hdf5 {
namespace {

int dimensions(const GrowingShape& shape) { return shape.width > 1 ? 2 : 1; }

Handle layout_of(const GrowingShape& shape) {
  Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "dataset layout");
  check(H5Pset_obj_track_times(layout.id(), false), "dataset layout");  // the same bytes tomorrow
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
  constexpr int kMostTries = 4;
  for (int i = 0; i < kMostTries && id < 0; ++i) {
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

}  // namespace grapnel::hdf5
