#include "grapnel/result/hdf5_writer.hpp"

#include <algorithm>
#include <stdexcept>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_handle.hpp"

namespace grapnel {
namespace {

using hdf5::check;
using hdf5::Handle;
using hdf5::write_attribute;

constexpr const char* kSchema = "grapnel-timeseries/1";
constexpr hsize_t kCompressAbove = 16 << 10;  // [bytes]; smaller datasets are stored as they are
constexpr hsize_t kChunk = 256 << 10;         // [bytes]
constexpr unsigned kDeflateLevel = 4;

/// A file in memory: nothing that HDF5 does can then half-write the disk.
Handle create_in_memory() {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file access");
  check(H5Pset_fapl_core(access.id(), 1 << 20, false), "file in memory");
  // The oldest format that can hold it, so that MATLAB and old h5py read it.
  check(H5Pset_libver_bounds(access.id(), H5F_LIBVER_EARLIEST, H5F_LIBVER_V18), "format version");
  return {H5Fcreate("timeseries", H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose, "file in memory"};
}

std::string image_of(const Handle& file) {
  check(H5Fflush(file.id(), H5F_SCOPE_GLOBAL), "flushing");
  const ssize_t size = H5Fget_file_image(file.id(), nullptr, 0);
  if (size < 0) hdf5::fail("file image");
  std::string image(static_cast<std::size_t>(size), '\0');
  if (H5Fget_file_image(file.id(), image.data(), image.size()) != size) hdf5::fail("file image");
  return image;
}

Handle dataset_layout(const std::vector<hsize_t>& extent, hsize_t item_size) {
  Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "dataset layout");
  check(H5Pset_obj_track_times(layout.id(), false), "dataset layout");  // the same bytes tomorrow
  const hsize_t row = item_size * (extent.size() > 1 ? extent[1] : 1);
  if (row * extent[0] <= kCompressAbove) return layout;
  std::vector<hsize_t> chunk = extent;
  chunk[0] = std::clamp<hsize_t>(kChunk / row, 1, extent[0]);
  check(H5Pset_chunk(layout.id(), static_cast<int>(chunk.size()), chunk.data()), "chunks");
  check(H5Pset_shuffle(layout.id()), "shuffle");
  check(H5Pset_deflate(layout.id(), kDeflateLevel), "deflate");
  return layout;
}

Handle write_dataset(const Handle& file, const std::string& path, hid_t file_type, hid_t memory_type,
                     const std::vector<hsize_t>& extent, const void* data) {
  const Handle space(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose, path);
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose, path);
  check(H5Pset_create_intermediate_group(links.id(), 1), path);
  check(H5Pset_char_encoding(links.id(), H5T_CSET_UTF8), path);
  const Handle layout = dataset_layout(extent, H5Tget_size(file_type));
  Handle dataset(H5Dcreate2(file.id(), path.c_str(), file_type, space.id(), links.id(), layout.id(), H5P_DEFAULT),
                 H5Dclose, path);
  if (extent[0] > 0) check(H5Dwrite(dataset.id(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), path);
  return dataset;
}

void describe(const Handle& dataset, const std::string& unit, const std::string& description) {
  write_attribute(dataset, "unit", unit);
  write_attribute(dataset, "description", description);
}

void write_instants(const Handle& file, const TimeSeries& series) {
  const hsize_t samples = series.time.size();
  const Handle time = write_dataset(file, "time", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {samples}, series.time.data());
  describe(time, "s", "time of each sample; an impact has two samples at one time, before and after");
  const Handle phase = write_dataset(file, "phase", H5T_STD_I32LE, H5T_NATIVE_INT, {samples}, series.phase.data());
  describe(phase, "1", "phase of each sample, counted from 0 in the attribute names");
  write_attribute(phase, "names", series.phases);
}

void write_series(const Handle& file, const Series& s, hsize_t samples, int order) {
  std::vector<hsize_t> extent{samples};
  if (s.width() > 1) extent.push_back(s.components.size());
  const Handle dataset = write_dataset(file, s.path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, extent, s.data.data());
  describe(dataset, s.unit, s.description);
  write_attribute(dataset, "components", s.components);
  write_attribute(dataset, "order", order);
}

std::string hdf5_image(const TimeSeries& series, const TimeSeriesMetadata& metadata) {
  const hdf5::Session session;
  const Handle file = create_in_memory();
  {
    const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "/");
    write_attribute(root, "schema", kSchema);
    write_attribute(root, "version", metadata.version);
    write_attribute(root, "scenario", metadata.scenario_name);
    write_attribute(root, "sha256", metadata.scenario_sha256);
    write_instants(file, series);
    int order = 0;
    for (const Series& s : series.series) {
      if (s.width() > 0) write_series(file, s, series.time.size(), order);
      ++order;
    }
  }
  return image_of(file);
}

}  // namespace

void write_timeseries_hdf5(const TimeSeries& series, const TimeSeriesMetadata& metadata,
                           const std::filesystem::path& path) {
  check_time_series(series);
  std::string image;
  try {
    image = hdf5_image(series, metadata);
    seal(image);
  } catch (const std::exception& e) {
    throw std::runtime_error("cannot write " + path.string() + ": " + e.what());
  }
  write_file_atomically(path, image);
}

}  // namespace grapnel
