#include "grapnel/result/hdf5_writer.hpp"

#include <stdexcept>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"

namespace grapnel {
namespace {

using hdf5::Handle;
using hdf5::write_attribute;

constexpr const char* kSchema = "grapnel-timeseries/1";
void describe(const Handle& dataset, const std::string& unit, const std::string& description) {
  write_attribute(dataset, "unit", unit);
  write_attribute(dataset, "description", description);
}

void write_instants(const Handle& file, const TimeSeries& series) {
  const hsize_t samples = series.time.size();
  const Handle time =
      hdf5::write_dataset(file, "time", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {samples}, series.time.data());
  describe(time, "s", "time of each sample; an impact has two samples at one time, before and after");
  const Handle phase =
      hdf5::write_dataset(file, "phase", H5T_STD_I32LE, H5T_NATIVE_INT, {samples}, series.phase.data());
  describe(phase, "1", "phase of each sample, counted from 0 in the attribute names");
  write_attribute(phase, "names", series.phases);
}

void write_series(const Handle& file, const Series& s, hsize_t samples, int order) {
  std::vector<hsize_t> extent{samples};
  if (s.width() > 1) extent.push_back(s.components.size());
  const Handle dataset = hdf5::write_dataset(file, s.path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, extent, s.data.data());
  describe(dataset, s.unit, s.description);
  write_attribute(dataset, "components", s.components);
  write_attribute(dataset, "order", order);
}

std::string hdf5_image(const TimeSeries& series, const TimeSeriesMetadata& metadata) {
  const hdf5::Session session;
  const Handle file = hdf5::create_in_memory("timeseries");
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
  return hdf5::image_of(file);
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
