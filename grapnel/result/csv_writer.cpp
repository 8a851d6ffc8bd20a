#include "grapnel/result/csv_writer.hpp"

#include <charconv>
#include <cmath>
#include <string>

#include "grapnel/result/atomic_file.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kBlock = 1 << 20;  // [bytes] handed to the file at once

/// A field as RFC 4180 has it: quoted where it must be, quotes doubled.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) {
    if (c == '"') field += '"';
    field += c;
  }
  return field + "\"";
}

/// The shortest text that reads back to the same double; NaN, Inf and -Inf as MATLAB, pandas and C spell or accept
/// them.
void append(double value, std::string& out) {
  if (!std::isfinite(value)) {
    out += std::isnan(value) ? "NaN" : value > 0 ? "Inf" : "-Inf";
    return;
  }
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  out.append(buffer, end);
}

/// A scalar's component has no name, or the quantity's own: it would be said twice.
std::string column_name(const Series& s, const std::string& component) {
  const std::string own = s.path.substr(s.path.rfind('/') + 1);
  return component.empty() || (s.width() == 1 && component == own) ? s.path : s.path + "/" + component;
}

std::string header(const TimeSeries& series) {
  std::string line = "time [s],phase";
  for (const Series& s : series.series) {
    for (const std::string& component : s.components) {
      line += "," + quoted(column_name(s, component) + " [" + s.unit + "]");
    }
  }
  return line + "\n";
}

}  // namespace

void write_timeseries_csv(const TimeSeries& series, const std::filesystem::path& path) {
  check_time_series(series);
  AtomicFile file(path);
  std::string text = header(series);
  for (std::size_t sample = 0; sample < series.time.size(); ++sample) {
    append(series.time[sample], text);
    text += ",";
    text += quoted(series.phases[static_cast<std::size_t>(series.phase[sample])]);
    for (const Series& s : series.series) {
      const std::size_t width = s.components.size();
      for (std::size_t i = 0; i < width; ++i) {
        text += ",";
        append(s.data[sample * width + i], text);
      }
    }
    text += "\n";
    if (text.size() >= kBlock) {
      file.write(text);
      text.clear();
    }
  }
  file.write(text);
  file.commit();
}

}  // namespace grapnel
