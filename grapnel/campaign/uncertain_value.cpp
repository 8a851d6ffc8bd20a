#include "grapnel/campaign/uncertain_value.hpp"

namespace grapnel {
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
    const Quaterniond q = Quaterniond{own(0), own(1), own(2), own(3)} * rotation_by(turn);
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

}  // namespace grapnel
