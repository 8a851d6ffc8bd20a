#include "grapnel/compare/comparison_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "grapnel/compare/momentum_fields.hpp"
#include "grapnel/describe/json.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

enum class ComparisonFormat { first };

std::string clock_text(const ComparisonReport& report) {
  const ComparisonReport::Clock& clock = report.clock;
  std::string text = fmt::format("offset: run time = log time {} {:.7g} s", clock.offset < 0 ? "-" : "+",
                                 clock.offset < 0 ? -clock.offset : clock.offset);
  text += clock.uncertainty ? fmt::format(", found, standard uncertainty {} s", small_number(*clock.uncertainty))
                            : ", as stated";
  text += "\n";
  if (clock.drift != 0 || clock.drift_found)
    text += fmt::format("drift: {:.5g} ppm after log time {:.10g} s{}\n", 1e6 * clock.drift, clock.reference,
                        clock.drift_uncertainty ? fmt::format(", found, standard uncertainty {} ppm",
                                                              small_number(1e6 * *clock.drift_uncertainty))
                                                : ", as stated");
  return text;
}

}  // namespace

std::string optional_number(const std::optional<double>& value) { return value ? small_number(*value) : "-"; }

std::string verdict_word(Verdict verdict) {
  return verdict == Verdict::yes ? "yes" : verdict == Verdict::no ? "NO" : "not checked";
}

template <>
struct Described<ComparisonFormat> {
  static constexpr Choice choices[] = {choice(ComparisonFormat::first, "grapnel-log-comparison/1")};
  static constexpr Type type = enumeration<ComparisonFormat>("ComparisonFormat", choices);
};

template <>
struct Described<ComparisonReport::Component> {
  using T = ComparisonReport::Component;
  static constexpr Field fields[] = {
      field<&T::name>("name", "component of the series; of a vector x, y, z along the log's axes"),
      field<&T::rms>("rms", "as the quantity", "root mean square residual"),
      field<&T::bias>("bias", "as the quantity", "mean residual"),
      field<&T::peak>("peak", "as the quantity", "residual of the largest magnitude, with its sign"),
      field<&T::peak_time>("peak_time", "s", "its time, of the run"),
      field<&T::chi_square>("chi_square", "1",
                            "chi-square divided by the number of compared samples; absent without an uncertainty"),
  };
  static constexpr Type type = structure<T>("ComparedComponent", "residuals of one component.", fields);
};

template <>
struct Described<ComparisonReport::Quantity> {
  using T = ComparisonReport::Quantity;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the quantity in the mapping"),
      field<&T::run>("run", "series of the run"),
      field<&T::columns>("columns", "columns of the log"),
      field<&T::unit>("unit", "unit of the residuals"),
      field<&T::verdict>("agrees",
                         "whether the residuals are consistent with the stated uncertainty; not_checked without one"),
      field<&T::reason>("reason", "the values behind the verdict"),
      field<&T::samples>("samples", "1", "samples in the log"),
      field<&T::compared>("compared", "1", "samples behind the statistics"),
      field<&T::missing>("missing", "1", "samples without a number in the log"),
      field<&T::outside>("outside", "1",
                         "samples at times for which the run has no value, or outside `time.from` to `time.to`"),
      field<&T::outliers>("outliers", "1", "isolated samples that the statistics leave out"),
      field<&T::outlier_time>("outlier_time", "s", "time of the first one, of the run; absent without outliers"),
      field<&T::gaps>("gaps", "1", "intervals in the log that are more than three times as long as the median"),
      field<&T::longest_gap>("longest_gap", "s", "the longest of them; absent without gaps"),
      field<&T::longest_gap_time>("longest_gap_time", "s", "its beginning, of the run; absent without gaps"),
      field<&T::rms>("rms", "as `unit`",
                     "root mean square residual of all components together; absent: no sample is compared"),
      field<&T::peak>("peak", "as `unit`", "residual of the largest magnitude, with its sign"),
      field<&T::peak_time>("peak_time", "s", "its time, of the run"),
      field<&T::peak_component>("peak_component", "its component"),
      field<&T::lag>("lag", "s",
                     "delay of this quantity in the log, with the common offset; positive: the log is late; absent: "
                     "not determined"),
      field<&T::lag_uncertainty>("lag_uncertainty", "s", "its standard uncertainty"),
      field<&T::uncertainty>("uncertainty", "as `unit`", "stated standard uncertainty; absent: none is stated"),
      field<&T::bias_uncertainty>("bias_uncertainty", "as `unit`",
                                  "stated standard uncertainty of the bias; absent: none is stated"),
      field<&T::chi_square>("chi_square", "1",
                            "chi-square divided by the number of compared numbers; absent without an uncertainty"),
      field<&T::chi_square_bound>("chi_square_bound", "1", "largest value that agrees"),
      field<&T::interpolation_error>("interpolation_error", "as `unit`",
                                     "estimated root mean square error of interpolation between samples of the run; "
                                     "absent with too few samples"),
      field<&T::autocorrelation>("autocorrelation", "1",
                                 "correlation of each residual with the next; near 0 for white noise"),
      field<&T::components>("components", "residuals by component"),
  };
  static constexpr Type type = structure<T>("ComparedQuantity", "a measured quantity against the run.", fields);
};

template <>
struct Described<ComparisonReport::Run> {
  using T = ComparisonReport::Run;
  static constexpr Field fields[] = {
      field<&T::scenario>("scenario", "name of the scenario"),
      field<&T::sha256>("sha256", "SHA-256 of the scenario, as in summary.json"),
  };
  static constexpr Type type = structure<T>("ComparedRun", "the run.", fields);
};

template <>
struct Described<ComparisonReport::Log> {
  using T = ComparisonReport::Log;
  static constexpr Field fields[] = {
      field<&T::file>("file", "name of the log, without its folder"),
      field<&T::sha256>("sha256", "SHA-256 of the log"),
      field<&T::format>("format", "csv, hdf5, mat, mcap or rosbag"),
  };
  static constexpr Type type = structure<T>("ComparedLog", "the log.", fields);
};

template <>
struct Described<ComparisonReport::Clock> {
  using T = ComparisonReport::Clock;
  static constexpr Field fields[] = {
      field<&T::offset>("offset", "s", "time of the run minus time of the log; with a drift, at `reference`"),
      field<&T::found>("found", "whether the comparison determined it"),
      field<&T::uncertainty>("uncertainty", "s",
                             "its standard uncertainty, for uncorrelated noise; absent if it is stated"),
      field<&T::other>("other", "s", "another offset that fits nearly as well; absent: none does"),
      field<&T::drift>("drift", "1", "rate of the run's time per time of the log, minus 1"),
      field<&T::reference>("reference", "s", "time of the log from which the drift counts"),
      field<&T::drift_found>("drift_found", "whether the comparison determined the drift"),
      field<&T::drift_uncertainty>("drift_uncertainty", "1",
                                   "its standard uncertainty, for uncorrelated noise; absent if it is stated"),
  };
  static constexpr Type type = structure<T>("LogClock", "the clock of the log.", fields);
};

template <>
const Type& type_of<ComparisonReport>() {
  using T = ComparisonReport;
  static constexpr Field fields[] = {
      derived<[](const T&) { return ComparisonFormat::first; }>("schema", "", "format of this file"),
      field<&T::version>("version", "version of Grapnel"),
      field<&T::verdict>("agrees",
                         "no: a quantity disagrees; yes: every quantity with an uncertainty agrees; not_checked: none "
                         "has one"),
      derived<[](const T& c) { return c.count(Verdict::yes) + c.count(Verdict::no); }>(
          "checked", "1", "number of quantities with a verdict"),
      field<&T::run>("run", "the run"),
      field<&T::log>("log", "the log"),
      field<&T::clock>("clock", "the clock of the log"),
      field<&T::quantities>("quantities", "in the order of the mapping"),
      field<&T::momentum>("momentum", "momentum and energy of the measured motion of the robot and of each target"),
      field<&T::momentum_reason>("momentum_reason", "why `momentum` is empty; else empty"),
      field<&T::warnings>("warnings", "doubts about the comparison"),
  };
  static constexpr Type type =
      structure<T>("LogComparison", "residuals of a log against a run: measured minus simulated.", fields);
  return type;
}

std::size_t ComparisonReport::count(Verdict of) const {
  return static_cast<std::size_t>(
      std::count_if(quantities.begin(), quantities.end(), [&](const Quantity& q) { return q.verdict == of; }));
}

std::string comparison_report_json(const ComparisonReport& report) { return json_text(json_of(report)); }

namespace {

// Of the components, the bias with the largest magnitude.
double largest_bias(const ComparisonReport::Quantity& q) {
  double bias = 0;
  for (const ComparisonReport::Component& one : q.components) {
    if (std::abs(one.bias) > std::abs(bias)) bias = one.bias;
  }
  return bias;
}

}  // namespace

std::string comparison_report_text(const ComparisonReport& report) {
  std::string text = clock_text(report) + "\n";
  TextTable table;
  table.row({"residuals", "unit", "samples", "rms", "bias", "peak", "at t [s]", "lag [ms]", "chi-square", "agrees"});
  for (const ComparisonReport::Quantity& q : report.quantities) {
    const auto lag = q.lag ? std::optional(std::round(1e7 * *q.lag) / 1e4 + 0.0) : std::nullopt;  // [ms]
    const auto peak_time = q.peak_time ? short_number(*q.peak_time) : "-";
    const auto bias = q.components.empty() ? std::nullopt : std::optional(largest_bias(q));
    table.row({printable_line(q.name), q.unit, std::to_string(q.compared), optional_number(q.rms),
               optional_number(bias), optional_number(q.peak), peak_time, optional_number(lag),
               optional_number(q.chi_square), verdict_word(q.verdict)});
  }
  text += table.text() + "\n";
  for (const ComparisonReport::Quantity& q : report.quantities)
    text += paragraph(fmt::format("{}: {}", printable_line(q.name), q.reason), "");
  const auto is_determined = [](const MeasuredComponent& one) { return one.determined; };
  const bool has_momentum = std::any_of(report.momentum.begin(), report.momentum.end(), [&](const MomentumReport& one) {
    return std::any_of(one.first.begin(), one.first.end(), is_determined);
  });
  if (has_momentum) text += "\n" + momentum_report_text(report.momentum);
  for (const std::string& warning : report.warnings) text += paragraph("warning: " + warning, "");
  const std::size_t checked = report.count(Verdict::yes) + report.count(Verdict::no);
  return text + fmt::format("\nagrees: {} ({} of {} checked)\n", verdict_word(report.verdict), checked,
                            report.quantities.size());
}

}  // namespace grapnel
