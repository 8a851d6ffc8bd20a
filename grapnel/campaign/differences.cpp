#include "grapnel/campaign/differences.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {

template <>
const Type& type_of<Differentiable>() {
  static constexpr Choice choices[] = {choice(Differentiable::yes, "yes"), choice(Differentiable::no, "NO"),
                                       choice(Differentiable::not_decided, "not decided")};
  static constexpr Type type = enumeration<Differentiable>("Differentiable", choices);
  return type;
}

namespace {

constexpr std::size_t kLevels = 3;                       // steps h, h/r, h/r²
constexpr double kRatio = 1.9;                           // r; not 2, whose multiples fit many oscillations
constexpr std::array<double, 3> kRounds{1, 1.0 / 8, 8};  // factors on the first step
constexpr double kLeastRoom = 1.0 / 8;                   // of the step; nearer to a bound, differences are one-sided
constexpr double kClearly = 5;                           // estimated errors between derivatives that differ

double step_at(double h, std::size_t level) { return h / std::pow(kRatio, static_cast<double>(level)); }

// The values h, h/r and h/r² away on one side of the center; invalid or failed points are null.
using Side = std::array<const FunctionValue*, kLevels>;

// An extrapolated limit for h = 0 and its estimated error.
struct Limit {
  double value = NAN, error = std::numeric_limits<double>::infinity();
};

// The limit of a(h) = a + b h^p + c h^q + ..., from a(h), a(h/r), a(h/r²): of the Richardson table the entry with the
// smallest error estimate, (29.3). `noise`: error of the entry at the smallest step.
Limit limit_of(const std::array<double, kLevels>& a, int p, int q, double noise) {
  const double fp = std::pow(kRatio, p), fq = std::pow(kRatio, q);
  const double b0 = (fp * a[1] - a[0]) / (fp - 1), b1 = (fp * a[2] - a[1]) / (fp - 1);
  const double c = (fq * b1 - b0) / (fq - 1);
  const double change = std::abs(b0 - b1);  // two of three steps can agree by accident
  const std::array<Limit, 3> table{Limit{b0, std::max({std::abs(b0 - a[0]), std::abs(b0 - a[1]), change})},
                                   Limit{b1, std::max({std::abs(b1 - a[1]), std::abs(b1 - a[2]), change})},
                                   Limit{c, std::max(std::abs(c - b0), std::abs(c - b1))}};
  Limit best = *std::min_element(table.begin(), table.end(), [](const Limit& x, const Limit& y) {
    return !std::isnan(x.error) && (std::isnan(y.error) || x.error < y.error);
  });
  best.error += noise;
  return best;
}

// Differences of one outcome by one variable with steps h, h/r, h/r².
class EntryDifferences {
 public:
  EntryDifferences(double center, double h, double size, double scale, double accuracy)
      : center_(center), h_(h), size_(size), scale_(scale), accuracy_(accuracy) {}

  // Both sides, (29.2) to (29.5).
  DerivativeEntry central(const std::array<double, kLevels>& before, const std::array<double, kLevels>& after) const {
    std::array<double, kLevels> mean{}, gap{}, right{}, left{};
    for (std::size_t i = 0; i < kLevels; ++i) {
      const double h = step_at(h_, i);
      mean[i] = (after[i] - before[i]) / (2 * h);
      gap[i] = (after[i] - 2 * center_ + before[i]) / h;
      right[i] = (after[i] - center_) / h, left[i] = (center_ - before[i]) / h;
    }
    const double noise = rounding() / step_at(h_, kLevels - 1);
    const Limit derivative = limit_of(mean, 2, 4, noise), difference = limit_of(gap, 1, 3, 4 * noise);
    DerivativeEntry entry{Differentiable::yes, derivative.value, derivative.error};
    entry.step = h_;
    const double tolerance = allowed(derivative.value);
    if (jumps(after, entry) || jumps(before, entry)) return entry;
    if (std::abs(difference.value) > 2 * tolerance) {
      entry.left = limit_of(left, 1, 2, noise).value, entry.right = limit_of(right, 1, 2, noise).value;
      const bool agree = std::ranges::all_of(gap, [&](double one) {  // noise does not repeat
        return std::abs(one - difference.value) < 0.5 * std::abs(difference.value);
      });
      entry.verdict = agree && std::abs(difference.value) > kClearly * difference.error ? Differentiable::no
                                                                                        : Differentiable::not_decided;
      entry.reason = entry.verdict == Differentiable::no
                         ? fmt::format("a kink: the derivative is {:.4g} below this value and {:.4g} above it",
                                       *entry.left, *entry.right)
                         : "the derivatives below and above this value may differ";
    } else if (!(derivative.error <= tolerance)) {
      too_inaccurate(entry);
    }
    return entry;
  }

  // One side, `sign` +1 or -1.
  DerivativeEntry one_sided(const std::array<double, kLevels>& values, double sign) const {
    std::array<double, kLevels> slope{};
    for (std::size_t i = 0; i < kLevels; ++i) slope[i] = sign * (values[i] - center_) / step_at(h_, i);
    const Limit derivative = limit_of(slope, 1, 2, rounding() / step_at(h_, kLevels - 1));
    DerivativeEntry entry{Differentiable::yes, derivative.value, derivative.error};
    entry.step = h_, entry.is_one_sided = true;
    if (!jumps(values, entry) && !(derivative.error <= allowed(derivative.value))) too_inaccurate(entry);
    return entry;
  }

 private:
  double rounding() const { return accuracy_ * std::max(std::abs(center_), 1e-3 * scale_); }
  // The largest error of a derivative that is determined.
  double allowed(double derivative) const {
    return std::max(kDerivativeAccuracy * std::abs(derivative), kNegligibleChange * scale_ / size_);
  }

  static void too_inaccurate(DerivativeEntry& entry) {
    entry.verdict = Differentiable::not_decided;
    entry.reason = fmt::format("the estimated error {:.2g} is too large", entry.error);
  }

  // The limit of one side differs from the value at the center, (29.6).
  bool jumps(const std::array<double, kLevels>& values, DerivativeEntry& entry) const {
    const double r = kRatio;
    const double b0 = (r * values[1] - values[0]) / (r - 1), b1 = (r * values[2] - values[1]) / (r - 1);
    const double jump = (r * r * b1 - b0) / (r * r - 1) - center_;
    if (!(std::abs(jump) > 10 * kNegligibleChange * scale_)) return false;
    for (const double value : values) {
      if (!(std::abs(value - center_ - jump) < 0.2 * std::abs(jump))) return false;
    }
    entry.verdict = Differentiable::no, entry.derivative = entry.error = NAN;
    entry.reason = fmt::format("a jump by {:.4g} beside this value", std::abs(jump));
    return true;
  }

  double center_, h_, size_, scale_, accuracy_;
};

// "impacts: 2 instead of 1"; empty if there is no difference.
std::string changed_events(const FunctionValue& center, const FunctionValue& other) {
  const auto find = [](const FunctionValue& in, const std::string& name) -> const std::string* {
    for (const auto& [key, text] : in.events) {
      if (key == name) return &text;
    }
    return nullptr;
  };
  const auto shown = [](const std::string* text) { return text && !text->empty() ? *text : std::string("none"); };
  for (const auto& [name, text] : center.events) {
    const std::string* there = find(other, name);
    if (!there || *there != text) return fmt::format("{}: {} instead of {}", name, shown(there), shown(&text));
  }
  for (const auto& [name, text] : other.events) {
    if (!find(center, name)) return fmt::format("{}: {} instead of none", name, shown(&text));
  }
  return {};
}

// One variable.
class VariableDifferences {
 public:
  VariableDifferences(const FunctionValue& center, const DifferenceVariable& variable, std::span<const double> scales,
                      double accuracy, std::size_t number)
      : center_(center),
        variable_(variable),
        scales_(scales),
        accuracy_(accuracy),
        number_(number),
        entries_(scales.size()) {}

  // The points of the next round; none: all entries are determined, or no round is left.
  std::vector<double> next() {
    while (round_ < kRounds.size() && (round_ == 0 || needs(kRounds[round_]))) {
      factor_ = kRounds[round_++];
      double h = factor_ * variable_.step;
      const double below = variable_.value - variable_.least, above = variable_.most - variable_.value;
      uses_before_ = below > 0, uses_after_ = above > 0;
      const double near = std::min(below, above), far = std::max(below, above);
      if (near < h && near >= kLeastRoom * h) h = near;
      if (near < h) uses_before_ = below == far, uses_after_ = !uses_before_, h = std::min(h, far);
      if (!(h > 0) || variable_.value + step_at(h, kLevels - 1) == variable_.value) continue;
      h_ = h;
      std::vector<double> points;
      for (std::size_t i = 0; i < kLevels; ++i) {
        const double step = step_at(h, i);
        points.push_back(variable_.value - step), points.push_back(variable_.value + step);
      }
      return points;
    }
    round_ = kRounds.size();
    return {};
  }

  // Whether a point of next() is evaluated: one outside the bounds is not.
  bool is_used(std::size_t point) const { return point % 2 == 0 ? uses_before_ : uses_after_; }

  // Values at the points of next(); null: not used.
  void take(const std::vector<const FunctionValue*>& values) {
    Side before{}, after{};
    std::string outside_before, outside_after, failure, events;
    const auto put = [&](const FunctionValue* value, Side& side, std::size_t level, std::string& outside, bool& used) {
      if (value && value->is_outside) outside = value->failure, used = false;
      if (!value || value->is_outside) return;
      if (value->values.empty()) {
        failure = value->failure;
        return;
      }
      side[level] = value;
      if (const std::string changed = changed_events(center_, *value); !changed.empty()) events = changed;
    };
    for (std::size_t i = 0; i < kLevels; ++i) {
      put(values[2 * i], before, i, outside_before, uses_before_);
      put(values[2 * i + 1], after, i, outside_after, uses_after_);
    }
    const std::string outside = !outside_after.empty() ? outside_after : outside_before;
    for (std::size_t j = 0; j < entries_.size(); ++j) {
      DerivativeEntry one = entry(before, after, j, failure, outside);
      if (one.verdict != Differentiable::yes && !events.empty() && !std::isnan(center_.values[j]))
        one.reason += (one.reason.empty() ? "" : "; ") + events + " beside this value";
      if (is_better(one, entries_[j])) entries_[j] = std::move(one);
    }
    has_events_ = !events.empty() || !failure.empty() || (!uses_before_ && !uses_after_);
    has_entries_ = true;
  }

  std::size_t number() const { return number_; }
  std::vector<DerivativeEntry> take_entries() {
    for (std::size_t j = 0; j < entries_.size() && !has_entries_; ++j)
      entries_[j].reason = std::isfinite(center_.values[j]) ? "the bounds leave no room for a step" : kAbsent;
    return std::move(entries_);
  }

 private:
  // Smaller steps help where something changes beside the value or the truncation is large; larger ones against noise.
  bool needs(double factor) const {
    return std::any_of(entries_.begin(), entries_.end(), [&](const DerivativeEntry& entry) {
      if (entry.verdict == Differentiable::yes || entry.reason == kAbsent) return false;
      return factor < 1 || (entry.verdict == Differentiable::not_decided && !has_events_);
    });
  }

  bool is_better(const DerivativeEntry& one, const DerivativeEntry& present) const {
    if (!has_entries_) return true;
    // Smaller steps decide about kinks and jumps; larger ones only improve what is not decided.
    if (factor_ < 1) {
      if (present.verdict == Differentiable::yes) return false;
      const bool both_open =
          present.verdict == Differentiable::not_decided && one.verdict == Differentiable::not_decided;
      return !both_open || std::isnan(present.error) || one.error < present.error;
    }
    return present.verdict == Differentiable::not_decided && one.verdict == Differentiable::yes;
  }

  DerivativeEntry entry(const Side& before, const Side& after, std::size_t j, const std::string& failure,
                        const std::string& outside) const {
    DerivativeEntry none{};
    none.step = h_;
    const double center = center_.values[j];
    if (!std::isfinite(center)) {
      none.reason = kAbsent;
      return none;
    }
    if (!uses_before_ && !uses_after_) {
      none.reason = "no neighbouring value is valid" + (outside.empty() ? "" : ": " + outside);
      return none;
    }
    std::array<double, kLevels> below{}, above{};
    bool complete = true, exists = true, nearest = true;
    const auto fill = [&](const Side& side, std::array<double, kLevels>& numbers) {
      for (std::size_t i = 0; i < kLevels; ++i) {
        complete = complete && side[i];
        numbers[i] = side[i] ? side[i]->values[j] : NAN;
        exists = exists && (!side[i] || std::isfinite(numbers[i]));
      }
      nearest = nearest && std::isfinite(numbers[kLevels - 1]);
    };
    if (uses_before_) fill(before, below);
    if (uses_after_) fill(after, above);
    if (!complete || !exists) {
      if (!nearest) none.verdict = Differentiable::no;  // farther points do not tell about this value
      none.reason = !exists ? "the outcome does not exist beside this value" : "beside this value: " + failure;
      return none;
    }
    const EntryDifferences differences(center, h_, variable_.size, scales_[j], accuracy_);
    if (uses_before_ && uses_after_) return differences.central(below, above);
    return uses_after_ ? differences.one_sided(above, 1) : differences.one_sided(below, -1);
  }

  static constexpr const char* kAbsent = "the outcome does not exist";

  const FunctionValue& center_;
  const DifferenceVariable& variable_;
  std::span<const double> scales_;
  double accuracy_;
  std::size_t number_;
  std::vector<DerivativeEntry> entries_;
  std::size_t round_ = 0;
  double factor_ = 1, h_ = 0;
  bool uses_before_ = true, uses_after_ = true, has_events_ = false, has_entries_ = false;
};

}  // namespace

std::vector<std::vector<DerivativeEntry>> differentiate(const FunctionAt& function, const FunctionValue& center,
                                                        std::span<const DifferenceVariable> variables,
                                                        std::span<const double> scales, double accuracy) {
  std::vector<double> at;
  std::vector<VariableDifferences> all;
  for (std::size_t k = 0; k < variables.size(); ++k) {
    at.push_back(variables[k].value);
    all.emplace_back(center, variables[k], scales, accuracy, k);
  }
  // Every round evaluates the points of all variables together.
  while (true) {
    std::vector<std::vector<double>> points;
    std::vector<std::vector<std::size_t>> where(all.size());  // per variable: index of a point, or SIZE_MAX
    for (VariableDifferences& one : all) {
      const std::vector<double> values = one.next();
      for (std::size_t i = 0; i < values.size(); ++i) {
        where[one.number()].push_back(one.is_used(i) ? points.size() : SIZE_MAX);
        if (!one.is_used(i)) continue;
        points.push_back(at);
        points.back()[one.number()] = values[i];
      }
    }
    if (points.empty()) break;
    const std::vector<FunctionValue> values = function(points);
    for (VariableDifferences& one : all) {
      std::vector<const FunctionValue*> mine;
      for (const std::size_t i : where[one.number()]) mine.push_back(i == SIZE_MAX ? nullptr : &values[i]);
      if (!mine.empty()) one.take(mine);
    }
  }
  std::vector<std::vector<DerivativeEntry>> entries;
  for (VariableDifferences& one : all) entries.push_back(one.take_entries());
  return entries;
}

}  // namespace grapnel
