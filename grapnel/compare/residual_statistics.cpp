#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "grapnel/compare/chi_square.hpp"
#include "grapnel/compare/compare_log.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr double kBiasBound = 4;        // standard uncertainties of a bias
constexpr double kOutlier = 6;          // standard deviations from the local median (Hampel 1974)
constexpr std::size_t kHalfWindow = 4;  // samples on either side of it
constexpr std::size_t kLongestSpike = 2;
constexpr double kMostOutliers = 0.01;  // share of the samples
constexpr double kGap = 3;              // median intervals

// One quantity's residuals: those of all samples with a measured and a simulated value.
struct Residuals {
  std::size_t width = 0;
  std::vector<std::size_t> sample;
  std::vector<double> time;      // of the run [s]
  std::vector<double> value;     // width per sample
  std::vector<bool> is_outlier;  // per sample

  double at(std::size_t i, std::size_t c) const { return value[i * width + c]; }
  std::size_t size() const { return sample.size(); }
};

bool is_missing(const ComparedQuantity& quantity, std::size_t sample) {
  const std::size_t width = quantity.curve.width();
  for (std::size_t c = 0; c < width; ++c) {
    if (!std::isfinite(quantity.measured[sample * width + c])) return true;
  }
  return false;
}

Residuals residuals_of(const ComparedQuantity& quantity, const LogClock& clock, const ComparedTimes& times,
                       ComparisonReport::Quantity& report) {
  Residuals r;
  r.width = quantity.residual_width();
  std::array<double, kMostComponents> one{};
  for (std::size_t i = 0; i < quantity.samples(); ++i) {
    if (is_missing(quantity, i)) {
      ++report.missing;
      continue;
    }
    const double time = clock.run_time(quantity.time[i]);
    residual_of(quantity, i, time, {one.data(), r.width});
    const bool has_all = std::all_of(one.begin(), one.begin() + static_cast<std::ptrdiff_t>(r.width),
                                     [](double x) { return std::isfinite(x); });
    if (!has_all || time < times.from || time > times.to) {
      ++report.outside;
      continue;
    }
    r.sample.push_back(i), r.time.push_back(time);
    r.value.insert(r.value.end(), one.begin(), one.begin() + static_cast<std::ptrdiff_t>(r.width));
  }
  r.is_outlier.assign(r.size(), false);
  report.samples = quantity.samples();
  return r;
}

void find_gaps(const ComparedQuantity& quantity, const LogClock& clock, ComparisonReport::Quantity& report) {
  const double usual = median_interval(quantity.time);
  std::optional<double> before;
  for (std::size_t i = 0; i < quantity.samples(); ++i) {
    if (is_missing(quantity, i)) continue;
    if (before && quantity.time[i] - *before > kGap * usual) {
      ++report.gaps;
      if (quantity.time[i] - *before > report.longest_gap.value_or(0))
        report.longest_gap = quantity.time[i] - *before, report.longest_gap_time = clock.run_time(*before);
    }
    before = quantity.time[i];
  }
}

// Marks isolated samples far from the median of their neighbours, for one component.
void mark_spikes(const Residuals& r, std::size_t c, double least_scale, std::vector<bool>& marked) {
  std::vector<double> deviations(r.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    const std::size_t begin = i > kHalfWindow ? i - kHalfWindow : 0, end = std::min(i + kHalfWindow + 1, r.size());
    std::vector<double> window;
    for (std::size_t k = begin; k < end; ++k) window.push_back(r.at(k, c));
    deviations[i] = std::abs(r.at(i, c) - median_of(std::move(window)));
  }
  const double scale = std::max(1.4826 * median_of(deviations), least_scale);
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (deviations[i] > kOutlier * scale) marked[i] = true;
  }
}

// Outliers are spikes of at most two samples, apart from jumps of the run; more than a hundredth of the samples are
// none.
void find_outliers(const ComparedQuantity& quantity, Residuals& r, ComparisonReport::Quantity& report) {
  if (r.size() < 4 * kHalfWindow) return;
  std::vector<bool> marked(r.size(), false);
  for (std::size_t c = 0; c < r.width; ++c) mark_spikes(r, c, quantity.uncertainty.value_or(0), marked);
  const double near = 3 * median_interval(quantity.time);
  for (const double jump : quantity.curve.jumps()) {
    const auto first = std::lower_bound(r.time.begin(), r.time.end(), jump - near);
    for (auto at = first; at != r.time.end() && *at <= jump + near; ++at)
      marked[static_cast<std::size_t>(at - r.time.begin())] = false;
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < r.size();) {
    std::size_t end = i;
    while (end < r.size() && marked[end]) ++end;
    if (end - i > kLongestSpike)
      std::fill(marked.begin() + static_cast<std::ptrdiff_t>(i), marked.begin() + static_cast<std::ptrdiff_t>(end),
                false);
    else
      count += end - i;
    i = end + 1;
  }
  if (count == 0 || static_cast<double>(count) > kMostOutliers * static_cast<double>(r.size())) return;
  r.is_outlier = std::move(marked);
  report.outliers = count;
  const auto first = std::find(r.is_outlier.begin(), r.is_outlier.end(), true);
  report.outlier_time = r.time[static_cast<std::size_t>(first - r.is_outlier.begin())];
}

ComparisonReport::Component component_of(const ComparedQuantity& quantity, const Residuals& r, std::size_t c) {
  ComparisonReport::Component one;
  one.name = quantity.components[c];
  double sum = 0, squares = 0, n = 0;
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (r.is_outlier[i]) continue;
    const double x = r.at(i, c);
    n += 1, sum += x, squares += x * x;
    if (std::abs(x) > std::abs(one.peak) || n == 1) one.peak = x, one.peak_time = r.time[i];
  }
  if (n == 0) return one;
  one.bias = sum / n, one.rms = std::sqrt(squares / n);
  if (quantity.uncertainty) {
    // Covariance s^2 I + b^2 1 1^T: deviations from the mean have the variance s^2, the mean s^2/n + b^2.
    const double s2 = *quantity.uncertainty * *quantity.uncertainty, b = quantity.bias_uncertainty.value_or(0);
    double about_mean = 0;
    for (std::size_t i = 0; i < r.size(); ++i) {
      if (!r.is_outlier[i]) about_mean += (r.at(i, c) - one.bias) * (r.at(i, c) - one.bias);
    }
    one.chi_square = (about_mean / s2 + n * one.bias * one.bias / (s2 + n * b * b)) / n;
  }
  return one;
}

// Of all components, each about its mean.
double autocorrelation_of(const Residuals& r, const std::vector<ComparisonReport::Component>& components) {
  double products = 0, squares = 0;
  for (std::size_t c = 0; c < r.width; ++c) {
    for (std::size_t i = 0; i < r.size(); ++i) {
      if (r.is_outlier[i]) continue;
      const double x = r.at(i, c) - components[c].bias;
      squares += x * x;
      if (i > 0 && !r.is_outlier[i - 1]) products += x * (r.at(i - 1, c) - components[c].bias);
    }
  }
  return squares > 0 ? products / squares : 0;
}

// The component whose bias is most improbable, in its standard uncertainties.
std::pair<double, std::size_t> largest_bias(const ComparedQuantity& quantity,
                                            const ComparisonReport::Quantity& report) {
  const double n = static_cast<double>(report.compared), s = *quantity.uncertainty, b = *quantity.bias_uncertainty;
  std::pair<double, std::size_t> largest{0, 0};
  for (std::size_t c = 0; c < report.components.size(); ++c)
    largest = std::max(largest, {std::abs(report.components[c].bias) / std::sqrt(s * s / n + b * b), c});
  return largest;
}

void judge(const ComparedQuantity& quantity, ComparisonReport::Quantity& report) {
  if (report.compared == 0) {
    report.reason = report.missing == report.samples ? "all samples of the log are missing"
                                                     : "no sample of the log is at a time of the run";
    return;
  }
  if (!quantity.uncertainty) {
    report.reason = "not checked, since the mapping states no uncertainty";
    return;
  }
  const double width = static_cast<double>(report.components.size());
  double sum = 0;
  for (const ComparisonReport::Component& one : report.components) sum += *one.chi_square / width;
  report.chi_square = sum;
  report.chi_square_bound = chi_square_bound(static_cast<double>(report.compared) * width);
  const bool fits = sum <= *report.chi_square_bound;
  report.verdict = fits ? Verdict::yes : Verdict::no;
  report.reason = fmt::format("chi-square {} is {} {}", small_number(sum), fits ? "within" : "above the bound",
                              small_number(*report.chi_square_bound));
  if (!quantity.bias_uncertainty) return;
  const auto [size, component] = largest_bias(quantity, report);
  const bool is_small = size <= kBiasBound * (1 + kStatedAccuracy);
  if (!is_small) report.verdict = Verdict::no;
  report.reason +=
      fmt::format("; the largest bias, of {}, is {} standard uncertainties, {} {}",
                  printable_line(report.components[component].name), small_number(size),
                  is_small ? "within" : "above the bound", small_number(kBiasBound * (1 + kStatedAccuracy)));
}

void find_lag(const ComparedQuantity& quantity, const LogClock& clock, ComparisonReport::Quantity& report) {
  const double time = quantity.curve.characteristic_time();
  if (!std::isfinite(time) || report.compared < 10) return;
  const double most = std::min(2 * time, (quantity.curve.end() - quantity.curve.begin()) / 4);
  const ComparedQuantity* one = &quantity;
  const ClockOffset own =
      find_offset({&one, 1}, {clock.offset - most, clock.offset + most}, {clock.drift, clock.reference, {}});
  if (!own.is_determined) return;
  report.lag = clock.offset - own.offset, report.lag_uncertainty = own.uncertainty;
}

void add_lines(const ComparedQuantity& quantity, const Residuals& r, std::string& csv) {
  for (std::size_t i = 0; i < r.size(); ++i) {
    for (std::size_t c = 0; c < r.width; ++c) {
      csv += csv_quoted(quantity.name) + "," + csv_quoted(quantity.components[c]) + "," + csv_quoted(quantity.unit);
      for (const double x : {r.time[i], quantity.time[r.sample[i]], r.at(i, c)}) {
        csv += ",";
        append_csv_number(x, csv);
      }
      csv += r.is_outlier[i] ? ",outlier\n" : ",compared\n";
    }
  }
}

void add_curves(const ComparedQuantity& quantity, const Residuals& r, LogComparison& comparison) {
  const std::size_t first = comparison.curves.size();
  const double usual = median_interval(quantity.time);
  for (std::size_t c = 0; c < r.width; ++c) {
    ComparedCurve& curve = comparison.curves.emplace_back();
    curve.quantity = comparison.report.quantities.size(), curve.component = quantity.components[c];
    curve.time = r.time;
    curve.is_outlier.assign(r.is_outlier.begin(), r.is_outlier.end());
    for (std::size_t i = 0; i < r.size(); ++i) curve.residual.push_back(r.at(i, c));
    for (std::size_t i = 1; i < r.size(); ++i) {
      if (quantity.time[r.sample[i]] - quantity.time[r.sample[i - 1]] > kGap * usual) curve.after_gaps.push_back(i);
    }
  }
  if (quantity.is_orientation) return;
  for (std::size_t i = 0; i < r.size(); ++i) {
    for (std::size_t c = 0; c < r.width; ++c) {
      const double measured = quantity.measured[r.sample[i] * r.width + c];
      comparison.curves[first + c].simulated.push_back(measured - r.at(i, c));
      comparison.curves[first + c].measured.push_back(measured);
    }
  }
}

ComparisonReport::Quantity evaluate(const ComparedQuantity& quantity, const LogClock& clock, const ComparedTimes& times,
                                    LogComparison& comparison) {
  ComparisonReport::Quantity report;
  report.name = quantity.name, report.run = quantity.run, report.unit = quantity.unit;
  report.columns = quantity.columns;
  report.uncertainty = quantity.uncertainty, report.bias_uncertainty = quantity.bias_uncertainty;
  Residuals r = residuals_of(quantity, clock, times, report);
  find_gaps(quantity, clock, report);
  find_outliers(quantity, r, report);
  report.compared = r.size() - report.outliers;
  double squares = 0;
  for (std::size_t c = 0; c < r.width && report.compared > 0; ++c) {
    const ComparisonReport::Component one = component_of(quantity, r, c);
    squares += one.rms * one.rms / static_cast<double>(r.width);
    if (c == 0 || std::abs(one.peak) > std::abs(*report.peak))
      report.peak = one.peak, report.peak_time = one.peak_time, report.peak_component = one.name;
    report.components.push_back(one);
  }
  if (report.compared > 0) report.rms = std::sqrt(squares);
  report.autocorrelation = autocorrelation_of(r, report.components);
  double error = 0;
  for (const double e : quantity.curve.interpolation_error()) error = std::max(error, std::isnan(e) ? 1e300 : e);
  const bool is_interpolated = r.time.empty() || std::any_of(r.time.begin(), r.time.end(), [&](double t) {
                                 return !quantity.curve.has_sample_at(t);
                               });
  if (!is_interpolated) error = 0;
  if (error < 1e300 && report.compared > 0) report.interpolation_error = (quantity.is_orientation ? 2 : 1) * error;
  find_lag(quantity, clock, report);
  judge(quantity, report);
  add_lines(quantity, r, comparison.residuals_csv);
  add_curves(quantity, r, comparison);
  return report;
}

void add_warnings(const ComparisonReport::Quantity& q, std::vector<std::string>& warnings) {
  const std::string name = printable_line(q.name);
  if (q.missing > 0) warnings.push_back(fmt::format("{}: {} of {} samples are missing", name, q.missing, q.samples));
  if (q.compared > 0 && q.outside > q.compared)
    warnings.push_back(fmt::format("{}: {} of {} samples are outside of the run or of the stated times; {} compared",
                                   name, q.outside, q.samples, q.compared));
  if (q.gaps > 0)
    warnings.push_back(fmt::format("{}: {}, the longest of {:.4g} s at t = {:.6g} s", name, counted(q.gaps, "gap"),
                                   *q.longest_gap, *q.longest_gap_time));
  if (q.outliers > 0)
    warnings.push_back(fmt::format("{}: {} left out, the first at t = {:.6g} s", name, counted(q.outliers, "outlier"),
                                   *q.outlier_time));
  if (q.interpolation_error && *q.interpolation_error > 0.2 * q.uncertainty.value_or(5 * q.rms.value_or(0)))
    warnings.push_back(
        fmt::format("{}: interpolation between samples of the run has an estimated error of {} {}; a shorter "
                    "output.interval reduces it",
                    name, small_number(*q.interpolation_error), q.unit));
  if (q.chi_square && *q.chi_square < 0.25)
    warnings.push_back(
        fmt::format("{}: chi-square {} is far below 1: the stated uncertainty exceeds the scatter, so "
                    "that the verdict detects only large differences",
                    name, small_number(*q.chi_square)));
}

}  // namespace

std::vector<bool> compared_samples(const ComparedQuantity& quantity, const LogClock& clock,
                                   const ComparedTimes& times) {
  ComparisonReport::Quantity ignored;
  Residuals r = residuals_of(quantity, clock, times, ignored);
  find_outliers(quantity, r, ignored);
  std::vector<bool> used(quantity.samples(), false);
  for (std::size_t i = 0; i < r.size(); ++i) used[r.sample[i]] = !r.is_outlier[i];
  return used;
}

void evaluate_residuals(std::span<const ComparedQuantity> quantities, const ComparedTimes& times,
                        LogComparison& comparison) {
  ComparisonReport& report = comparison.report;
  comparison.residuals_csv = "quantity,component,unit,time [s],log time [s],residual,status\n";
  const LogClock clock{report.clock.offset, report.clock.drift, report.clock.reference};
  for (const ComparedQuantity& quantity : quantities) {
    report.quantities.push_back(evaluate(quantity, clock, times, comparison));
    add_warnings(report.quantities.back(), report.warnings);
  }
  report.verdict = report.count(Verdict::no) > 0    ? Verdict::no
                   : report.count(Verdict::yes) > 0 ? Verdict::yes
                                                    : Verdict::not_checked;
}

}  // namespace grapnel
