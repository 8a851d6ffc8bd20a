#pragma once

/// @file
/// Logs of measurements: CSV, HDF5, MAT, MCAP and rosbag files as named columns of numbers. docs/formats/comparison.md
/// describes the files.

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/text/faults.hpp"

namespace grapnel {

/// A column of a CSV file, a dataset of an HDF5 file, a variable of a MAT file, or a field of messages.
struct LogDataset {
  std::string name;            ///< "gyro_x [deg/s]" in a header, "imu/gyro" in HDF5, "imu.gyro" in MAT and messages
  std::string unit;            ///< as the file states it; empty: it does not
  std::string obstacle;        ///< why it is not a table of numbers; empty: it is
  std::size_t rows = 0;        ///< samples
  std::size_t width = 1;       ///< numbers per sample
  std::vector<double> values;  ///< of the requested datasets, sample after sample; NaN: missing
  std::string topic = {};      ///< of messages, without the first '/': datasets of a topic have common samples
};

enum class LogFormat { csv, hdf5, mat, mcap, rosbag };

/// Whether the log consists of messages with times.
inline bool has_messages(LogFormat format) { return format == LogFormat::mcap || format == LogFormat::rosbag; }

struct MeasuredLog {
  LogFormat format = LogFormat::csv;
  std::shared_ptr<const std::string> source;  ///< the path, for messages
  std::vector<LogDataset> datasets;
  std::vector<int> lines;  ///< of CSV files: the line of each sample
  std::vector<std::string> warnings;
  std::string sha256;  ///< of the file's bytes

  /// The place of a sample in the file for messages: a line of a CSV file; else the file.
  Mark mark_of(std::size_t sample) const;
};

/// A dataset or one column of it.
struct LogColumn {
  std::size_t dataset = 0;
  std::optional<std::size_t> column;  ///< empty: all columns

  std::size_t width(const MeasuredLog& log) const { return column ? 1 : log.datasets[dataset].width; }
};

/// The dataset with this name, with or without the unit in its header and a leading '/'; "name[2]" is one of its
/// columns, counted from 0. Empty: the log has none.
std::optional<LogColumn> find_column(const std::vector<LogDataset>& datasets, std::string_view name);

/// Reads the names of all datasets, and the numbers of the requested ones. Errors of the file are added to `faults`,
/// with line and column, or with the name of the dataset; requested names that the log does not have are no errors
/// here. Empty: not even the names could be read. Formats other than CSV are read in a child process.
std::optional<MeasuredLog> read_log(const std::filesystem::path& path, const std::vector<std::string>& requested,
                                    FaultList& faults);

/// The requested names that a log has, as indices of its datasets.
std::vector<std::size_t> requested_datasets(const std::vector<LogDataset>& datasets,
                                            const std::vector<std::string>& requested);

// The formats. The first reads text, and returns whether it has names; the others run in the child process and throw
// std::runtime_error.

bool read_csv_log(const std::string& text, const std::vector<std::string>& requested, MeasuredLog& log,
                  FaultList& faults);
std::vector<LogDataset> read_hdf5_log(const std::filesystem::path& path, const std::vector<std::string>& requested);
std::vector<LogDataset> read_mat_log(const std::filesystem::path& path, const std::vector<std::string>& requested);

/// A log of messages. A truncated log is read as far as it goes, with a warning.
struct MessageLog {
  std::vector<LogDataset> datasets;
  std::vector<std::string> warnings;
};
/// Whether a file that begins with these bytes is one.
bool is_mcap(std::string_view begin);
bool is_rosbag(std::string_view begin);
MessageLog read_mcap_log(std::string_view bytes, const std::vector<std::string>& requested);
MessageLog read_bag_log(std::string_view bytes, const std::vector<std::string>& requested);

}  // namespace grapnel
