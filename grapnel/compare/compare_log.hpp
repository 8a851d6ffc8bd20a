#pragma once

/// @file
/// Compares a run with a log of measurements.

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grapnel/compare/align_log.hpp"
#include "grapnel/compare/comparison_report.hpp"
#include "grapnel/compare/log_mapping.hpp"
#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// Times of the run to compare.
struct ComparedTimes {
  double from = -std::numeric_limits<double>::infinity(), to = std::numeric_limits<double>::infinity();  // [s]
};

/// The compared samples of one component, for plots. Orientations have residuals only.
struct ComparedCurve {
  std::size_t quantity = 0;  ///< index in the report
  std::string component;
  std::vector<double> time, measured, simulated, residual;  ///< times of the run
  std::vector<std::uint8_t> is_outlier;
  std::vector<std::size_t> after_gaps;  ///< samples that follow a gap in the log
};

/// A comparison, and comparison.csv: all residuals.
struct LogComparison {
  ComparisonReport report;
  std::string residuals_csv;
  std::vector<ComparedCurve> curves;
};

/// Statistics and verdicts of quantities whose clocks are aligned: fills the comparison, except for `version`, `run`,
/// `log` and `clock` of the report, whose offset it uses.
void evaluate_residuals(std::span<const ComparedQuantity> quantities, const ComparedTimes& times,
                        LogComparison& comparison);

/// The quantities of a run that a log measures. Of `head`, `version`, `run`, `log`, `clock` and `warnings` are set.
struct AlignedLog {
  ComparisonReport head;
  ComparedTimes times;
  std::vector<ComparedQuantity> quantities;
};

/// Reads run, log and mapping, and determines the offset between the clocks. @throws InputError with all errors of the
/// three files
AlignedLog read_aligned_log(const std::filesystem::path& run_folder, const std::filesystem::path& log,
                            const std::filesystem::path& mapping);

/// Per sample: whether the statistics use it. Its residual exists, its time of the run is within `times`, and it is not
/// an outlier.
std::vector<bool> compared_samples(const ComparedQuantity& quantity, const LogClock& clock, const ComparedTimes& times);

/// A log that is read once and compared with many runs that have the same series. Thread safety: const members from any
/// thread.
class MappedLog {
 public:
  /// `run`: any of the runs. @throws InputError with all errors of the two files
  MappedLog(const TimeSeries& run, const std::filesystem::path& log, const std::filesystem::path& mapping);

  /// The measured quantities with the course of a run, in the order of the mapping. @throws std::runtime_error if the
  /// run lacks a series
  std::vector<ComparedQuantity> against(const TimeSeries& run) const;
  ComparedTimes times() const;
  const MappedTime& clock() const;
  ComparisonReport::Log description() const;

 private:
  struct Prepared;
  std::shared_ptr<const Prepared> prepared_;
};

/// Removes the drift of the log's clock from the times of all quantities: run time = time + offset.
void apply_drift(AlignedLog& log);

/// The statistics of a log that has been read.
LogComparison compare_log(const AlignedLog& log);

/// Compares `run_folder`/timeseries.h5 with a log. Without a mapping (empty path) the columns of the log that have the
/// names of series of the run are compared, at the same times. @throws InputError with all errors of the three files
LogComparison compare_log(const std::filesystem::path& run_folder, const std::filesystem::path& log,
                          const std::filesystem::path& mapping);

}  // namespace grapnel
