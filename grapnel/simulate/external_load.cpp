#include "grapnel/simulate/external_load.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace grapnel {
namespace {

// The wrench at time t by the line of the table that is valid at `inside`.
Wrenchd on_line(const LoadProfile& p, double t, double inside) {
  if (p.times.empty() || inside < p.times.front() || inside > p.times.back()) return Wrenchd::zero();
  const auto above = std::upper_bound(p.times.begin(), p.times.end(), inside);
  const std::size_t next =
      above == p.times.end() ? p.times.size() - 1 : static_cast<std::size_t>(above - p.times.begin());
  const double x = (t - p.times[next - 1]) / (p.times[next] - p.times[next - 1]);
  return (1 - x) * p.values[next - 1] + x * p.values[next];
}

bool finite(const Wrenchd& F) {
  return std::isfinite(dot(F.angular, F.angular)) && std::isfinite(dot(F.linear, F.linear));
}

// Table profile => nothing; throws std::invalid_argument unless it has at least two finite samples at increasing times.
void validate_table(const LoadProfile& p) {
  if (p.times.size() < 2) throw std::invalid_argument("external load: a table needs at least two samples");
  if (p.values.size() != p.times.size()) {
    throw std::invalid_argument("external load: a table's times and values differ in number");
  }
  for (std::size_t k = 0; k < p.times.size(); ++k) {
    if (!std::isfinite(p.times[k]) || !finite(p.values[k])) {
      throw std::invalid_argument("external load: a number is not finite");
    }
    if (k > 0 && !(p.times[k] > p.times[k - 1])) {
      throw std::invalid_argument("external load: a table's times must increase");
    }
  }
}

bool is_unit(const Vector3d& v) { return std::abs(norm(v) - 1) < 1e-9; }

void validate_stream(const ExternalLoad& load) {
  const Stream& s = *load.stream;
  if (load.profile.shape == LoadProfile::Shape::table)
    throw std::invalid_argument("external load: a table states the wrench itself and cannot have a stream");
  if (load.frame == LoadFrame::body) throw std::invalid_argument("external load: a stream does not turn with the body");
  if (!is_unit(s.direction) || !is_unit(s.normal))
    throw std::invalid_argument("external load: a stream's direction and normal must be unit vectors");
  if (!(s.pressure >= 0 && s.area >= 0) || !std::isfinite(s.pressure * s.area))
    throw std::invalid_argument("external load: a stream's pressure and area must not be negative");
  if (!(s.specular >= 0 && s.diffuse >= 0 && s.specular + s.diffuse <= 1))
    throw std::invalid_argument("external load: the sum of specular and diffuse must be at most 1");
}

}  // namespace

Wrenchd wrench_at(const ExternalLoad& load, double t) { return wrench_at(load, t, t); }

Wrenchd wrench_at(const ExternalLoad& load, double t, double inside) {
  const LoadProfile& p = load.profile;
  if (inside < p.start || inside >= p.end) return Wrenchd::zero();
  if (p.shape == LoadProfile::Shape::table) return on_line(p, t, inside);
  if (p.shape == LoadProfile::Shape::constant) return load.amplitude;
  return factor_at(p, t, inside) * load.amplitude;
}

// Time t => factor on the amplitude; zero if `inside`, a time of the same smooth interval, is outside [start, end).
double factor_at(const LoadProfile& p, double t, double inside) {
  if (inside < p.start || inside >= p.end) return 0;
  switch (p.shape) {
    case LoadProfile::Shape::half_sine:
      return std::sin(std::numbers::pi * (t - p.start) / (p.end - p.start));
    case LoadProfile::Shape::sine:
      return std::sin(2 * std::numbers::pi * p.frequency * (t - p.start) + p.phase);
    case LoadProfile::Shape::constant:
    case LoadProfile::Shape::table:
      break;
  }
  return 1;
}

Vector3d stream_force(const Stream& stream, const Vector3d& direction, const Vector3d& normal) {
  double facing = -dot(direction, normal);  // cosine of the angle of incidence
  Vector3d n = normal;
  if (stream.both_sides && facing < 0) facing = -facing, n = -normal;
  if (!(facing > 0)) return Vector3d::zero();
  return force_on_facing_side(stream.pressure * stream.area, stream.specular, stream.diffuse, facing, direction, n);
}

// Load => finite times, in increasing order, at which its wrench jumps or has a kink: start, table samples, end.
std::vector<double> break_times(const ExternalLoad& load) {
  const LoadProfile& p = load.profile;
  std::vector<double> times;
  const auto add = [&](double t) {
    if (std::isfinite(t) && (times.empty() || t > times.back())) times.push_back(t);
  };
  add(p.start);
  if (p.shape == LoadProfile::Shape::table) {
    for (double t : p.times) {
      if (t > p.start && t < p.end) add(t);
    }
  }
  add(p.end);
  return times;
}

// Load => nothing; throws std::invalid_argument for an empty interval, a half sine without finite ends, non-finite
// numbers, or an invalid table or stream.
void validate(const ExternalLoad& load) {
  const LoadProfile& p = load.profile;
  if (!(p.end > p.start)) throw std::invalid_argument("external load: it must end after it starts");
  if (p.shape == LoadProfile::Shape::half_sine && !std::isfinite(p.end - p.start)) {
    throw std::invalid_argument("external load: a half sine needs a finite start and end");
  }
  const bool is_sine = p.shape == LoadProfile::Shape::sine;
  if (!std::isfinite(dot(load.p_BP, load.p_BP)) || (is_sine && !std::isfinite(p.start + p.frequency + p.phase))) {
    throw std::invalid_argument("external load: a number is not finite");
  }
  if (p.shape == LoadProfile::Shape::table) {
    validate_table(p);
  } else if (!finite(load.amplitude)) {
    throw std::invalid_argument("external load: a number is not finite");
  }
  if (load.stream) validate_stream(load);
}

}  // namespace grapnel
