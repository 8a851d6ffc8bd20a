#include "grapnel/impact/compliant_record.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {

CompliantRecorder::CompliantRecorder(CompliantSystem& system, int samples, double spacing)
    : system_(system),
      samples_(samples),
      spacing_(spacing),
      begin_(measures * system.interfaces()),
      middle_(begin_),
      end_(begin_),
      peaks_(begin_.size()),
      touching_(system.contact_count()) {}

double CompliantRecorder::measure(std::size_t index) const {
  const InterfaceLoad& load = system_.loads()[index / measures];
  switch (index % measures) {
    case force:
      return norm(load.F.linear);
    case moment:
      return norm(load.F.angular);
    default:
      return load.deformation;
  }
}

void CompliantRecorder::measure_all(std::vector<double>& values) const {
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = measure(i);
}

void CompliantRecorder::take(double t, long grid) {
  Sample sample{t, grid, system_.now(), system_.accelerations_now(), {}, {}, {}, {}};
  for (const InterfaceLoad& load : system_.loads()) {
    sample.point.push_back(load.point);
    sample.force.push_back(load.F.linear);
    sample.moment.push_back(load.F.angular);
    sample.deformation.push_back(load.deformation);
  }
  taken_.push_back(std::move(sample));
}

void CompliantRecorder::mark(double t, std::span<const double> y) {
  system_.load(t, y);
  take(t, -1);
  measure_all(begin_);
  for (std::size_t i = 0; i < begin_.size(); ++i) {
    if (begin_[i] > peaks_[i].value) peaks_[i] = {begin_[i], t};
  }
}

// Every second point of the grid goes.
void CompliantRecorder::thin() {
  std::erase_if(taken_, [](const Sample& s) { return s.grid > 0 && s.grid % 2 == 1; });
  on_grid_ = 0;
  for (Sample& s : taken_) {
    if (s.grid > 0) s.grid /= 2, ++on_grid_;
  }
  spacing_ *= 2;
  next_ = (next_ + 1) / 2;
}

void CompliantRecorder::step(StiffIntegrator& integrator, double from, double to) {
  if (!(to > from)) return;
  for (std::size_t c = 0; c < touching_.size(); ++c) {
    if (system_.phase[c] == ContactPhase::pressing) touching_[c] += to - from;
  }
  while (spacing_ * static_cast<double>(next_) <= to) {
    const double t = spacing_ * static_cast<double>(next_);
    system_.load(t, integrator.at(t));
    take(t, next_);
    ++next_;
    if (++on_grid_ >= 2 * samples_) thin();
  }
  const double middle = 0.5 * (from + to);
  system_.load(middle, integrator.at(middle));
  measure_all(middle_);
  system_.load(to, integrator.y());
  measure_all(end_);
  for (std::size_t i = 0; i < begin_.size(); ++i) {
    // The parabola through beginning, middle and end says whether a peak lies in between and is worth a search.
    const double a = begin_[i], b = middle_[i], c = end_[i], bend = a - 2 * b + c, slope = 0.5 * (c - a);
    if (b > peaks_[i].value) peaks_[i] = {b, middle};
    if (c > peaks_[i].value) peaks_[i] = {c, to};
    if (bend < 0 && std::abs(slope) < -1.5 * bend && b - slope * slope / (2 * bend) > peaks_[i].value) {
      refine(integrator, from, to, i);
    }
  }
  begin_.swap(end_);
}

// Golden section; the value's error is of second order in that of the place.
void CompliantRecorder::refine(StiffIntegrator& integrator, double from, double to, std::size_t index) {
  const double golden = 0.6180339887498949;
  const auto value = [&](double t) {
    system_.load(t, integrator.at(t));
    return measure(index);
  };
  double a = from, b = to;
  double x1 = b - golden * (b - a), x2 = a + golden * (b - a);
  double f1 = value(x1), f2 = value(x2);
  for (int i = 0; i < 40; ++i) {
    if (f1 < f2) {
      a = x1, x1 = x2, f1 = f2, x2 = a + golden * (b - a), f2 = value(x2);
    } else {
      b = x2, x2 = x1, f2 = f1, x1 = b - golden * (b - a), f1 = value(x1);
    }
  }
  Peak& peak = peaks_[index];
  if (f1 > peak.value) peak = {f1, x1};
  if (f2 > peak.value) peak = {f2, x2};
}

void CompliantRecorder::finish(CompliantOutcome& outcome) {
  const int contacts = system_.contact_count();
  const auto history = [&](int i) -> ForceHistory& {
    return i < contacts ? outcome.contacts[i] : outcome.grasps[i - contacts];
  };
  for (const Sample& s : taken_) {
    outcome.times.push_back(s.t);
    outcome.states.push_back(s.state);
    outcome.accelerations.push_back(s.vdot);
    for (int i = 0; i < system_.interfaces(); ++i) {
      history(i).point.push_back(s.point[i]);
      history(i).force.push_back(s.force[i]);
      history(i).moment.push_back(s.moment[i]);
      history(i).deformation.push_back(s.deformation[i]);
    }
  }
  for (int i = 0; i < system_.interfaces(); ++i) {
    ForceHistory& h = history(i);
    const Peak* const peaks = &peaks_[static_cast<std::size_t>(measures * i)];
    h.peak_force = peaks[force].value, h.peak_force_time = peaks[force].time;
    h.peak_moment = peaks[moment].value, h.peak_moment_time = peaks[moment].time;
    h.largest_deformation = peaks[deformation].value;
    if (i < contacts) h.duration = touching_[i];
  }
}

}  // namespace grapnel
