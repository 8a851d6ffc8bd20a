#include "grapnel/campaign/uncertain_value.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

namespace {

double polynomial(std::span<const double> coefficients, double x) {
  double sum = 0;
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) sum = sum * x + *c;
  return sum;
}

// The coefficients of AS 241: numerators and denominators for |p - 1/2| <= 0.425, then by r = sqrt(-log min(p, 1 - p))
// to 5, then beyond.
constexpr double kA[] = {3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
                         1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
                         3.3430575583588128105e4, 2.5090809287301226727e3};
constexpr double kB[] = {1.0,
                         4.2313330701600911252e1,
                         6.8718700749205790830e2,
                         5.3941960214247511077e3,
                         2.1213794301586595867e4,
                         3.9307895800092710610e4,
                         2.8729085735721942674e4,
                         5.2264952788528545610e3};
constexpr double kC[] = {1.42343711074968357734e0,  4.63033784615654529590e0, 5.76949722146069140550e0,
                         3.64784832476320460504e0,  1.27045825245236838258e0, 2.41780725177450611770e-1,
                         2.27238449892691845833e-2, 7.74545014278341407640e-4};
constexpr double kD[] = {1.0,
                         2.05319162663775882187e0,
                         1.67638483018380384940e0,
                         6.89767334985100004550e-1,
                         1.48103976427480074590e-1,
                         1.51986665636164571966e-2,
                         5.47593808499534494600e-4,
                         1.05075007164441684324e-9};
constexpr double kE[] = {6.65790464350110377720e0,  5.46378491116411436990e0,  1.78482653991729133580e0,
                         2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
                         2.71155556874348757815e-5, 2.01033439929228813265e-7};
constexpr double kF[] = {1.0,
                         5.99832206555887937690e-1,
                         1.36929880922735805310e-1,
                         1.48753612908506148525e-2,
                         7.86869131145613259100e-4,
                         1.84631831751005468180e-5,
                         1.42151175831644588870e-7,
                         2.04426310338993978564e-15};

// The normal quantile between the probabilities of `low` and `high`, at the fraction u between them.
double cut_normal(double low, double high, double u) {
  // Above the middle, probabilities near 1 would lose digits: there it is the mirror image.
  if (low > 0) return -cut_normal(-high, -low, 1 - u);
  const double p = normal_probability(low), q = normal_probability(high);
  const double z = normal_quantile(std::clamp(p + u * (q - p), 0x1p-1060, 1 - 0x1p-53));
  return std::clamp(z, low, high);
}

}  // namespace

double normal_probability(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

double normal_quantile(double p) {
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * polynomial(kA, r) / polynomial(kB, r);
  }
  double r = std::sqrt(-std::log(q < 0 ? p : 1 - p));
  double z = 0;
  if (r <= 5) {
    r -= 1.6;
    z = polynomial(kC, r) / polynomial(kD, r);
  } else {
    r -= 5;
    z = polynomial(kE, r) / polynomial(kF, r);
  }
  return q < 0 ? -z : z;
}

std::array<double, 2> NumberDistribution::standard_bounds() const {
  if (kind != Kind::log_normal) return {(from - location) / scale, (to - location) / scale};
  return {from > 0 ? std::log(from / location) / scale : -40, std::log(to / location) / scale};
}

double NumberDistribution::at(double u) const {
  switch (kind) {
    case Kind::constant:
      return location;
    case Kind::normal: {
      if (!cut) return location + scale * normal_quantile(u);
      const auto [low, high] = standard_bounds();
      const double z = cut_normal(low, high, u);
      return std::clamp(location + scale * z, from, to);
    }
    case Kind::log_normal: {
      if (!cut) return location * std::exp(scale * normal_quantile(u));
      const auto [low, high] = standard_bounds();
      const double z = cut_normal(low, high, u);
      return std::clamp(location * std::exp(scale * z), from, to);
    }
    case Kind::uniform:
      return std::clamp(from + u * (to - from), from, to);
    case Kind::integers:
      break;
  }
  return std::min(from + std::floor(u * (to - from + 1)), to);
}

Vector3d random_direction(double u, double v) {
  const double z = 1 - 2 * u, radius = 2 * std::sqrt(u * (1 - u));
  const auto turn = sine_cosine(2 * std::numbers::pi * v);
  return {radius * turn.cosine, radius * turn.sine, z};
}

Quaterniond random_rotation(double u, double v, double w) {
  const double a = std::sqrt(1 - u), b = std::sqrt(u);
  const auto s = sine_cosine(2 * std::numbers::pi * v), t = sine_cosine(2 * std::numbers::pi * w);
  return {b * t.cosine, a * s.sine, a * s.cosine, b * t.sine};
}

Quaterniond quaternion_by(const Vector3d& rotation_vector) {
  const double angle = norm(rotation_vector);
  if (!(angle > 0)) return Quaterniond::identity();
  const auto half = sine_cosine(0.5 * angle);
  const Vector3d v = (half.sine / angle) * rotation_vector;
  return {half.cosine, v[0], v[1], v[2]};
}

Vector3d tilted(const Vector3d& vector, double t1, double t2) {
  const double length = norm(vector);
  const double angle = std::hypot(t1, t2);
  if (!(length > 0) || !(angle > 0)) return vector;
  const Vector3d n = (1 / length) * vector;
  // Two axes perpendicular to it and to each other; of W's axes the one farthest from it begins.
  int k = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(n[i]) < std::abs(n[k])) k = i;
  }
  Vector3d a = cross(n, Vector3d::unit(k));
  a = (1 / norm(a)) * a;
  const Vector3d b = cross(n, a);
  const auto turn = sine_cosine(angle);
  return length * (turn.cosine * n + (turn.sine / angle) * (t1 * a + t2 * b));
}

std::optional<std::vector<double>> semidefinite_factor(std::span<const double> matrix, std::size_t n) {
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, std::abs(matrix[i * n + i]));
  const double tolerance = 1e-12 * largest;
  std::vector<double> L(n * n, 0.0);
  for (std::size_t j = 0; j < n; ++j) {
    const auto rest = [&](std::size_t i) {
      double sum = matrix[i * n + j];
      for (std::size_t k = 0; k < j; ++k) sum -= L[i * n + k] * L[j * n + k];
      return sum;
    };
    const double pivot = rest(j);
    if (pivot < -tolerance) return {};
    const bool is_zero = pivot <= tolerance;
    L[j * n + j] = is_zero ? 0 : std::sqrt(pivot);
    for (std::size_t i = j + 1; i < n; ++i) {
      const double below = rest(i);
      // Beside a zero on the diagonal of what is left there can be nothing: |a_ij| <= sqrt(a_ii a_jj).
      if (is_zero && std::abs(below) > std::sqrt(tolerance * largest)) return {};
      if (!is_zero) L[i * n + j] = below / L[j * n + j];
    }
  }
  return L;
}

std::size_t chosen(std::span<const double> running_sums, double u) {
  const double mark = u * running_sums.back();
  const auto it = std::upper_bound(running_sums.begin(), running_sums.end(), mark);
  return std::min(static_cast<std::size_t>(it - running_sums.begin()), running_sums.size() - 1);
}

namespace {

double formed(ValueForm form, double nominal, double drawn) {
  switch (form) {
    case ValueForm::factor:
      return nominal * drawn;
    case ValueForm::offset:
      return nominal + drawn;
    case ValueForm::value:
      break;
  }
  return drawn;
}

std::size_t varying(const NumberDistribution& distribution) { return distribution.is_constant() ? 0 : 1; }

// Draws along the coordinates of a point.
class Drawer {
 public:
  Drawer(std::span<const double> nominal, std::span<const double> point) : nominal_(nominal), point_(point) {}

  DrawnValue operator()(const IndependentNumbers& value) {
    DrawnValue drawn;
    for (std::size_t i = 0; i < value.distributions.size(); ++i) {
      const NumberDistribution& d = value.distributions[i];
      const double number = formed(value.form, own(i), next(d));
      drawn.numbers.push_back(number);
      if (!d.is_constant()) drawn.shown.push_back(number);
    }
    return drawn;
  }

  DrawnValue operator()(const CommonNumber& value) {
    DrawnValue drawn;
    const double number = next(value.distribution);
    for (const double nominal : nominal_) drawn.numbers.push_back(formed(value.form, nominal, number));
    drawn.shown = {number};
    return drawn;
  }

  DrawnValue operator()(const CorrelatedNumbers& value) {
    const std::size_t n = value.mean.size();
    std::vector<double> z;
    for (std::size_t i = 0; i < n; ++i) z.push_back(normal_quantile(next()));
    DrawnValue drawn;
    for (std::size_t i = 0; i < n; ++i) {
      double number = value.mean[i];
      for (std::size_t j = 0; j <= i; ++j) number += value.factor[i * n + j] * z[j];
      drawn.numbers.push_back(formed(value.form, own(i), number));
    }
    drawn.shown = drawn.numbers;
    return drawn;
  }

  DrawnValue operator()(const SphereVector& value) {
    const double u = next(), v = next();
    const double length = next(value.length);
    return with_length(length * random_direction(u, v), value.length, length);
  }

  DrawnValue operator()(const TiltedVector& value) {
    const double t1 = value.deviation > 0 ? value.deviation * normal_quantile(next()) : 0;
    const double t2 = value.deviation > 0 ? value.deviation * normal_quantile(next()) : 0;
    const double factor = next(value.factor);
    const Vector3d own_vector{own(0), own(1), own(2)};
    return with_length(factor * tilted(own_vector, t1, t2), value.factor, factor * norm(own_vector));
  }

  DrawnValue operator()(const UncertainRotation& value) {
    const double u = next(), v = next(), w = next();
    if (value.uniform) {
      const Quaterniond q = random_rotation(u, v, w);
      return {{q.w, q.x, q.y, q.z}, {q.w, q.x, q.y, q.z}};
    }
    const Vector3d turn = value.deviation * Vector3d{normal_quantile(u), normal_quantile(v), normal_quantile(w)};
    const Quaterniond q = Quaterniond{own(0), own(1), own(2), own(3)} * quaternion_by(turn);
    return {{q.w, q.x, q.y, q.z}, {turn[0], turn[1], turn[2]}};
  }

  DrawnValue operator()(const ChosenValue& value) {
    const auto which = static_cast<double>(chosen(value.running_sums, next()));
    return {{which}, {which}};
  }

 private:
  double own(std::size_t i) const { return i < nominal_.size() ? nominal_[i] : 0; }
  double next() { return point_[at_++]; }
  double next(const NumberDistribution& d) { return d.is_constant() ? d.location : d.at(next()); }

  static DrawnValue with_length(const Vector3d& v, const NumberDistribution& of_length, double length) {
    DrawnValue drawn{{v[0], v[1], v[2]}, {v[0], v[1], v[2]}};
    if (!of_length.is_constant()) drawn.shown.push_back(length);
    return drawn;
  }

  std::span<const double> nominal_, point_;
  std::size_t at_ = 0;
};

struct Counter {
  std::size_t operator()(const IndependentNumbers& value) const {
    std::size_t count = 0;
    for (const NumberDistribution& d : value.distributions) count += varying(d);
    return count;
  }
  std::size_t operator()(const CommonNumber& value) const { return varying(value.distribution); }
  std::size_t operator()(const CorrelatedNumbers& value) const { return value.mean.size(); }
  std::size_t operator()(const SphereVector& value) const { return 2 + varying(value.length); }
  std::size_t operator()(const TiltedVector& value) const {
    return (value.deviation > 0 ? 2u : 0u) + varying(value.factor);
  }
  std::size_t operator()(const UncertainRotation&) const { return 3; }
  std::size_t operator()(const ChosenValue&) const { return 1; }
};

struct Replaces {
  bool operator()(const IndependentNumbers& value) const { return value.form == ValueForm::value; }
  bool operator()(const CommonNumber& value) const { return value.form == ValueForm::value; }
  bool operator()(const CorrelatedNumbers& value) const { return value.form == ValueForm::value; }
  bool operator()(const SphereVector&) const { return true; }
  bool operator()(const TiltedVector&) const { return false; }
  bool operator()(const UncertainRotation& value) const { return value.uniform; }
  bool operator()(const ChosenValue&) const { return true; }
};

}  // namespace

std::size_t dimensions(const UncertainValue& value) { return std::visit(Counter{}, value); }

bool replaces(const UncertainValue& value) { return std::visit(Replaces{}, value); }

DrawnValue draw_value(const UncertainValue& value, std::span<const double> nominal, std::span<const double> point) {
  return std::visit(Drawer(nominal, point), value);
}

namespace {

double own_number(std::span<const double> nominal, std::size_t i) { return i < nominal.size() ? nominal[i] : 0; }

// Factor on a deviation, by the form of the drawn number.
double slope_of(ValueForm form, double nominal) { return form == ValueForm::factor ? nominal : 1; }

double normal_density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi); }

// P(low < Z < high), also in the upper tail.
double normal_part(double low, double high) {
  return low > 0 ? normal_probability(-low) - normal_probability(-high)
                 : normal_probability(high) - normal_probability(low);
}

ValueMoments independent(const std::vector<std::array<double, 2>>& numbers) {
  ValueMoments all;
  const std::size_t n = numbers.size();
  all.covariance.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    all.mean.push_back(numbers[i][0]);
    all.covariance[i * n + i] = numbers[i][1];
  }
  return all;
}

struct MomentsOf {
  std::span<const double> nominal;

  std::optional<ValueMoments> operator()(const IndependentNumbers& value) const {
    std::vector<std::array<double, 2>> numbers;
    for (std::size_t i = 0; i < value.distributions.size(); ++i) {
      const NumberDistribution& d = value.distributions[i];
      if (d.is_constant()) continue;
      if (d.kind == NumberDistribution::Kind::integers) return {};
      const double own = own_number(nominal, i), slope = slope_of(value.form, own);
      const auto [mean, variance] = moments_of(d);
      numbers.push_back({formed(value.form, own, mean), slope * slope * variance});
    }
    return independent(numbers);
  }
  std::optional<ValueMoments> operator()(const CommonNumber& value) const {
    if (value.distribution.kind == NumberDistribution::Kind::integers) return {};
    return independent({moments_of(value.distribution)});
  }
  std::optional<ValueMoments> operator()(const CorrelatedNumbers& value) const {
    const std::size_t n = value.mean.size();
    ValueMoments all;
    all.covariance.assign(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
      all.mean.push_back(formed(value.form, own_number(nominal, i), value.mean[i]));
      for (std::size_t j = 0; j < n; ++j) {
        double sum = 0;
        for (std::size_t k = 0; k < n; ++k) sum += value.factor[i * n + k] * value.factor[j * n + k];
        all.covariance[i * n + j] =
            sum * slope_of(value.form, own_number(nominal, i)) * slope_of(value.form, own_number(nominal, j));
      }
    }
    return all;
  }
  std::optional<ValueMoments> operator()(const SphereVector&) const { return {}; }
  std::optional<ValueMoments> operator()(const TiltedVector& value) const {
    std::vector<std::array<double, 2>> numbers;
    const double variance = value.deviation * value.deviation;
    if (variance > 0) numbers = {{0, variance}, {0, variance}};
    if (!value.factor.is_constant()) numbers.push_back(moments_of(value.factor));
    return independent(numbers);
  }
  std::optional<ValueMoments> operator()(const UncertainRotation& value) const {
    if (value.uniform) return {};
    const double variance = value.deviation * value.deviation;
    return independent({{0, variance}, {0, variance}, {0, variance}});
  }
  std::optional<ValueMoments> operator()(const ChosenValue&) const { return {}; }
};

struct NumbersOfScenario {
  std::span<const double> nominal, varying;

  std::vector<double> operator()(const IndependentNumbers& value) const {
    std::vector<double> numbers;
    std::size_t at = 0;
    for (std::size_t i = 0; i < value.distributions.size(); ++i) {
      const NumberDistribution& d = value.distributions[i];
      if (varying.empty() && !d.is_constant())
        numbers.push_back(own_number(nominal, i));
      else
        numbers.push_back(d.is_constant() ? formed(value.form, own_number(nominal, i), d.location) : varying[at++]);
    }
    return numbers;
  }
  std::vector<double> operator()(const CommonNumber& value) const {
    std::vector<double> numbers;
    for (const double own : nominal) numbers.push_back(varying.empty() ? own : formed(value.form, own, varying[0]));
    return numbers;
  }
  std::vector<double> operator()(const CorrelatedNumbers&) const { return {varying.begin(), varying.end()}; }
  std::vector<double> operator()(const TiltedVector& value) const {
    const bool tilts = value.deviation > 0;
    const double factor = value.factor.is_constant() ? value.factor.location : varying[tilts ? 2 : 0];
    const Vector3d own{own_number(nominal, 0), own_number(nominal, 1), own_number(nominal, 2)};
    const Vector3d v = factor * (tilts ? tilted(own, varying[0], varying[1]) : own);
    return {v[0], v[1], v[2]};
  }
  std::vector<double> operator()(const UncertainRotation&) const {
    const Quaterniond own{own_number(nominal, 0), own_number(nominal, 1), own_number(nominal, 2),
                          own_number(nominal, 3)};
    const Quaterniond q = varying.empty() ? own : own * quaternion_by({varying[0], varying[1], varying[2]});
    return {q.w, q.x, q.y, q.z};
  }
  std::vector<double> operator()(const SphereVector&) const { return {nominal.begin(), nominal.end()}; }
  std::vector<double> operator()(const ChosenValue& value) const {
    std::size_t most = 0;
    double largest = 0, before = 0;
    for (std::size_t i = 0; i < value.running_sums.size(); ++i) {
      const double weight = value.running_sums[i] - std::exchange(before, value.running_sums[i]);
      if (weight > largest) largest = weight, most = i;
    }
    return {static_cast<double>(most)};
  }
};

}  // namespace

std::array<double, 2> moments_of(const NumberDistribution& d) {
  using Kind = NumberDistribution::Kind;
  if (d.kind == Kind::constant) return {d.location, 0};
  if (d.kind == Kind::uniform) return {0.5 * (d.from + d.to), (d.to - d.from) * (d.to - d.from) / 12};
  if (d.kind == Kind::integers) return {0.5 * (d.from + d.to), ((d.to - d.from + 1) * (d.to - d.from + 1) - 1) / 12};
  std::array<double, 2> bounds{-HUGE_VAL, HUGE_VAL};
  if (d.cut) bounds = d.standard_bounds();
  const auto [low, high] = bounds;
  if (d.kind == Kind::log_normal) {
    // E[X^k] = location^k exp(k^2 s^2 / 2) P(low - k s < Z < high - k s) / P(low < Z < high).
    const double s = d.scale, part = normal_part(low, high);
    const double first = std::exp(0.5 * s * s) * normal_part(low - s, high - s) / part;
    const double second = std::exp(2 * s * s) * normal_part(low - 2 * s, high - 2 * s) / part;
    return {d.location * first, d.location * d.location * std::max(second - first * first, 0.0)};
  }
  if (!d.cut) return {d.location, d.scale * d.scale};
  const auto term = [](double z) { return std::isfinite(z) ? z * normal_density(z) : 0; };
  const double part = normal_part(low, high);
  const double mean = (normal_density(low) - normal_density(high)) / part;
  const double variance = 1 + (term(low) - term(high)) / part - mean * mean;
  return {d.location + d.scale * mean, d.scale * d.scale * std::max(variance, 0.0)};
}

std::optional<ValueMoments> moments_of(const UncertainValue& value, std::span<const double> nominal) {
  return std::visit(MomentsOf{nominal}, value);
}

std::vector<double> placed_numbers(const UncertainValue& value, std::span<const double> nominal,
                                   std::span<const double> varying) {
  return std::visit(NumbersOfScenario{nominal, varying}, value);
}

}  // namespace grapnel
