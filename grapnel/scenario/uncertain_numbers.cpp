#include "grapnel/scenario/uncertain_numbers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/scenario/reader.hpp"

namespace grapnel {
namespace {

using Kind = NumberDistribution::Kind;

// Probabilities are told apart to about 1e-16 of the larger: what has less than this would be some million values.
constexpr double kLeastPart = 1e-10;
// Of so many deviations less than one number is expected beyond in 10^9 cases, as many as there may be.
constexpr double kFarAway = 6;

std::string far_away(const std::string& name, const NumberDistribution& d, bool above, double deviations) {
  return fmt::format(
      "{}.{} is {:.9g}, {:.4g} deviations {} the {}, {:.9g}; beyond about 37 no probability is left that "
      "double precision knows: correct the interval or the {}, or use uniform",
      name, above ? "from" : "to", above ? d.from : d.to, deviations, above ? "above" : "below",
      d.kind == Kind::normal ? "mean" : "median", d.location, d.kind == Kind::normal ? "mean" : "median");
}

}  // namespace

std::string cut_fault(const std::string& name, const NumberDistribution& d) {
  if (!(d.from < d.to)) return fmt::format("{}.from is {}, must be less than to, {}", name, d.from, d.to);
  if (d.scale == 0) {
    if (d.location >= d.from && d.location <= d.to) return {};
    return fmt::format("{}.{} is {:.9g} and its deviation 0, which is not between {:.9g} and {:.9g}", name,
                       d.kind == Kind::normal ? "mean" : "median", d.location, d.from, d.to);
  }
  if (d.kind == Kind::log_normal && d.to <= 0) return fmt::format("{}.to is {}, must be greater than 0", name, d.to);
  const auto [low, high] = d.standard_bounds();
  const bool above = low > 0;
  // As it is drawn: above the middle by the mirror image, whose probabilities keep their digits.
  const double less = normal_probability(above ? -high : low), most = normal_probability(above ? -low : high);
  if (most < std::numeric_limits<double>::min()) return far_away(name, d, above, above ? low : -high);
  if (most - less < kLeastPart * most)
    return fmt::format("{}.from is {} and to {}, too near to each other for the deviation, {:.9g}: use uniform", name,
                       d.from, d.to, d.scale);
  return {};
}

std::string length_fault(const std::string& name, const Node& given, const NumberDistribution& d) {
  const auto negative = [](const std::string& what, double value) {
    return fmt::format("{} is {:.9g}, must be at least 0", what, value);
  };
  if (given.is_scalar()) return d.location < 0 ? negative(name, d.location) : std::string();
  for (const char* kind : {"normal", "uniform"}) {
    const Node* node = given.find(kind);
    if (!node) continue;
    const std::string whole = name + "." + kind;
    const auto from = number_at(*node, "from");
    if (from && *from < 0) return negative(whole + ".from", *from);
    if (d.is_constant() && d.location < 0) return negative(whole + ".mean", d.location);
    if (d.kind == Kind::normal && !from && d.location < kFarAway * d.scale)
      return fmt::format("{} has mean {:.9g} and deviation {:.9g}, so that lengths below 0 are drawn; add from: 0",
                         whole, d.location, d.scale);
  }
  return {};
}

std::string why_indefinite(const std::vector<double>& matrix, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    if (matrix[i * n + i] < 0) return fmt::format(": [{}][{}] is {}, a variance", i, i, matrix[i * n + i]);
    for (std::size_t j = 0; j < i; ++j) {
      const double most = std::sqrt(std::max(0.0, matrix[i * n + i]) * std::max(0.0, matrix[j * n + j]));
      if (std::abs(matrix[i * n + j]) > most * (1 + 1e-9))
        return fmt::format(": [{}][{}] is {}, at most {:.9g} goes with these variances", i, j, matrix[i * n + j], most);
    }
  }
  return {};
}

}  // namespace grapnel
