#include "grapnel/result/csv_writer.hpp"

#include <limits>
#include <optional>
#include <string>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/csv_text.hpp"
#include "grapnel/result/hdf5_reader.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kTextBlock = 1 << 20;  // [bytes] handed to the file at once

/// A scalar's component has no name, or the quantity's own: it would be said twice.
std::string column_name(const Series& s, const std::string& component) {
  const std::string own = s.path.substr(s.path.rfind('/') + 1);
  return component.empty() || (s.width() == 1 && component == own) ? s.path : s.path + "/" + component;
}

std::string header(const TimeSeries& series) {
  std::string line = "time [s],phase";
  for (const Series& s : series.series) {
    for (const std::string& component : s.components) {
      line += "," + csv_quoted(column_name(s, component) + " [" + s.unit + "]");
    }
  }
  return line + "\n";
}

void append_rows(const TimeSeries& series, AtomicFile& file, std::string& text) {
  for (std::size_t sample = 0; sample < series.time.size(); ++sample) {
    append_csv_number(series.time[sample], text);
    text += ",";
    text += csv_quoted(series.phases[static_cast<std::size_t>(series.phase[sample])]);
    for (const Series& s : series.series) {
      const std::size_t width = s.components.size();
      for (std::size_t i = 0; i < width; ++i) {
        text += ",";
        append_csv_number(s.data[sample * width + i], text);
      }
    }
    text += "\n";
    if (text.size() >= kTextBlock) {
      file.write(text);
      text.clear();
    }
  }
}

}  // namespace

void write_timeseries_csv(const TimeSeries& series, const std::filesystem::path& path) {
  check_time_series(series);
  AtomicFile file(path);
  std::string text = header(series);
  append_rows(series, file, text);
  file.write(text);
  file.commit();
}

void copy_timeseries_csv(const std::filesystem::path& timeseries, const std::filesystem::path& path) {
  std::optional<AtomicFile> file;  // not before there is something to write
  std::string text;
  read_timeseries_blocks(
      timeseries, std::numeric_limits<std::uint64_t>::max(),
      [&](const TimeSeriesHead& head) {
        file.emplace(path);
        text = header(head.names);
      },
      [&](const TimeSeries& block) { append_rows(block, *file, text); });
  file->write(text);
  file->commit();
}

}  // namespace grapnel
