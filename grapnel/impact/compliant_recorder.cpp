/// Samples and peaks of a compliant impact (compliant_stepper.hpp).

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <iterator>

#include "grapnel/impact/compliant_stepper.hpp"

namespace grapnel {
namespace {

// Binary digits of a peak's position in an interval: half of a double's, the limit of what values resolve.
constexpr int kPeakBits = 26;

}  // namespace

CompliantRecorder::CompliantRecorder(CompliantSystem& system, int samples, double spacing)
    : system_(system),
      samples_(samples),
      spacing_(spacing),
      peaks_(static_cast<std::size_t>(measures * system.interfaces())),
      touching_(system.contact_count()) {
  for (std::vector<double>& values : stage_values_) values.resize(peaks_.size());
}

double CompliantRecorder::measure(std::span<const InterfaceLoad> loads, std::size_t index) {
  const InterfaceLoad& load = loads[index / measures];
  switch (index % measures) {
    case force:
      return norm(load.F.linear);
    case moment:
      return norm(load.F.angular);
    default:
      return load.deformation;
  }
}

void CompliantRecorder::measure_all(std::span<const InterfaceLoad> loads, std::vector<double>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = measure(loads, i);
}

// Most samples are dropped as the grid becomes coarser: states and forces are computed once the remaining ones are
// known.
void CompliantRecorder::take(double t, long grid, std::span<const double> y) {
  taken_.push_back({t, grid});
  y_.insert(y_.end(), y.begin(), y.end());
}

// In blocks, so that the working set fits the cache.
void CompliantRecorder::evaluate() {
  constexpr std::size_t kAtOnce = 32;
  const std::size_t size = system_.size(), nq = system_.now().q.size(), nv = system_.now().v.size();
  while (states_.size() < taken_.size()) {
    const std::size_t done = states_.size(), count = std::min(kAtOnce, taken_.size() - done);
    times_.clear();
    for (std::size_t k = 0; k < count; ++k) times_.push_back(taken_[done + k].t);
    const std::size_t row = y_.size() - (taken_.size() - done) * size;
    system_.sample(times_, std::span(y_).subspan(row, count * size), sampled_);
    for (std::size_t k = 0; k < count; ++k) {
      const double *q = &sampled_.q[k * nq], *v = sampled_.v.data() + k * nv,
                   *a = sampled_.acceleration.data() + k * nv;
      State& state = states_.emplace_back();
      state.q.assign(q, q + nq), state.v.assign(v, v + nv);
      accelerations_.emplace_back(a, a + nv);
    }
    loads_.insert(loads_.end(), sampled_.loads.begin(), sampled_.loads.end());
    std::move(sampled_.shapes.begin(), sampled_.shapes.end(), std::back_inserter(shapes_));
    std::move(sampled_.multipliers.begin(), sampled_.multipliers.end(), std::back_inserter(multipliers_));
  }
  y_.clear();
}

void CompliantRecorder::mark(double t, std::span<const double> y) {
  take(t, -1, y);
  evaluate();
  const auto count = static_cast<std::size_t>(system_.interfaces());
  measure_all(std::span(loads_).last(count), stage_values_[0]);
  for (std::size_t i = 0; i < peaks_.size(); ++i) {
    if (stage_values_[0][i] > peaks_[i].value) peaks_[i] = {stage_values_[0][i], t};
  }
}

// Drops every second point of the grid.
void CompliantRecorder::thin() {
  const std::size_t size = system_.size(), interfaces = system_.interfaces(), evaluated = states_.size();
  std::size_t retained = 0, retained_evaluated = 0;
  on_grid_ = 0;
  for (std::size_t i = 0; i < taken_.size(); ++i) {
    Sample s = taken_[i];
    if (s.grid > 0 && s.grid % 2 == 1) continue;
    if (s.grid > 0) s.grid /= 2, ++on_grid_;
    taken_[retained] = s;
    if (i < evaluated) {
      states_[retained].q.swap(states_[i].q), states_[retained].v.swap(states_[i].v);
      accelerations_[retained].swap(accelerations_[i]);
      std::copy_n(loads_.begin() + static_cast<std::ptrdiff_t>(i * interfaces), interfaces,
                  loads_.begin() + static_cast<std::ptrdiff_t>(retained * interfaces));
      if (!shapes_.empty() && retained != i) shapes_[retained] = std::move(shapes_[i]);
      if (!multipliers_.empty()) multipliers_[retained].swap(multipliers_[i]);
      ++retained_evaluated;
    } else {
      std::copy_n(y_.begin() + static_cast<std::ptrdiff_t>((i - evaluated) * size), size,
                  y_.begin() + static_cast<std::ptrdiff_t>((retained - retained_evaluated) * size));
    }
    ++retained;
  }
  taken_.resize(retained);
  states_.resize(retained_evaluated), accelerations_.resize(retained_evaluated);
  if (!shapes_.empty()) shapes_.resize(retained_evaluated);
  if (!multipliers_.empty()) multipliers_.resize(retained_evaluated);
  loads_.resize(retained_evaluated * interfaces);
  y_.resize((retained - retained_evaluated) * size);
  spacing_ *= 2;
  next_ = (next_ + 1) / 2;
}

// Accepted step => samples on the grid, contact times and updated peaks of force, moment and deformation. Peaks: values
// at the stages; where the parabola through three neighbours exceeds the current peak, a refined search.
void CompliantRecorder::step(StiffIntegrator& integrator) {
  const double from = integrator.step_begin(), to = integrator.time();
  for (std::size_t c = 0; c < touching_.size(); ++c) {
    if (system_.phase[c] == ContactPhase::pressing) touching_[c] += to - from;
  }
  while (spacing_ * static_cast<double>(next_) <= to) {
    const double t = spacing_ * static_cast<double>(next_);
    take(t, next_, integrator.at(t));
    ++next_;
    if (++on_grid_ >= 2 * samples_) thin();
  }
  std::array<double, kStagePoints> stage_time{from};
  constexpr int last = kStagePoints - 1;
  for (int k = 1; k <= last; ++k) {
    stage_time[k] = integrator.time_of_stage(k - 1);
    measure_all(integrator.loads_at_stage(k - 1), stage_values_[k]);
  }
  for (std::size_t i = 0; i < peaks_.size(); ++i) {
    for (int k = 1; k <= last; ++k) {
      if (stage_values_[k][i] > peaks_[i].value) peaks_[i] = {stage_values_[k][i], stage_time[k]};
    }
    // The parabola through three neighbours decides whether a peak lies between them and justifies a search.
    for (int k = 1; k < last; ++k) {
      const double a = stage_time[k - 1], b = stage_time[k], c = stage_time[k + 1];
      const double rise = (stage_values_[k][i] - stage_values_[k - 1][i]) / (b - a),
                   next = (stage_values_[k + 1][i] - stage_values_[k][i]) / (c - b);
      const double curvature = (next - rise) / (c - a);
      if (!(curvature < 0)) continue;
      const double slope = rise + curvature * (b - a), place = b - slope / (2 * curvature);  // at b; of the vertex
      if (place < a || place > c || stage_values_[k][i] - slope * slope / (4 * curvature) <= peaks_[i].value) continue;
      refine(integrator, a, c, i);
    }
  }
  stage_values_[0].swap(stage_values_[last]);
}

// The error of the value is of second order in that of the position.
void CompliantRecorder::refine(StiffIntegrator& integrator, double from, double to, std::size_t index) {
  const auto negative = [&](double s) {
    const double t = from + s * (to - from);
    system_.load(t, integrator.at(t));
    return -measure(system_.loads(), index);
  };
  const auto [place, value] = boost::math::tools::brent_find_minima(negative, 0.0, 1.0, kPeakBits);
  if (-value > peaks_[index].value) peaks_[index] = {-value, from + place * (to - from)};
}

// Recorded samples and peaks => times, states, accelerations and force histories of the outcome; the recorder's states
// are moved out.
void CompliantRecorder::finish(ImpactSolution& outcome) {
  const int contacts = system_.contact_count();
  for (const Sample& s : taken_) outcome.times.push_back(s.t);
  outcome.states = std::move(states_);
  outcome.accelerations = std::move(accelerations_);
  outcome.loop_multipliers = std::move(multipliers_);
  if (system_.has_shapes()) system_.shapes().results().samples = std::move(shapes_);
  for (std::size_t k = 0; k < loads_.size(); ++k) {
    const InterfaceLoad& load = loads_[k];
    ForceHistory& h = outcome.forces[k % static_cast<std::size_t>(system_.interfaces())];
    h.point.push_back(load.point);
    h.force.push_back(load.F.linear);
    h.moment.push_back(load.F.angular);
    h.deformation.push_back(load.deformation);
  }
  for (int i = 0; i < system_.interfaces(); ++i) {
    ForceHistory& h = outcome.forces[i];
    const Peak* const peaks = &peaks_[static_cast<std::size_t>(measures * i)];
    h.peak_force = peaks[force].value, h.peak_force_time = peaks[force].time;
    h.peak_moment = peaks[moment].value, h.peak_moment_time = peaks[moment].time;
    h.largest_deformation = peaks[deformation].value;
    if (i < contacts) h.duration = touching_[i];
  }
}

}  // namespace grapnel
