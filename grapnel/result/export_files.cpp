#include "grapnel/result/export_files.hpp"

#include "grapnel/result/csv_writer.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/mat_writer.hpp"

namespace grapnel {

std::filesystem::path export_csv(const std::filesystem::path& folder) {
  std::filesystem::path path = folder / "timeseries.csv";
  copy_timeseries_csv(folder / "timeseries.h5", path);
  return path;
}

std::filesystem::path export_mat(const std::filesystem::path& folder) {
  const std::filesystem::path source = folder / "timeseries.h5";
  std::filesystem::path path = folder / "timeseries.mat";
  const ReadTimeSeries read = read_timeseries(source);
  write_timeseries_mat(read.series, read.head.metadata, path);
  return path;
}

}  // namespace grapnel
