#include "grapnel/compare/compare_log.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "grapnel/compare/log_mapping.hpp"
#include "grapnel/compare/measured_log.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/spatial/pose.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/units.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_of(const MappedQuantity& quantity) {
  if (const std::string* one = std::get_if<std::string>(&quantity.log)) return {*one};
  return std::get<std::vector<std::string>>(quantity.log);
}

const Node& node_of_quantity(const Node& root, std::size_t index) {
  static const Node kAbsent;
  const Node& list = part(root, "quantities");
  return index < list.items.size() ? list.items[index] : kAbsent;
}

// A component or all components of a series of the run.
struct RunSeries {
  std::size_t series = 0;
  std::optional<std::size_t> component;
};

// The series of the run that are needed, without loading the others.
struct RunData {
  TimeSeriesHead head;
  std::vector<double> time;
  std::map<std::size_t, std::vector<double>> values;  // by index of the series

  const Series& series(std::size_t i) const { return head.names.series[i]; }
  std::vector<std::string> paths() const {
    std::vector<std::string> paths;
    for (const Series& one : head.names.series) paths.push_back(one.path);
    return paths;
  }
  std::optional<std::size_t> find(std::string_view path) const {
    for (std::size_t i = 0; i < head.names.series.size(); ++i) {
      if (series(i).path == path) return i;
    }
    return std::nullopt;
  }
  std::optional<RunSeries> find_part(const std::string& name) const {
    if (const auto whole = find(name)) return RunSeries{*whole, {}};
    const std::size_t slash = name.rfind('/');
    const auto whole = slash == std::string::npos ? std::nullopt : find(name.substr(0, slash));
    if (!whole) return std::nullopt;
    const std::vector<std::string>& components = series(*whole).components;
    const auto at = std::find(components.begin(), components.end(), name.substr(slash + 1));
    if (at == components.end()) return std::nullopt;
    return RunSeries{*whole, static_cast<std::size_t>(at - components.begin())};
  }
  // The orientation of a body of the run: `base` => base/quaternion_wxyz.
  std::optional<std::size_t> find_orientation(const std::string& body) const { return find(body + "/quaternion_wxyz"); }
};

// Reads the head of a run, then the series that `select` returns.
template <class Select>
RunData read_run(const fs::path& path, Select select) {
  RunData run;
  read_timeseries_blocks(
      path, std::numeric_limits<std::uint64_t>::max(),
      [&](const TimeSeriesHead& head) {
        run.head = head;
        for (const std::size_t i : select(run)) run.values[i];
      },
      [&](const TimeSeries& block) {
        run.time.insert(run.time.end(), block.time.begin(), block.time.end());
        for (auto& [i, values] : run.values)
          values.insert(values.end(), block.series[i].data.begin(), block.series[i].data.end());
      });
  return run;
}

// The series of a run in memory that `select` returns.
template <class Select>
RunData run_in_memory(const TimeSeries& series, Select select) {
  RunData run;
  run.time = series.time;
  for (const Series& one : series.series)
    run.head.names.series.push_back({one.path, one.unit, one.description, one.components, {}});
  for (const std::size_t i : select(run)) run.values[i] = series.series[i].data;
  return run;
}

// The units in which the log may state a series. Those of joints are of rotary ones; sliding joints have m and N.
std::vector<std::string> units_of_series(const Series& series) {
  std::vector<std::string> units{series.unit};
  if (!series.path.starts_with("joints/")) return units;
  if (series.unit.starts_with("rad")) units.push_back("m" + series.unit.substr(3));
  if (series.unit == "N m") units.push_back("N");
  return units;
}

std::optional<Unit> unit_or_none(const std::string& text) {
  return text == "1" || text == "-" ? Unit{} : unit_named(text);
}

bool has_dimension(const Unit& unit, const std::vector<std::string>& allowed) {
  return std::any_of(allowed.begin(), allowed.end(), [&](const std::string& one) {
    const auto other = unit_or_none(one);
    return other && unit.has_dimension_of(*other);
  });
}

bool is_orientation(const Series& series) {
  return series.path.ends_with("quaternion_wxyz") && series.components.size() == 4;
}

class Comparer {
 public:
  Comparer(const fs::path& run_folder, const fs::path& log, const fs::path& mapping)
      : run_path_(run_folder / "timeseries.h5"), log_path_(log), mapping_path_(mapping) {}
  Comparer(const TimeSeries& run, const fs::path& log, const fs::path& mapping)
      : log_path_(log), mapping_path_(mapping), in_memory_(&run) {}

  AlignedLog read() {
    prepare();
    AlignedLog result;
    describe(result.head);
    set_clock(result.head);
    result.times = times();
    result.quantities = std::move(quantities_);
    return result;
  }

  // Reads the files and the quantities. @throws InputError
  void prepare() {
    read_files();
    for (std::size_t i = 0; log_ && has_run_ && i < mapping_.quantities.size(); ++i) prepare(i);
    check_names();
    faults_.throw_if_any();
    in_memory_ = nullptr;
  }

  // The quantities with the course of another run.
  std::vector<ComparedQuantity> against(const TimeSeries& series) const {
    const RunData run = run_in_memory(series, [&](const RunData& one) { return needed_series(one); });
    std::vector<ComparedQuantity> quantities = quantities_;
    for (std::size_t k = 0; k < quantities.size(); ++k) {
      const MappedQuantity& mapped = mapping_.quantities[mapped_[k]];
      const auto found = run.find_part(mapped.run);
      const bool has_origin = !mapped.frame || !mapped.origin || frame_origin(mapped, run);
      const bool has_marked = !mapped.marker || marked_body(mapped, run);
      if (!found || (mapped.frame && !run.find_orientation(*mapped.frame)) || !has_origin || !has_marked)
        throw std::runtime_error(fmt::format("the run has no series {}", in_quotes(mapped.run)));
      quantities[k].curve = curve_of(mapped, *found, quantities[k].is_orientation, run);
    }
    return quantities;
  }

  ComparedTimes times() const {
    ComparedTimes times;
    times.from = mapping_.time.from.value_or(times.from), times.to = mapping_.time.to.value_or(times.to);
    return times;
  }
  const MappedTime& clock() const { return mapping_.time; }
  ComparisonReport::Log described_log() const {
    static constexpr std::array<const char*, 5> kFormats = {"csv", "hdf5", "mat", "mcap", "rosbag"};
    return {log_path_.filename().string(), log_->sha256, kFormats[static_cast<std::size_t>(log_->format)]};
  }

 private:
  // ---- Files ----

  void read_files() {
    if (!mapping_path_.empty()) {
      auto read = read_mapping(mapping_path_, faults_);
      if (read) mapping_ = std::move(read->mapping), root_ = std::move(read->root);
    }
    const bool has_mapping = !mapping_path_.empty();
    if (!has_mapping) log_ = read_log(log_path_, {}, faults_);  // its names
    read_series();
    if (!has_mapping && !log_) return;
    if (!has_mapping && mapping_.quantities.empty() && has_run_)
      faults_.add({log_->source, 0, 0},
                  fmt::format("no column has the name of a series of the run; a mapping (--map) relates them; columns "
                              "are {}",
                              some_of(log_names())));
    std::vector<std::string> requested = time_columns(mapping_.time.column);
    for (const MappedQuantity& one : mapping_.quantities) {
      for (const std::string& name : names_of(one)) requested.push_back(name);
      if (one.time) requested.push_back(*one.time);
    }
    const std::size_t before = faults_.size();
    log_ = read_log(log_path_, requested, faults_);
    log_is_sound_ = faults_.size() == before;
  }

  // By precedence; the second one of logs of messages only.
  static std::vector<std::string> time_columns(const std::optional<std::string>& stated) {
    if (stated) return {*stated};
    return {"time", "log_time"};
  }

  void read_series() {
    if (in_memory_) {
      run_ = run_in_memory(*in_memory_, [&](const RunData& run) { return needed_series(run); });
      has_run_ = true;
      return;
    }
    try {
      run_ = read_run(run_path_, [&](const RunData& run) {
        if (mapping_path_.empty() && log_) map_equal_names(run);
        return needed_series(run);
      });
      has_run_ = true;
    } catch (const std::exception& error) {
      std::string why = error_text(error);  // "cannot read PATH: reason"
      const std::string path = run_path_.string() + ": ";
      if (const std::size_t at = why.find(path); at != std::string::npos) why.erase(0, at + path.size());
      faults_.add({std::make_shared<const std::string>(run_path_.string()), 0, 0}, "cannot read the run: " + why);
    }
  }

  std::vector<std::size_t> needed_series(const RunData& run) const {
    std::vector<std::size_t> needed;
    for (const MappedQuantity& one : mapping_.quantities) {
      if (const auto found = run.find_part(one.run)) needed.push_back(found->series);
      if (const auto frame = one.frame ? run.find_orientation(*one.frame) : std::nullopt) needed.push_back(*frame);
      if (const auto origin = frame_origin(one, run)) needed.push_back(*origin);
      if (const auto body = marked_body(one, run)) needed.push_back(*body);
    }
    return needed;
  }

  // The position of the body to which positions are relative; that body's orientation is `frame`.
  static std::optional<std::size_t> frame_origin(const MappedQuantity& mapped, const RunData& run) {
    return mapped.frame && mapped.origin ? run.find(*mapped.frame + "/position") : std::nullopt;
  }
  // The orientation of the body that carries the marker.
  static std::optional<std::size_t> marked_body(const MappedQuantity& mapped, const RunData& run) {
    if (!mapped.marker || !mapped.run.ends_with("/position")) return std::nullopt;
    return run.find_orientation(mapped.run.substr(0, mapped.run.rfind('/')));
  }

  // Without a mapping: the series whose columns the log has under the names that Grapnel exports.
  void map_equal_names(const RunData& run) {
    for (const Series& series : run.head.names.series) {
      std::vector<std::string> columns;
      for (const std::string& component : series.components)
        columns.push_back(component.empty() ? series.path : series.path + "/" + component);
      std::string dotted = "grapnel." + series.path;  // of a MAT file
      std::replace(dotted.begin(), dotted.end(), '/', '.');
      const std::size_t slash = series.path.rfind('/');  // of messages: a topic and a field
      std::string field = "run." + series.path;
      if (slash != std::string::npos) (field = series.path)[slash] = '.';
      MappedQuantity quantity;
      quantity.run = series.path;
      const auto whole = find_column(log_->datasets, series.path);
      const bool has_all = std::all_of(columns.begin(), columns.end(), [&](const std::string& c) {
        return find_column(log_->datasets, c).has_value();
      });
      if (whole && whole->width(*log_) == series.components.size())
        quantity.log = series.path;
      else if (has_all && !whole)
        quantity.log = columns;
      else if (find_column(log_->datasets, dotted))
        quantity.log = dotted;
      else if (const auto part = has_messages(log_->format) ? find_column(log_->datasets, field) : std::nullopt;
               part && part->width(*log_) == series.components.size())
        quantity.log = "/" + field;
      else
        continue;
      if (series.components.size() <= kMostComponents) mapping_.quantities.push_back(std::move(quantity));
    }
    if (find_column(log_->datasets, "grapnel.time")) mapping_.time.column = "grapnel.time";
  }

  // ---- Names and units ----

  std::vector<std::string> log_names() const {
    std::vector<std::string> names;
    for (const LogDataset& one : log_->datasets) names.push_back(one.name);
    return names;
  }

  Mark mark_of(std::size_t quantity, std::string_view key) const {
    const Node& node = node_of_quantity(root_, quantity);
    if (const NodeEntry* entry = node.entry(key)) return entry->value.mark;
    return node.mark.source ? node.mark : Mark{log_->source, 0, 0};
  }
  Mark time_mark() const {
    const NodeEntry* entry = part(root_, "time").entry("column");
    return entry ? entry->value.mark : root_.mark.source ? root_.mark : Mark{log_->source, 0, 0};
  }

  // A column with numbers; empty after a fault.
  std::optional<LogColumn> column_named(const std::string& name, const Mark& mark) {
    const auto found = find_column(log_->datasets, name);
    if (!found) {
      const std::string damage = log_->warnings.empty() ? "" : "; " + log_->warnings.front();
      faults_.add(mark, fmt::format("the log has no column {}{}{}", in_quotes(name),
                                    suggestion(name, log_names(), "its columns"), damage));
      return std::nullopt;
    }
    const LogDataset& dataset = log_->datasets[found->dataset];
    if (dataset.obstacle.empty()) return found;
    faults_.add(mark, fmt::format("dataset {} of the log cannot be read: {}", in_quotes(name), dataset.obstacle));
    return std::nullopt;
  }

  double number(const LogColumn& column, std::size_t sample, std::size_t k) const {
    const LogDataset& dataset = log_->datasets[column.dataset];
    return dataset.values[sample * dataset.width + column.column.value_or(k)];
  }

  // Times in seconds; they do not decrease.
  std::optional<std::vector<double>> times_of(const std::string& name, const std::optional<std::string>& unit,
                                              const Mark& mark) {
    const auto column = column_named(name, mark);
    if (!column) return std::nullopt;
    const LogDataset& dataset = log_->datasets[column->dataset];
    if (column->width(*log_) != 1) {
      faults_.add(mark, fmt::format("the times {} have {} columns, must have 1", in_quotes(name), dataset.width));
      return std::nullopt;
    }
    const std::string stated = unit.value_or(dataset.unit.empty() ? "s" : dataset.unit);
    const auto factor = unit_named(stated);
    if (!factor || !factor->has_dimension_of(*unit_named("s"))) {
      faults_.add(mark, fmt::format("the unit of the times {} is {}, must be a time [s, ms]", in_quotes(name),
                                    in_quotes(stated)));
      return std::nullopt;
    }
    std::vector<double> times;
    for (std::size_t i = 0; i < dataset.rows; ++i)
      times.push_back(number(*column, i, 0) * in_si({"1", stated}, *factor));
    return are_times(times, name) ? std::optional(std::move(times)) : std::nullopt;
  }

  bool are_times(const std::vector<double>& times, const std::string& name) {
    if (!log_is_sound_) return true;  // a wrong number has been reported
    if (checked_times_.contains(name)) return checked_times_[name];
    std::size_t wrong = 0, first = 0;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const bool is_right = std::isfinite(times[i]) && (i == 0 || !(times[i] < times[i - 1]));
      if (!is_right && wrong++ == 0) first = i;
    }
    const std::string place =
        log_->lines.empty() ? fmt::format("sample {} (from 0) of {}: ", first, in_quotes(name)) : std::string();
    const std::string more = wrong > 1 ? fmt::format(" (the first of {} such samples)", wrong) : "";
    if (wrong > 0 && !std::isfinite(times[first]))
      faults_.add(log_->mark_of(first), fmt::format("{}the time is missing{}", place, more));
    else if (wrong > 0)
      faults_.add(log_->mark_of(first), fmt::format("{}the time is {} s, must not be less than {} s of the previous "
                                                    "sample{}",
                                                    place, times[first], times[first - 1], more));
    else if (times.size() < 3)
      faults_.add({log_->source, 0, 0},
                  fmt::format("{} has {}, must have at least 3", in_quotes(name), counted(times.size(), "sample")));
    return checked_times_[name] = wrong == 0 && times.size() >= 3;
  }

  // The factor from the log's unit to SI, without `scale`; empty after a fault.
  std::optional<double> factor_of(const MappedQuantity& mapped, std::size_t index, const LogColumn& column,
                                  const Series& series) {
    const std::string stated = mapped.unit.value_or(log_->datasets[column.dataset].unit);
    if (stated.empty()) return 1;
    const auto unit = unit_or_none(stated);
    const std::vector<std::string> allowed = units_of_series(series);
    if (unit && has_dimension(*unit, allowed)) return unit->is_dimensionless() ? 1 : in_si({"1", stated}, *unit);
    const Mark mark = mark_of(index, mapped.unit ? "unit" : "log");
    faults_.add(mark, unit ? fmt::format("the log is in {}, but {} of the run is in {}", stated, series.path,
                                         fmt::join(allowed, " or "))
                           : fmt::format("unknown unit {}; docs/formats/units.md lists them", in_quotes(stated)));
    return std::nullopt;
  }

  // A stated uncertainty in SI.
  std::optional<double> amount_of(const std::optional<double>& value, std::size_t index, const char* key,
                                  const std::string& unit, const Series& series, double factor) {
    if (!value) return std::nullopt;
    const Node& node = part(node_of_quantity(root_, index), key);
    const auto written = number_and_unit(node.written);
    if (!written) return *value * factor;
    const auto given = unit_named(written->unit);
    const bool fits =
        given && has_dimension(*given, unit == series.unit ? units_of_series(series) : std::vector<std::string>{unit});
    if (fits) return in_si(*written, *given);
    faults_.add(node.mark,
                fmt::format("{} is in {}, must be in {}", below(item("quantities", index), key), written->unit, unit));
    return std::nullopt;
  }

  // ---- Quantities ----

  void prepare(std::size_t index) {
    const MappedQuantity& mapped = mapping_.quantities[index];
    const auto found = run_.find_part(mapped.run);
    if (!found) report_unknown(index);
    std::vector<LogColumn> columns;
    const std::vector<std::string> names = names_of(mapped);
    const Node& listed = part(node_of_quantity(root_, index), "log");
    for (std::size_t k = 0; k < names.size(); ++k) {
      const Mark mark = k < listed.items.size() ? listed.items[k].mark : mark_of(index, "log");
      if (const auto column = column_named(names[k], mark)) columns.push_back(*column);
    }
    const auto times = columns.empty() ? std::nullopt : times_for(index, columns[0]);
    const bool frame_known = !mapped.frame || run_.find_orientation(*mapped.frame);
    if (!frame_known)
      faults_.add(mark_of(index, "frame"), fmt::format("the run has no orientation {}{}",
                                                       in_quotes(*mapped.frame + "/quaternion_wxyz"), bodies()));
    if (!found || !times || columns.size() != names.size() || !frame_known) return;
    const Series& series = run_.series(found->series);
    if (!check_shape(index, *found, columns, *times)) return;
    const auto factor = factor_of(mapped, index, columns[0], series);
    if (!factor) return;
    const bool oriented = is_orientation(series) && !found->component;
    ComparedQuantity quantity{
        .name = mapped.name.value_or(mapped.run),
        .run = mapped.run,
        .unit = oriented ? "rad" : series.unit,
        .components = oriented ? std::vector<std::string>{"x", "y", "z"} : series.components,
        .columns = names,
        .time = *times,
        .measured = measured_of(mapped, columns, *factor * mapped.scale, oriented),
        .curve = curve_of(mapped, *found, oriented, run_),
        .is_orientation = oriented,
        .uncertainty = {},
        .bias_uncertainty = {},
        .aligns = mapped.align,
        .series = series.path,
        .component = found->component,
        .frame = mapped.frame.value_or(""),
        .axes = {mapped.axes[0], mapped.axes[1], mapped.axes[2], mapped.axes[3]},
        .average = mapped.average,
    };
    if (mapped.origin) quantity.origin = {(*mapped.origin)[0], (*mapped.origin)[1], (*mapped.origin)[2]};
    if (found->component) quantity.components = {series.components[*found->component]};
    const double amount = oriented ? 1 : *factor;
    quantity.uncertainty = amount_of(mapped.uncertainty, index, "uncertainty", quantity.unit, series, amount);
    quantity.bias_uncertainty =
        amount_of(mapped.bias_uncertainty, index, "bias_uncertainty", quantity.unit, series, amount);
    quantities_.push_back(std::move(quantity));
    mapped_.push_back(index);
  }

  // The times of a column. In logs of messages they are a field of the same messages, or else of a stated topic.
  std::optional<std::vector<double>> times_for(std::size_t index, const LogColumn& column) {
    const MappedQuantity& mapped = mapping_.quantities[index];
    const Mark mark = mapped.time ? mark_of(index, "time") : time_mark();
    const std::optional<std::string>& stated = mapped.time ? mapped.time : mapping_.time.column;
    const std::string& topic = log_->datasets[column.dataset].topic;
    for (const std::string& name : time_columns(stated)) {
      const std::string field = topic + "." + name;
      if (!topic.empty() && find_column(log_->datasets, field)) return times_of(field, mapping_.time.unit, mark);
    }
    const std::string name = stated.value_or("time");
    return mapped.time ? times_of(name, mapping_.time.unit, mark) : common_times(name);
  }

  const std::optional<std::vector<double>>& common_times(const std::string& name) {
    if (!has_common_times_) times_ = times_of(name, mapping_.time.unit, time_mark());
    has_common_times_ = true;
    return times_;
  }

  void report_unknown(std::size_t index) {
    const std::string& name = mapping_.quantities[index].run;
    std::vector<std::string> candidates = run_.paths();
    for (const Series& series : run_.head.names.series) {
      if (!name.starts_with(series.path + "/")) continue;
      candidates.clear();
      for (const std::string& component : series.components) candidates.push_back(series.path + "/" + component);
      break;
    }
    faults_.add(mark_of(index, "run"),
                fmt::format("the run has no series {}{}", in_quotes(name), suggestion(name, candidates, "its series")));
  }

  std::string bodies() const {
    std::vector<std::string> names;
    for (const std::string& path : run_.paths()) {
      if (path.ends_with("/quaternion_wxyz")) names.push_back(path.substr(0, path.rfind('/')));
    }
    return names.empty() ? "" : "; bodies are " + some_of(names);
  }

  // Numbers per sample and samples; errors of keys that the series cannot have.
  bool check_shape(std::size_t index, const RunSeries& found, const std::vector<LogColumn>& columns,
                   const std::vector<double>& times) {
    const MappedQuantity& mapped = mapping_.quantities[index];
    const Series& series = run_.series(found.series);
    const std::size_t before = faults_.size();
    const std::size_t width = found.component ? 1 : series.components.size();
    std::size_t given = 0;
    for (const LogColumn& column : columns) {
      given += column.width(*log_);
      const LogDataset& dataset = log_->datasets[column.dataset];
      if (dataset.rows != times.size())
        faults_.add(mark_of(index, "log"), fmt::format("dataset {} has {}, its times have {}", in_quotes(dataset.name),
                                                       counted(dataset.rows, "sample"), times.size()));
    }
    if (given != width)
      faults_.add(mark_of(index, "log"),
                  fmt::format("{} has {}, the log's columns are {}", mapped.run, counted(width, "component"), given));
    if (width > kMostComponents)
      faults_.add(mark_of(index, "run"),
                  fmt::format("{} has more than {} components; name single ones", mapped.run, kMostComponents));
    const bool oriented = is_orientation(series) && !found.component;
    const bool is_vector = series.components == std::vector<std::string>{"x", "y", "z"} && !found.component;
    const bool is_turned = mapped.axes != std::array<double, 4>{1, 0, 0, 0};
    if ((mapped.frame || is_turned) && !is_vector && !oriented)
      faults_.add(mark_of(index, mapped.frame ? "frame" : "quaternion_wxyz"),
                  "axes have a meaning only for vectors and orientations of the run");
    if (mapped.origin && (!is_vector || series.unit != "m"))
      faults_.add(mark_of(index, "origin"), "an origin has a meaning only for positions");
    if (mapped.origin && mapped.frame && !frame_origin(mapped, run_))
      faults_.add(mark_of(index, "frame"),
                  fmt::format("the run has no position {}", in_quotes(*mapped.frame + "/position")));
    if (mapped.marker && (!is_vector || !marked_body(mapped, run_)))
      faults_.add(mark_of(index, "marker"),
                  "a marker has a meaning only for the position of a body whose orientation is in the run");
    if (mapped.average > 0 && oriented)
      faults_.add(mark_of(index, "average"), "averages of orientations are not supported");
    return faults_.size() == before;
  }

  std::vector<double> measured_of(const MappedQuantity& mapped, const std::vector<LogColumn>& columns, double factor,
                                  bool oriented) const {
    std::vector<double> measured;
    const std::size_t rows = log_->datasets[columns[0].dataset].rows;
    for (std::size_t i = 0; i < rows; ++i) {
      for (const LogColumn& column : columns) {
        for (std::size_t k = 0; k < column.width(*log_); ++k) measured.push_back(factor * number(column, i, k));
      }
      if (oriented && mapped.quaternion_order == QuaternionOrder::xyzw)
        std::rotate(measured.end() - 4, measured.end() - 1, measured.end());
    }
    return measured;
  }

  // The run along the log's axes.
  static RunCurve curve_of(const MappedQuantity& mapped, const RunSeries& found, bool oriented, const RunData& run) {
    const std::vector<double>& all = run.values.at(found.series);
    const std::size_t width = run.series(found.series).components.size();
    std::vector<double> values;
    if (found.component) {
      for (std::size_t k = 0; k < run.time.size(); ++k) values.push_back(all[k * width + *found.component]);
      return RunCurve(run.time, std::move(values), 1).averaged(mapped.average);
    }
    values = all;
    const std::vector<double>* frame = mapped.frame ? &run.values.at(*run.find_orientation(*mapped.frame)) : nullptr;
    const Quaterniond axes{mapped.axes[0], mapped.axes[1], mapped.axes[2], mapped.axes[3]};
    for (std::size_t k = 0; k < run.time.size(); ++k) {
      const double* f = frame ? frame->data() + 4 * k : nullptr;
      const Quaterniond q_WL = f ? Quaterniond{f[0], f[1], f[2], f[3]} * axes : axes;
      if (oriented) {
        turn_orientation(q_WL, k, values);
      } else if (width == 3) {
        const Vector3d turned = transposed_times(rotation_matrix(q_WL), from_origin(mapped, run, k, at(values, k)));
        for (int c = 0; c < 3; ++c) values[3 * k + static_cast<std::size_t>(c)] = turned[c];
      }
    }
    return RunCurve(run.time, std::move(values), width).averaged(mapped.average);
  }

  static Vector3d at(const std::vector<double>& values, std::size_t k) {
    return {values[3 * k], values[3 * k + 1], values[3 * k + 2]};
  }
  static Quaterniond orientation_at(const std::vector<double>& values, std::size_t k) {
    return {values[4 * k], values[4 * k + 1], values[4 * k + 2], values[4 * k + 3]};
  }
  static Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

  // From the origin of the log's axes to the marker, in W: p_WB + R_WB p_BM - (p_WF + R_WF p_FL), of positions.
  static Vector3d from_origin(const MappedQuantity& mapped, const RunData& run, std::size_t k, Vector3d v) {
    if (const auto body = marked_body(mapped, run))
      v = v + rotation_matrix(orientation_at(run.values.at(*body), k)) * vector_of(*mapped.marker);
    if (!mapped.origin) return v;
    const Vector3d origin = vector_of(*mapped.origin);
    if (!mapped.frame) return v - origin;
    const std::vector<double>& frame = run.values.at(*run.find_orientation(*mapped.frame));
    return v - at(run.values.at(*frame_origin(mapped, run)), k) - rotation_matrix(orientation_at(frame, k)) * origin;
  }

  // With the sign of the previous sample, so that components are continuous.
  static void turn_orientation(const Quaterniond& q_WL, std::size_t k, std::vector<double>& values) {
    double* x = values.data() + 4 * k;
    Quaterniond q = conjugate(q_WL) * Quaterniond{x[0], x[1], x[2], x[3]};
    if (k > 0) {
      const double* b = x - 4;
      if (b[0] * q.w + b[1] * q.x + b[2] * q.y + b[3] * q.z < 0) q = {-q.w, -q.x, -q.y, -q.z};
    }
    x[0] = q.w, x[1] = q.x, x[2] = q.y, x[3] = q.z;
  }

  void check_names() {
    for (std::size_t i = 0; i < mapping_.quantities.size(); ++i) {
      const std::string name = mapping_.quantities[i].name.value_or(mapping_.quantities[i].run);
      for (std::size_t k = 0; k < i; ++k) {
        if (mapping_.quantities[k].name.value_or(mapping_.quantities[k].run) != name) continue;
        faults_.add(node_of_quantity(root_, i).mark, fmt::format("duplicate name {} of a quantity; state another one "
                                                                 "with 'name'",
                                                                 in_quotes(name)));
        break;
      }
    }
  }

  // ---- Result ----

  void describe(ComparisonReport& report) const {
    report.version = GRAPNEL_VERSION;
    report.run = {run_.head.metadata.scenario_name, run_.head.metadata.scenario_sha256};
    report.log = described_log();
    report.warnings = log_->warnings;
  }

  void set_clock(ComparisonReport& report) {
    const MappedTime& time = mapping_.time;
    ClockDrift drift;
    const double* stated_drift = std::get_if<double>(&time.drift);
    if (stated_drift)
      drift.value = *stated_drift;
    else
      drift.largest = time.largest_drift;
    drift.reference = time.reference.value_or(first_time());
    report.clock.drift = drift.value;
    if (!stated_drift || drift.value != 0) report.clock.reference = drift.reference;
    if (const double* stated = std::get_if<double>(&time.offset)) {
      report.clock.offset = *stated;
      return;
    }
    const Mark mark = part(part(root_, "time"), "offset").mark;
    std::vector<const ComparedQuantity*> aligned;
    for (const ComparedQuantity& one : quantities_) {
      if (one.aligns) aligned.push_back(&one);
    }
    if (aligned.empty()) faults_.add(mark, "the offset cannot be found: no quantity has 'align: true'");
    faults_.throw_if_any();
    const OffsetRange possible = possible_offsets(aligned);
    const OffsetRange range = time.search ? OffsetRange{(*time.search)[0], (*time.search)[1]} : possible;
    const ClockOffset found = find_offset(aligned, range, drift);
    if (!found.is_determined) faults_.add(mark, "the offset cannot be found: " + found.why_not + "; state a number");
    faults_.throw_if_any();
    report.clock.offset = found.offset, report.clock.found = true;
    report.clock.uncertainty = found.uncertainty, report.clock.other = found.other;
    if (drift.largest) {
      report.clock.drift = found.drift, report.clock.drift_found = true;
      report.clock.drift_uncertainty = found.drift_uncertainty;
    }
    if (found.other)
      report.warnings.push_back(
          fmt::format("an offset of {:.7g} s fits nearly as well as {:.7g} s; time.search "
                      "restricts the search",
                      *found.other, found.offset));
  }

  // Of the log's mapped quantities.
  double first_time() const {
    double first = std::numeric_limits<double>::infinity();
    for (const ComparedQuantity& one : quantities_) first = std::min(first, one.time.front());
    return first;
  }

  fs::path run_path_, log_path_, mapping_path_;
  FaultList faults_;
  LogMapping mapping_;
  Node root_;  // of the mapping; empty without one
  RunData run_;
  bool has_run_ = false;
  std::optional<MeasuredLog> log_;
  bool log_is_sound_ = false;  // no error in its lines
  std::optional<std::vector<double>> times_;
  bool has_common_times_ = false;
  std::map<std::string, bool> checked_times_;
  std::vector<ComparedQuantity> quantities_;
  std::vector<std::size_t> mapped_;        // their indices in the mapping
  const TimeSeries* in_memory_ = nullptr;  // the run while it is prepared; null: in a file
};

}  // namespace

AlignedLog read_aligned_log(const fs::path& run_folder, const fs::path& log, const fs::path& mapping) {
  return Comparer(run_folder, log, mapping).read();
}

struct MappedLog::Prepared {
  Comparer comparer;
};

MappedLog::MappedLog(const TimeSeries& run, const fs::path& log, const fs::path& mapping) {
  Comparer comparer(run, log, mapping);
  comparer.prepare();
  prepared_ = std::make_shared<const Prepared>(Prepared{std::move(comparer)});
}

std::vector<ComparedQuantity> MappedLog::against(const TimeSeries& run) const {
  return prepared_->comparer.against(run);
}
ComparedTimes MappedLog::times() const { return prepared_->comparer.times(); }
const MappedTime& MappedLog::clock() const { return prepared_->comparer.clock(); }
ComparisonReport::Log MappedLog::description() const { return prepared_->comparer.described_log(); }

void apply_drift(AlignedLog& log) {
  const ComparisonReport::Clock& clock = log.head.clock;
  for (ComparedQuantity& one : log.quantities) {
    for (double& t : one.time) t += clock.drift * (t - clock.reference);
  }
}

LogComparison compare_log(const AlignedLog& log) {
  LogComparison result;
  result.report = log.head;
  evaluate_residuals(log.quantities, log.times, result);
  return result;
}

LogComparison compare_log(const fs::path& run_folder, const fs::path& log, const fs::path& mapping) {
  return compare_log(read_aligned_log(run_folder, log, mapping));
}

}  // namespace grapnel
