#include "grapnel/result/export_files.hpp"

#include "grapnel/result/csv_writer.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/mat_writer.hpp"

namespace grapnel {

std::filesystem::path export_csv(const std::filesystem::path& folder) {
  std::filesystem::path path = folder / "timeseries.csv";
  write_timeseries_csv(read_timeseries_hdf5(folder / "timeseries.h5"), path);
  return path;
}

std::filesystem::path export_mat(const std::filesystem::path& folder) {
  const std::filesystem::path source = folder / "timeseries.h5";
  std::filesystem::path path = folder / "timeseries.mat";
  write_timeseries_mat(read_timeseries_hdf5(source), read_timeseries_metadata(source), path);
  return path;
}

}  // namespace grapnel
